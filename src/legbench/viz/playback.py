"""What of a run is played, how fast, and how often: one meaning for viewer, window and video."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from legbench.errors import ConfigError
from legbench.recording.archive_columns import rows_of
from legbench.recording.reader import Recording
from legbench.signals import Floats, Ints

SLOWEST, FASTEST = 1e-3, 1e3
"""Speeds that make sense [plant time / wall time]: a video of 1 s lasts 17 minutes, or none."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Playback:
    """Part of a run that is played, at what speed, and whether it begins again at its end.

    Raises:
        ConfigError: a speed that makes no sense, or an end that is not later than the begin.
    """

    begin: float | None = None
    """Plant time at which it begins [s]; none: with the first row."""
    end: float | None = None
    """Plant time at which it ends [s]; none: with the last row."""
    speed: float = 1.0
    """Plant time over wall time [-]; 0.25 is four times slower than the leg was."""
    loop: bool = False
    """Whether it begins again at its end."""

    def __post_init__(self) -> None:
        if not SLOWEST <= self.speed <= FASTEST:
            raise ConfigError(
                f"speed is {self.speed:g}; it must be {SLOWEST:g} to {FASTEST:g} (0.25 is four "
                "times slower)"
            )
        for name, value in (("from", self.begin), ("to", self.end)):
            if value is not None and not math.isfinite(value):
                raise ConfigError(f"{name} is {value:g} s; it must be a time of the run")
        if self.begin is not None and self.end is not None and not self.begin < self.end:
            raise ConfigError(
                f"from is {self.begin:g} s, to is {self.end:g} s; a run is played forwards"
            )

    @property
    def whole(self) -> bool:
        """Whether all rows are played."""
        return self.begin is None and self.end is None

    def span(self, time: Floats) -> tuple[float, float]:
        """Plant time of the first and of the last row that is played [s].

        Args:
            time: times of the rows of the run (n,), at least one [s].

        Raises:
            ConfigError: the run is over before, or begins after.
        """
        first, last = float(time[0]), float(time[-1])
        begin = first if self.begin is None else max(self.begin, first)
        end = last if self.end is None else min(self.end, last)
        if begin > end:
            raise ConfigError(
                f"nothing lies from {self.begin if self.begin is not None else first:g} to "
                f"{self.end if self.end is not None else last:g} s; the run lasts from {first:g} "
                f"to {last:g} s"
            )
        return begin, end

    def rows(self, time: Floats) -> slice:
        """Rows that are played; raises as `span`."""
        begin, end = self.span(time)
        first = int(np.searchsorted(time, begin))
        return slice(first, max(first + 1, int(np.searchsorted(time, end, side="right"))))

    def frames(self, time: Floats, fps: float) -> Ints:
        """Row (n,) of each frame when frames come at a rate [1/s]; raises as `span`."""
        begin, end = self.span(time)
        step = self.speed / fps
        instants = np.arange(begin, end + 0.5 * step, step)
        # Rows are told to the nanosecond; sums of steps miss them by less.
        return np.minimum(np.searchsorted(time, instants - 0.5e-9), len(time) - 1)

    def parts(self, recordings: Sequence[Recording]) -> list[Recording]:
        """Runs cut to the rows that are played; one that has none of them is left out."""
        if self.whole:
            return list(recordings)
        begin, end = self.begin, self.end
        alive = [
            run
            for run in recordings
            if len(run.time)
            and (begin is None or begin <= run.time[-1])
            and (end is None or end >= run.time[0])
        ]
        return [cut(run, self.rows(run.time)) for run in alive]


WHOLE: Final = Playback()
"""All of a run, as fast as the leg was, once."""


def cut(recording: Recording, rows: slice) -> Recording:
    """Some consecutive rows of a run as a recording of them alone; those of a long run stay in
    its file.
    """
    columns = rows_of(recording.columns, rows)
    return replace(recording, time=recording.time[rows], columns=columns)
