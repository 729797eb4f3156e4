"""Measurement of the cycle's timing, wake-up latency and exchange time; nothing is enabled."""

import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass

import numpy as np

from legbench.drives.errors import DriveError
from legbench.drives.master.bus_log import LOG_FAILED, BusLog
from legbench.drives.master.link import Link, Sample
from legbench.drives.master.session import Session
from legbench.limits.safety import SafetyLimits
from legbench.plants import BUS_LOG
from legbench.recording.writer import RunWriter
from legbench.signals import Command, Floats, Observation

QUANTILES = {"p50": 0.5, "p90": 0.9, "p99": 0.99, "p99_9": 0.999, "max": 1.0}
LATE_SHARE = 0.1
"""Share of a period after which a SYNC counts as late [-]: drives that interpolate between set
points begin to show it."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Timing:
    """Result of a measurement; arrays have one value for each cycle."""

    late_us: Floats
    """Lateness of SYNC after its place on the grid."""
    exchange_us: Floats
    """Time from SYNC to the last process data."""
    skipped: int
    """Ticks that this computer missed."""
    silent: int
    """Ticks left out on purpose, after an answer that had not come."""
    late: int
    """Cycles whose SYNC was later than a tenth of a period."""
    lost: int
    """Cycles in which process data was missing."""

    def table(self) -> dict[str, dict[str, float]]:
        """Quantiles by name [us]."""
        return {
            name: {word: float(np.quantile(values, at)) for word, at in QUANTILES.items()}
            for name, values in (("late_us", self.late_us), ("exchange_us", self.exchange_us))
        }

    def counts(self) -> dict[str, int]:
        """Counts of skipped, silent, late and lost ticks, by name."""
        return {
            "skipped": self.skipped,
            "late": self.late,
            "silent": self.silent,
            "lost": self.lost,
        }


def measure(
    session: Session, stiffness: Sequence[float], cycles: int, writer: RunWriter | None = None
) -> Timing:
    """Exchange frames in read-only for a number of cycles, and record every one of them.

    A slow machine or a disturbed bus does not end it: skipped, late and lost ticks are counted.

    Args:
        session: of the bus.
        stiffness: of the series springs [N m/rad].
        cycles: how many.
        writer: takes a row a cycle and every frame, as in a run; none measures without recording.

    Raises:
        PlantFault: another master leads the drives, so that the timing would be that master's.
        BusError, DriveError: as `Link.start`.
        RecordingError: the recording failed.
    """
    session.bring_up().listen()
    with (
        _bus_log(session, writer) as log,
        session.link(SafetyLimits(), stiffness, read_only=True) as link,
    ):
        if log is not None:
            link.show_frames_to(log)
        began_ns = link.start().time_ns
        if link.listening:
            raise DriveError(
                "another master sends SYNC on this bus; its cycle cannot be measured from here: "
                "end it, or run jitter on its computer"
            )
        return measure_link(session, link, cycles, writer, began_ns)


@contextmanager
def _bus_log(session: Session, writer: RunWriter | None) -> Iterator[BusLog | None]:
    """Log of the frames of a measurement, as a run has one; one that failed is an event."""
    if writer is None:
        yield None
        return
    with BusLog(writer.log(BUS_LOG), session.channel) as log:
        yield log
    if log.error is not None:
        writer.event(0.0, LOG_FAILED, error=log.error)


def measure_link(
    session: Session, link: Link, cycles: int, writer: RunWriter | None, began_ns: int
) -> Timing:
    """Measure on a read-only link that has started; rows tell the time since `began_ns` [ns].

    Raises:
        PlantFault, RecordingError: as `measure`.
    """
    timebase, period_us = session.timebase, session.config.period_us
    late, exchange = np.zeros(cycles), np.zeros(cycles)
    lost = 0
    skipped, silent = link.skipped_total, link.cycle.silent_total
    previous = time.perf_counter()
    for cycle in range(cycles):
        sample = link.look()
        late[cycle] = 1e-3 * sample.late_ns
        exchange[cycle] = 1e-3 * (timebase.now_ns() - sample.time_ns)
        lost += not all(sample.fresh)
        now = time.perf_counter()
        if writer is not None:
            seen = _observation(sample, began_ns)
            command = Command.holding(seen.motor_pos)
            writer.append(command, seen, 1e6 * (now - previous), late[cycle])
        previous = now
    silent = link.cycle.silent_total - silent
    return Timing(
        late_us=late,
        exchange_us=exchange,
        skipped=link.skipped_total - skipped - silent,
        silent=silent,
        late=int(np.sum(late > LATE_SHARE * period_us)),
        lost=lost,
    )


def _observation(sample: Sample, began_ns: int) -> Observation:
    motors = np.array(sample.motor_pos)
    return Observation(
        time=1e-9 * (sample.time_ns - began_ns),
        motor_pos=motors,
        joint_pos=np.array(sample.link_pos),
        joint_vel=np.zeros(len(motors)),
        spring_torque=np.array(sample.spring_torque),
        applied_pos=motors,
    )
