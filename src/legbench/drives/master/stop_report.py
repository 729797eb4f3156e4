"""Report of a stop, and the interface of whoever leads drives and so has to stop them."""

from abc import ABC, abstractmethod
from dataclasses import dataclass, replace
from types import TracebackType
from typing import Self

from legbench.drives.errors import StopError


@dataclass(frozen=True, slots=True, kw_only=True)
class StopReport:
    """Result of a stop of all drives of one master, by their names in the bus file."""

    powered: tuple[str, ...] = ()
    """Drives that still show a state with power."""
    states: tuple[str, ...] = ()
    """Statusword in words, one for every drive that still shows power."""
    silent: tuple[str, ...] = ()
    """Drives that no longer answer, so that nobody knows whether they have power."""
    cut_off: tuple[str, ...] = ()
    """Drives whose voltage was disabled before their quick-stop ramp had ended."""
    errors: tuple[str, ...] = ()
    """Errors raised during the stop, such as a frame that could not be sent."""

    @property
    def verified(self) -> bool:
        """Whether every drive has been seen without power."""
        return not (self.powered or self.silent)

    @property
    def trouble(self) -> str | None:
        """Warning to the person beside the leg, in one line; none after a verified stop."""
        parts = [
            f"drive '{name}' keeps its power after the stop ({state}): switch its power off"
            for name, state in zip(self.powered, self.states, strict=True)
        ]
        parts += [
            f"drive '{name}' no longer answers, so whether it has power is not known: its own "
            "watchdogs have to stop it; switch its power off before you touch the leg"
            for name in self.silent
        ]
        return "; ".join(parts) or None

    def after(self, earlier: "StopReport | None") -> "StopReport":
        """Return this report of a repeated stop, joined with what the earlier one had to tell."""
        if earlier is None:
            return self
        return replace(
            self,
            cut_off=tuple(dict.fromkeys(earlier.cut_off + self.cut_off)),
            errors=tuple(dict.fromkeys(earlier.errors + self.errors)),
        )


class DriveLeader(ABC):
    """Interface of everything that gives drives power, and takes it away when its `with` ends."""

    @property
    @abstractmethod
    def stopped(self) -> StopReport | None:
        """Report of its last stop; none if it never had to stop anything."""

    @abstractmethod
    def close(self) -> None:
        """Take the power away, check that it is gone; may be called twice, raises no error."""

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Close.

        Raises:
            StopError: a drive keeps its power or does not answer. If an exception is on its way
                already, it gets that as a note.
        """
        try:
            self.close()
        except BaseException as late:
            add_trouble(late, self.stopped)
            raise
        if error is not None:
            add_trouble(error, self.stopped)
        elif self.stopped is not None and self.stopped.trouble is not None:
            raise StopError(self.stopped.trouble)


def add_trouble(error: BaseException, report: StopReport | None) -> None:
    """Give an exception the trouble of a stop as a note, once."""
    trouble = None if report is None else report.trouble
    if trouble is not None and trouble not in getattr(error, "__notes__", ()):
        error.add_note(trouble)
