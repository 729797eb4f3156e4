"""The part of a run that a measurement needs: its rows and its description."""

from pathlib import Path
from typing import Any, Protocol

from numpy.typing import NDArray

from legbench.recording.description import Reference, RunDescription
from legbench.signals import Floats

__all__ = ["Recorded", "Reference"]


class Recorded(Protocol):
    """The part of a recording that is measured; `legbench.recording` fulfils it."""

    @property
    def path(self) -> Path:
        """The run folder."""
        ...

    @property
    def description(self) -> RunDescription:
        """Description that the run holds; raises FormatError where it describes no leg."""
        ...

    @property
    def time(self) -> Floats:
        """Plant time of every row (n,) [s]."""
        ...

    @property
    def has_truth(self) -> bool:
        """Whether a simulation filled the truth signals."""
        ...

    def __getitem__(self, name: str, /) -> NDArray[Any]:
        """Rows of the signal `name`, (n,), or (n, m) for m components."""
        ...
