"""The cyclic link to the drives of one leg, over any python-can bus.

    with Link(bus, config, limits, stiffness=(k1, k2)) as link:
        sample = link.start()
        while ...:
            applied = link.command(controller(sample))
            sample = link.exchange()

A cycle: tick of the grid, SYNC, process data of all drives until a deadline, watchdogs and limits
(`exchange`), then the command, slewed and clamped, in RPDOs that act at the next SYNC (`command`).
Whatever goes wrong, all drives are told to stop in the same cycle and the first cause is kept.
"""

import math
from collections.abc import Sequence
from typing import final

import can

from legbench.drives.errors import DriveError
from legbench.drives.master.link_state import LinkState
from legbench.drives.master.move import missed, move
from legbench.drives.master.opening import Opening
from legbench.drives.master.port import Listener, Port
from legbench.drives.master.sample import Sample, sample_of
from legbench.drives.master.tick import Tick
from legbench.drives.protocol.cia402 import Goal
from legbench.drives.setup.config import BusConfig, check_start_speed
from legbench.drives.setup.exchange import check_budget
from legbench.drives.transport.lock import ChannelLock
from legbench.drives.transport.open_bus import timebase_of
from legbench.drives.transport.timebase import Timebase
from legbench.errors import PlantFault
from legbench.limits.guard import Guard
from legbench.limits.safety import SafetyLimits
from legbench.limits.shortfall import Shortfall


