"""How punctual the cycle is: wake-up latency and exchange time, nothing enabled."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from legbench.drives.errors import DriveError
from legbench.drives.limits import SafetyLimits
from legbench.drives.session import Session
from legbench.signals import Floats

QUANTILES = {"p50": 0.5, "p90": 0.9, "p99": 0.99, "p99_9": 0.999, "max": 1.0}


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Timing:
    """One value a cycle."""

    late_us: Floats
    """SYNC after its place on the grid."""
    exchange_us: Floats
    """From SYNC to the last process data."""
    skipped: int
    """Ticks missed."""
    lost: int
    """Cycles in which process data was missing."""

    def table(self) -> dict[str, dict[str, float]]:
        """Quantiles by name [us]."""
        return {
            name: {word: float(np.quantile(values, at)) for word, at in QUANTILES.items()}
            for name, values in (("late_us", self.late_us), ("exchange_us", self.exchange_us))
        }


def measure(session: Session, stiffness: Sequence[float], cycles: int) -> Timing:
    """Exchange frames in read-only for a number of cycles.

    Raises:
        PlantFault: another master leads these drives, whose punctuality is not ours.
        BusError, DriveError, PlantFault: as `Link.start`, `Link.exchange`.
    """
    timebase = session.timebase
    late, exchange = np.zeros(cycles), np.zeros(cycles)
    lost = 0
    session.bring_up().listen()
    with session.link(SafetyLimits(), stiffness, read_only=True) as link:
        link.start()
        if link.listening:
            raise DriveError(
                "another master sends SYNC on this bus; its cycle cannot be measured from here: "
                "end it, or run jitter on its computer"
            )
        before = link.skipped_total
        for cycle in range(cycles):
            sample = link.exchange()
            late[cycle] = 1e-3 * sample.late_ns
            exchange[cycle] = 1e-3 * (timebase.now_ns() - sample.time_ns)
            lost += not all(sample.fresh)
        skipped = link.skipped_total - before
    return Timing(late_us=late, exchange_us=exchange, skipped=skipped, lost=lost)
