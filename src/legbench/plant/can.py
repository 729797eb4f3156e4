"""The leg on the bench, or an emulated one: two servo drives on a CAN bus."""

import math
from typing import final

import numpy as np

from legbench.drives.link import Link, LinkState, Sample
from legbench.drives.session import Session
from legbench.plant.abstract import AbstractPlant
from legbench.plant.start import Start
from legbench.signals import Command, Floats, Observation

VELOCITY_BANDWIDTH = 200.0
"""Corner frequency of the velocity estimate [Hz]."""
STILL_SPEED = 0.05
"""A leg at rest moves slower than this [rad/s]."""
STILL_CYCLES = 100
"""So long it must rest before a run begins."""
STILL_PATIENCE = 5000
"""After so many cycles a run begins anyway; a leg that swings for long is no fault."""


@final
class CanPlant(AbstractPlant):
    """Drives in cyclic synchronous position mode, one exchange of frames a period.

    The link waits for its own grid: run it with a clock that does not (`VirtualClock`, or one
    that reports `late`). Link and motor angles are the encoders', spring torque is stiffness times
    their difference. `joint_vel` is the encoders' difference over one period behind a first-order
    low-pass of 200 Hz, 0.8 ms late. `applied_pos` is what the limits let through; in read-only,
    where nothing is commanded, it is where the motors are. There is no truth. A command is seen
    two observations later: one cycle more than in `SimPlant`.

    Attributes:
        link: the cyclic link.
        sample: what it showed last.
        late: of the last SYNC after its place on the grid [s].
        began: SYNC of observation 0, on the link's time base [s].
    """

    def __init__(
        self,
        session: Session,
        link: Link,
        start: Start,
        *,
        read_only: bool = False,
        speed: float | None = None,
    ) -> None:
        """Wire the parts; nothing is sent.

        Args:
            session: closed with the plant.
            link: of that session.
            start: posture of the motors at which a run begins.
            read_only: never enable; commands are recorded and go nowhere.
            speed: of the way to the start posture, `start_speed` of the bus file by default
                [rad/s].
        """
        self.period = session.config.period
        self.link, self.late, self.began = link, 0.0, 0.0
        self.sample: Sample | None = None
        self._session, self._start = session, start
        self._read_only, self._speed = read_only, speed
        self._gain = 1.0 - math.exp(-2.0 * math.pi * VELOCITY_BANDWIDTH * self.period)
        self._links: Floats = np.zeros(2)
        self._velocity: Floats = np.zeros(2)
        self._cycle = 0

    def reset(self) -> Observation:
        """Start the drives where they stand, go slowly to the start posture, wait for rest.

        Drives that run already go to the start posture again.

        Raises:
            BusError, DriveError: as `Link.start`; nothing is enabled then.
            PlantFault: a limit or a watchdog; all drives have been stopped.
        """
        running = self.link.state in (LinkState.CYCLIC, LinkState.RUNNING)
        sample = self.link.exchange() if running else self.link.start()
        if not self._read_only:
            sample = self.link.move_to(self._start.motor_pos.tolist(), self._speed)
        self._links = np.array(sample.link_pos)
        self._velocity = np.zeros(2)
        still = 0
        for _ in range(STILL_PATIENCE):
            seen = self._observe(self._exchange(self._start.motor_pos))
            still = still + 1 if np.max(np.abs(seen.joint_vel)) < STILL_SPEED else 0
            if still >= STILL_CYCLES:
                break
        sample = self._exchange(self._start.motor_pos)
        self.link.shortfall.restart()
        self._cycle, self.began = 0, 1e-9 * sample.time_ns
        return self._observe(sample)

    def step(self, command: Command) -> Observation:
        """Send a command, then wait for the next tick and look.

        Raises:
            PlantFault: a limit or a watchdog; all drives have been stopped in that cycle.
        """
        sample = self._exchange(command.motor_pos)
        self._cycle += 1 + sample.skipped
        return self._observe(sample)

    def close(self) -> None:
        """Quick stop of both drives, pre-operational, bus closed; twice is once, never raises."""
        self._session.close()

    def _exchange(self, motor_pos: Floats) -> Sample:
        if not self._read_only:
            self.link.command(motor_pos.tolist())
        self.sample = self.link.exchange()
        self.late = 1e-9 * self.sample.late_ns
        return self.sample

    def _observe(self, sample: Sample) -> Observation:
        links, motors = np.array(sample.link_pos), np.array(sample.motor_pos)
        rate = (links - self._links) / (self.period * (1 + sample.skipped))
        self._velocity = self._velocity + self._gain * (rate - self._velocity)
        self._links = links
        return Observation(
            time=self._cycle * self.period,
            motor_pos=motors,
            joint_pos=links,
            joint_vel=self._velocity,
            spring_torque=np.array(sample.spring_torque),
            applied_pos=np.array(sample.applied_pos) if sample.applied_pos else motors,
        )