@final
class Link(Opening):
    """Cyclic link of one master to its drives over a bus.

    Attributes:
        state: state of the link.
        fault: first fault, which ended the link.
        stopped: report of the stop of the drives, none before it.
        skipped_total: ticks without SYNC since the start.
        not_parked: command frames that `close` failed to switch off, see `master.parking`.
        listening: read-only, and another master sends SYNC: this one sends nothing.
    """

    def __init__(
        self,
        bus: can.BusABC,
        config: BusConfig,
        limits: SafetyLimits | None = None,
        *,
        stiffness: Sequence[float],
        timebase: Timebase | None = None,
        listener: Listener | None = None,
        read_only: bool = False,
        lock: ChannelLock | None = None,
    ) -> None:
        """Wire the parts; nothing is sent.

        Args:
            bus: stays the caller's, who shuts it down after `close`.
            config: drives on the bus.
            limits: limits that this link enforces.
            stiffness: stiffness of the series springs, one a drive [N m/rad].
            timebase: time base of the link; by default the bus's.
            listener: sees every frame, such as a `BusLog`.
            read_only: observe; change nothing in a drive, see `master.read_only`.
            lock: lock that `open` takes; by default one for the bus's channel.

        Raises:
            ConfigError: the bus cannot carry the schedule.
        """
        check_budget(config)
        port = Port(bus, timebase or timebase_of(bus), listener)
        lock = lock or ChannelLock(str(bus.channel_info))
        super().__init__(port, config, limits or SafetyLimits(), lock, read_only=read_only)
        self._stiffness = tuple(float(value) for value in stiffness)
        self._two_encoders = config.two_encoders
        self._guard = Guard(
            self._limits,
            config.period,
            known=[node.knows for node in config.nodes],
            two_encoders=self._two_encoders,
        )
        self.skipped_total = 0
        self._last = Tick(0, 0, 0, 0, False)
        self._expected: list[tuple[float, ...]] = []

    def start(self, *, clear_faults: bool = False) -> Sample:
        """Open if need be, let process data settle, enable all drives where they stand.

        In read-only it settles only. With `clear_faults` a drive in fault is reset, once. A leg
        that is found beyond its joint range or spring torque is not enabled.

        Raises:
            BusError, DriveError: as `open`; or a drive is in fault, or does not become enabled.
            PlantFault: something went wrong after process data had begun.
        """
        self.open()
        if self.state is not LinkState.CONFIGURED:
            raise DriveError(
                f"a link that is {self.state.name.lower()} cannot start; make a new one"
            )
        if not self._read_only and self.cycle.led_by_another():
            self._supervisor.alone()  # A master that has come since `open` keeps the drives.
        self.state = LinkState.CYCLIC
        try:
            self._start_up.settle(self._settling_tick)
            if not self._read_only:
                self._enable(clear_faults=clear_faults)
        except PlantFault as error:
            self._end(error)
            raise
        except BaseException:
            self.stop()
            raise
        return self._sample()

    def _enable(self, *, clear_faults: bool) -> None:
        up = self._start_up
        self._leads = True
        if clear_faults:
            words = "leave its fault, whose cause still stands"
            up.seek(Goal.FAULT_RESET, up.faulted(), self._watched_tick, words)
        for axis in up.faulted():
            text = self.bring_up.error_text(axis.node)
            raise DriveError(
                f"drive '{axis.node.name}' (node {axis.node.node_id}) is in fault: {text}; remove "
                "the cause, then start with a fault reset"
            )
        sample = self._sample()
        self._check(sample)
        self._guard.check_start(self.led_pos)
        up.seek(Goal.ENABLED, self.cycle.axes, self._watched_tick, "become enabled")
        # The guard begins from the targets that the drives hold, not from their encoders.
        held = tuple(axis.target_pos for axis in self.cycle.axes)
        self._guard.start_at(held)
        self._expected = [held] * 2
        self.state = LinkState.RUNNING

    # --- the cycle ---------------------------------------------------------------------------

    def exchange(self) -> Sample:
        """Wait for the next tick and look at the drives.

        Raises:
            PlantFault: a watchdog or a limit; all drives have been stopped by then.
        """
        self._refuse_ended()
        try:
            if self.state is LinkState.CYCLIC:
                self._watched_tick()
                self._start_up.idle()
                return self._sample()
            self._watched_tick()
            self._supervisor.states()
            self.cycle.notices.statuswords(self.cycle.axes, self._last.time_ns)
            sample = self._sample()
            self._check(sample)
        except PlantFault as error:
            self._end(error)
            raise
        except BaseException:
            self.stop()
            raise
        return sample

    def look(self) -> Sample:
        """Wait for the next tick and show what came, however late and incomplete it is.

        In read-only, for those who measure: nothing has power, and no limit ends it.

        Raises:
            PlantFault: another master leads the drives.
            DriveError: the link is not read-only, or not started.
        """
        self._refuse_ended()
        if not self._read_only:
            raise DriveError("this link may lead drives; limits have to watch it: use exchange")
        try:
            self._settling_tick()
            self._start_up.idle()
        except PlantFault as error:
            self._end(error)
            raise
        except BaseException:
            self.stop()
            raise
        return self._sample()

    def command(self, motor_pos: Sequence[float]) -> tuple[float, ...]:
        """Send a command for the coming period; what of it was applied [rad].

        Raises:
            PlantFault: it is not finite or jumps too far; all drives have been stopped by then.
            DriveError: the drives are not enabled.
        """
        self._refuse_ended()
        if self.state is not LinkState.RUNNING:
            raise DriveError(
                "this link is read-only" if self._read_only else "the drives are not enabled"
            )
        try:
            applied = self._guard.command(motor_pos)
            words = []
            for axis, target in zip(self.cycle.axes, applied, strict=True):
                axis.aim(target)
                words.append(axis.machine.controlword)
            self._expected = [self._expected[-1], applied]
            self._supervisor.sent(complete=self.cycle.send(words))
        except PlantFault as error:
            self._end(error)
            raise
        except BaseException:
            self.stop()
            raise
        return applied

    def forget_wish(self) -> tuple[float, ...]:
        """Measure the next step of the command from what was applied last; returns that [rad]."""
        self._guard.forget_wish()
        return self._guard.applied

    @property
    def shortfall(self) -> Shortfall:
        """Counts of the commands that the limits changed before they were applied."""
        return self._guard.shortfall

    def move_to(self, motor_pos: Sequence[float], speed: float | None = None) -> Sample:
        """Go to a posture at a speed [rad/s], `start_speed` of the bus file by default.

        Raises:
            ConfigError: the speed is not above 0 or too fast; nothing has moved.
            PlantFault: as `exchange` and `command`; or it ends short of the posture.
        """
        pace = self._config.start_speed if speed is None else speed
        check_start_speed(pace)
        wanted = tuple(float(value) for value in motor_pos)
        if not all(map(math.isfinite, wanted)):
            self.command(wanted)  # refused there, and the drives stopped
        sample = move(self, self._guard, wanted, pace * self._config.period)
        error = missed(self._guard, wanted)
        if error is not None:
            self._end(error)
            raise error
        return sample

    def _tick(self) -> Tick:
        self._last = tick = self.cycle.follow() if self.listening else self.cycle.tick()
        self.skipped_total += tick.skipped
        return tick

    def _settling_tick(self) -> Tick:
        tick = self._tick()
        self._supervisor.alone()
        return tick

    def _watched_tick(self) -> Tick:
        tick = self._tick()
        self._supervisor.bus(tick)
        self._supervisor.drives()
        return tick

    def _sample(self) -> Sample:
        return sample_of(
            self.cycle,
            self._last,
            self._stiffness,
            self._guard.applied,
            two_encoders=self._two_encoders,
        )

    def _check(self, sample: Sample) -> None:
        self._guard.check(
            motor_pos=sample.motor_pos,
            joint_pos=sample.link_pos,
            spring_torque=sample.spring_torque,
            expected_pos=self._expected[0] if self._expected else None,
            temperature=sample.temperature,
            fresh=sample.fresh,
            elapsed=1 + sample.skipped,
            led_pos=None if self._two_encoders else self.led_pos,
        )

    @property
    def led_pos(self) -> tuple[float, ...]:
        """Positions of the encoders that the drives' loops are closed over [rad]."""
        return tuple(axis.motor_pos for axis in self.cycle.axes)

    def _refuse_ended(self) -> None:
        if self.fault is not None:
            raise self.fault
        if self.state not in (LinkState.CYCLIC, LinkState.RUNNING):
            raise DriveError(f"the link is {self.state.name.lower()}; start it first")
