"""The start of a cycle, as the master found it."""

from typing import NamedTuple


class Tick(NamedTuple):
    """Start of a cycle: its time, its delay and the ticks without SYNC before it."""

    time_ns: int
    """Time of SYNC on the bus's time base [ns]."""
    late_ns: int
    """Delay of SYNC after its place on the grid [ns]."""
    skipped: int
    """Number of ticks without SYNC before this one, for whatever reason."""
    silent: int
    """Number of skipped ticks that this master left out on purpose, or that were another's."""
    complete: bool
    """Whether all process data came before the deadline."""
