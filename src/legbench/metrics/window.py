"""Consecutive rows of a recording as a recording of their own, without copies."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final, final

from numpy.typing import NDArray

from legbench.metrics.source import Recorded
from legbench.recording.description import RunDescription
from legbench.signals import Floats

WINDOW_ROWS: Final = 1 << 18
"""Rows that are measured at once, so that intermediate results of a long run need no more memory
than those of a short one: four minutes at 1 kHz, 2 MB a column."""


@final
class RowWindow:
    """Rows [first, stop) of a run, which is best an `Analysis`, since that keeps its signals.

    Attributes:
        description: what the run says of itself.
        time: plant time of the rows (n,) [s].
        has_truth: whether a simulation filled the truth signals of the run.
    """

    def __init__(self, recording: Recorded, first: int, stop: int) -> None:
        self._recording, self._rows = recording, slice(first, stop)
        self.description: RunDescription = recording.description
        self.time: Floats = recording.time[self._rows]
        self.has_truth: bool = recording.has_truth

    @property
    def path(self) -> Path:
        """The run folder."""
        return self._recording.path

    def __getitem__(self, name: str) -> NDArray[Any]:
        """Rows of the signal `name`; raises as the recording does."""
        return self._recording[name][self._rows]


def spans(count: int, rows: int = WINDOW_ROWS) -> Iterator[tuple[int, int]]:
    """Consecutive ranges [first, stop) that cover `count` rows, at least one and maybe empty."""
    for first in range(0, max(count, 1), rows):
        yield first, min(first + rows, count)
