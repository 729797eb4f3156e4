"""The leg on the bench, or an emulated one: two servo drives on a CAN bus."""

from collections.abc import Callable, Sequence
from typing import final

import numpy as np

from legbench.drives.master.link import Link, LinkState, Sample
from legbench.drives.master.session import Session
from legbench.plant.abstract import AbstractPlant
from legbench.plant.can_needs import known_of
from legbench.plant.gone_drive import gone_drive
from legbench.plant.landing import PATIENCE, Landing, land
from legbench.plant.start import Start
from legbench.plant.velocity import VelocityEstimate
from legbench.signals import Command, Floats, Observation

VELOCITY_BANDWIDTH = 200.0
"""Corner frequency of the velocity estimate [Hz]."""
STILL_SPEED = 0.05
"""Speed below which a leg counts as at rest [rad/s]."""
STILL_TIME_MS = 100
"""Time for which the leg must rest before a run begins [ms]."""
STILL_PATIENCE_MS = 5000
"""Time after which a run begins anyway [ms]; a leg that swings for long is no fault."""


@final
class CanPlant(AbstractPlant):
    """Drives in cyclic synchronous position mode, one exchange of frames a period.

    The link waits for its own grid: run it with a clock that does not (`VirtualClock`, or one
    that reports `late`). Link and motor angles are the encoders', spring torque is stiffness times
    their difference. `time` is that of the SYNC that the observation answers, since the one of
    observation 0: a late SYNC has a late time, and a tick without SYNC leaves a gap. `joint_vel` is
    the encoders' difference over the time between two SYNCs behind a first-order low-pass of
    200 Hz, 0.8 ms late; a drive whose answer is missing keeps its velocity. `applied_pos` is what
    the limits let through; in read-only, where nothing is commanded, it is where the motors are.
    There is no truth. What a drive with one encoder does not tell is not a number, see
    `drives.setup.encoders`. A command is seen two observations later: one cycle more than in
    `SimPlant`.

    Attributes:
        link: the cyclic link.
        sample: what it showed last.
        late: of the last SYNC after its place on the grid [s].
        began: SYNC of observation 0, on the link's time base [s].
        landing: how `rest` went.
    """

    def __init__(
        self,
        session: Session,
        link: Link,
        start: Start,
        *,
        read_only: bool = False,
        speed: float | None = None,
        lands: bool = True,
    ) -> None:
        """Wire the parts; nothing is sent.

        Args:
            session: closed with the plant.
            link: of that session.
            start: posture of the motors at which a run begins.
            read_only: never enable; commands are recorded and go nowhere.
            speed: of the way to the start posture and to rest, `start_speed` of the bus file by
                default [rad/s].
            lands: whether `rest` leads the leg to rest, instead of leaving it to `close`.
        """
        self.period = session.config.period
        self.link, self.late, self.began = link, 0.0, 0.0
        self.sample: Sample | None = None
        self._session, self._start = session, start
        self.landing: Landing | None = None
        self._lands = lands and not read_only
        self._read_only, self._speed = read_only, speed
        self._velocity = VelocityEstimate(VELOCITY_BANDWIDTH, self.period)
        self._period_ns = session.config.period_ns
        self._began_ns = 0

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
        self._velocity.reset(sample.time_ns, sample.link_pos)
        still, cycles_in = 0, self._session.config.cycles_in
        for _ in range(cycles_in(STILL_PATIENCE_MS)):
            seen = self._observe(self._exchange(self._start.motor_pos))
            still = still + 1 if np.max(np.abs(seen.joint_vel)) < STILL_SPEED else 0
            if still >= cycles_in(STILL_TIME_MS):
                break
        sample = self._exchange(self._start.motor_pos)
        self.link.shortfall.restart()
        self._began_ns, self.began = sample.time_ns, 1e-9 * sample.time_ns
        return self._observe(sample)

    def step(self, command: Command) -> Observation:
        """Send a command, then wait for the next tick and look.

        Raises:
            PlantFault: a limit or a watchdog; all drives have been stopped in that cycle.
        """
        return self._observe(self._exchange(command.motor_pos))

    def rest(self, motor_pos: Floats, interrupted: Callable[[], bool]) -> str | None:
        """Lead the motors to a posture as slowly as to the start, wait until the leg rests.

        Limits and watchdogs act as in `step`. In read-only nothing is commanded.

        Raises:
            PlantFault: a limit or a watchdog; all drives have been stopped in that cycle.
        """
        if not self._lands or self.link.state is not LinkState.RUNNING:
            return None
        if gone_drive(self.link) is not None:
            return None  # A leg of which one drive is gone is led nowhere.
        self.landing = landing = land(
            self._lead,
            motor_pos.tolist(),
            self.link.restart_from_applied(),
            speed=self._speed or self._session.config.start_speed,
            period=self.period,
            interrupted=interrupted,
        )
        if landing.trouble is not None and "joint_pos" not in known_of(self._session.config):
            return (
                "whether the leg rests is not known, as a link has no encoder; its power went "
                f"{PATIENCE:g} s after it had been led to its rest posture"
            )
        return landing.trouble

    def _lead(self, motor_pos: Sequence[float]) -> tuple[Sequence[float], Sequence[float]]:
        sample = self._exchange(np.array(motor_pos))
        return sample.applied_pos, sample.link_pos

    def close(self) -> None:
        """Quick stop of both drives, pre-operational, bus closed; twice is once, never raises."""
        self._session.close()

    @property
    def session(self) -> Session:
        """Session of the bus, which is closed with the plant."""
        return self._session

    def _exchange(self, motor_pos: Floats) -> Sample:
        if not self._read_only:
            self.link.command(motor_pos.tolist())
        self.sample = self.link.exchange()
        self.late = 1e-9 * self.sample.late_ns
        return self.sample

    def _observe(self, sample: Sample) -> Observation:
        motors = np.array(sample.motor_pos)
        return Observation(
            time=self._since_start(sample.time_ns),
            motor_pos=motors,
            joint_pos=np.array(sample.link_pos),
            joint_vel=self._velocity.update(sample.time_ns, sample.link_pos, sample.fresh),
            spring_torque=np.array(sample.spring_torque),
            applied_pos=np.array(sample.applied_pos) if sample.applied_pos else motors,
        )

    def _since_start(self, time_ns: int) -> float:
        """Time since observation 0 [s]; on the grid the same number as in a simulation."""
        cycles, beside_ns = divmod(time_ns - self._began_ns, self._period_ns)
        return cycles * self.period + 1e-9 * beside_ns
