"""Functions that watch a run and must not be able to end it."""

from collections.abc import Callable
from typing import final


@final
class Onlooker:
    """Caller of a function that only watches, such as a progress bar; its errors end nothing.

    Once the function has failed it is not called any more: what is broken stays broken, and a
    control loop has no time to try. SystemExit and KeyboardInterrupt pass, they are the user's.

    Attributes:
        name: of the function, for those who report its failure.
        failure: what it raised, in one line; None while it works.
    """

    def __init__(self, name: str, function: Callable[..., object] | None) -> None:
        """Watch with a function, or with none."""
        self.name = name
        self.failure: str | None = None
        self._function = function

    def __call__(self, *arguments: object) -> None:
        """Call the function, unless it has failed before."""
        if self._function is None:
            return
        try:
            self._function(*arguments)
        except Exception as error:  # A closed terminal, a full disk, a mistake: all the same here.
            self._function = None
            self.failure = f"{type(error).__name__}: {error}"
