"""The destination of a `RunWriter`'s rows."""

from abc import ABC, abstractmethod
from dataclasses import dataclass

from legbench.closing import Closing
from legbench.recording.files import Appender
from legbench.recording.rows import BATCH_ROWS, RowBlock

MAX_WAITING = 60_000 // BATCH_ROWS
"""Largest number of blocks that may wait for the disk: 60 s at 1 kHz, 14 MB."""


@dataclass(slots=True)
class Kept:
    """Part of a run that has reached the operating system, as far as is known."""

    rows: int = 0
    first: float = 0.0
    """Time of the first row [s]."""
    last: float = 0.0
    """Time of the last row [s]."""
    error: Exception | None = None
    """First failure of the samples, after which no more rows are written."""
    events_error: Exception | None = None
    """First failure of the events; rows are written all the same."""


class AbstractLog(Closing):
    """Lines beside the rows of a run, such as raw frames, written where the rows are written.

    A log whose disk fails, or is so slow that no more may wait for it, ends with its last whole
    line; the run goes on.
    """

    @property
    @abstractmethod
    def error(self) -> str | None:
        """Why the log ended before its run, None if it did not; final after `close`."""

    @abstractmethod
    def write(self, line: bytes) -> None:
        """Take one whole line; never raises."""

    @abstractmethod
    def close(self) -> None:
        """Wait until every line is written or lost; may be called twice, never raises."""


class AbstractDisk(ABC):
    """Destination of the blocks and events of one run.

    Attributes:
        kept: what has been written.
    """

    kept: Kept

    @property
    @abstractmethod
    def lagging(self) -> bool:
        """Whether more rows wait than a run may have in memory."""

    @abstractmethod
    def take(self, block: RowBlock) -> None:
        """Take the rows of a block and empty it; raises nothing, an error is in `kept`."""

    @abstractmethod
    def event(self, line: bytes) -> None:
        """Take one whole line for the events; raises nothing, an error is in `kept`."""

    @abstractmethod
    def log(self, file: Appender) -> AbstractLog:
        """Begin a log in a file, which is the log's from now on; raises OSError."""

    @abstractmethod
    def finish(self) -> None:
        """Write what waits and the end mark, and end; `kept` is final then."""

    @abstractmethod
    def close(self) -> None:
        """Close both files, which releases the lock on the run."""
