"""The cyclic link to the drives of one leg, over any python-can bus.

    with Link(bus, config, limits, stiffness=(k1, k2)) as link:
        sample = link.start()
        while ...:
            applied = link.command(controller(sample))
            sample = link.exchange()

A cycle: tick of the grid, SYNC, process data of all drives until a deadline, watchdogs and limits
(`exchange`), then the command, slewed and clamped, in RPDOs that act at the next SYNC (`command`);
what needs none of its answers is done until they come. Whatever goes wrong, all drives are told to
stop.
"""

import math
from collections.abc import Sequence
from typing import final

import can

from legbench.drives.errors import DriveError
from legbench.drives.master.enabling import enable
from legbench.drives.master.limited_motion import LimitedMotion, guard_of
from legbench.drives.master.link_end import LinkEnd, StopOnError
from legbench.drives.master.link_opening import LinkOpening
from legbench.drives.master.link_parts import LinkParts
from legbench.drives.master.link_state import LinkState
from legbench.drives.master.move import missed, move
from legbench.drives.master.port import Listener, Port
from legbench.drives.master.sample import Sample
from legbench.drives.master.stop_report import DriveLeader, StopReport
from legbench.drives.master.ticks import Ticks
from legbench.drives.setup.bus_numbers import check_start_speed
from legbench.drives.setup.config import BusConfig
from legbench.drives.setup.exchange import check_budget
from legbench.drives.transport.lock import ChannelLock
from legbench.drives.transport.open_bus import timebase_of
from legbench.drives.transport.timebase import Timebase
from legbench.errors import PlantFault
from legbench.limits.momentum import LegMomentum
from legbench.limits.safety import SafetyLimits
from legbench.limits.shortfall import Shortfall

RUNNING, CYCLIC = EXCHANGING = (LinkState.RUNNING, LinkState.CYCLIC)
"""States in which process data is exchanged."""


@final
class Link(DriveLeader):
    """Cyclic link of one master to its drives over a bus.

    Attributes:
        cycle: exchange of process data with the drives.
        bring_up: SDO access to the drives.
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
        momentum: LegMomentum | None = None,
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
            momentum: what the leg's angular momentum obeys, for the limit `link_error`.

        Raises:
            ConfigError: the bus cannot carry the schedule.
        """
        check_budget(config)
        self._port = Port(bus, timebase or timebase_of(bus), listener)
        parts = LinkParts.wired(
            self._port,
            config,
            limits or SafetyLimits(),
            lock or ChannelLock(str(bus.channel_info)),
            read_only=read_only,
        )
        self._parts, self._config, self._status = parts, config, parts.status
        self.cycle, self.bring_up = parts.cycle, parts.bring_up
        self._supervisor, self._start_up = parts.supervisor, parts.start_up
        self._opening, self._ending = LinkOpening(parts), LinkEnd(parts)
        self._stop_on_error = StopOnError(self._ending)
        self._guard = guard_of(config, parts.limits, momentum)
        self._motion = LimitedMotion(
            parts.cycle, self._guard, stiffness, two_encoders=config.two_encoders
        )
        self._ticks = Ticks(parts, self._motion.meanwhile)

    # --- what has become of it ---------------------------------------------------------------

    @property
    def state(self) -> LinkState:
        """State of the link."""
        return self._status.state

    @property
    def fault(self) -> PlantFault | None:
        """First fault, which ended the link; none so far."""
        return self._status.fault

    @property
    def stopped(self) -> StopReport | None:
        """Report of the stop of the drives, none before it."""
        return self._status.stopped

    @property
    def not_parked(self) -> list[str]:
        """Command frames that `close` failed to switch off, see `master.parking`."""
        return self._status.not_parked

    @property
    def listening(self) -> bool:
        """Whether this link is read-only and another master sends SYNC: this one sends nothing."""
        return self._status.listening

    @property
    def unprotected(self) -> tuple[str, ...]:
        """What the drives lack or hold otherwise, a line each, once it is open."""
        return self._status.unprotected

    @property
    def led_pos(self) -> tuple[float, ...]:
        """Positions of the encoders that the drives' loops are closed over [rad]."""
        return self._motion.led_pos

    @property
    def skipped_total(self) -> int:
        """Number of ticks without SYNC since the start."""
        return self._ticks.skipped_total

    @property
    def listener_error(self) -> str | None:
        """Error that a listener raised, in one line; the listener is not called again."""
        return self._port.listener_error

    @property
    def shortfall(self) -> Shortfall:
        """Counts of the commands that the limits changed before they were applied."""
        return self._guard.shortfall

    # --- begin and end -----------------------------------------------------------------------

    def show_frames_to(self, listener: Listener) -> None:
        """Show every frame to a listener from now on, or from when the drives are configured."""
        self._opening.show_frames_to(listener)

    def open(self) -> None:
        """Take the channel, check and configure the drives; raises as `LinkOpening.run`."""
        self._opening.run()

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
            name = self.state.name.lower()
            raise DriveError(f"a link that is {name} cannot start; make a new one")
        parts, ticks = self._parts, self._ticks
        if not parts.read_only and self.cycle.led_by_another():
            self._supervisor.check_no_other_master()  # It came after `open`, and keeps the drives.
        self._status.state = CYCLIC
        with self._stop_on_error:
            self._start_up.settle(ticks.settling)
            if not parts.read_only:
                enable(parts, ticks, self._motion, self._guard, clear_faults=clear_faults)
        return self._motion.sample(ticks.last)

    def stop(self) -> None:
        """Quick stop of all drives in this cycle, then no power, then a look whether it is gone.

        Raises no error; `stopped` tells how it has ended. No signal gets in between: a ^C that
        comes meanwhile is raised at the end. While the stop is not verified, calling it again
        repeats it. Drives that another master took before this one led them are left to it.
        """
        self._ending.stop()

    def close(self) -> None:
        """Stop, leave the drives parked in pre-operational, release the channel; raises no error.

        A second call does nothing. A stop that is not verified is repeated, in the end over SDO. A
        link that only looks leaves the drives of another master alone.
        """
        self._ending.close()

    # --- the cycle ---------------------------------------------------------------------------

    def exchange(self) -> Sample:
        """Wait for the next tick and look at the drives.

        Raises:
            PlantFault: a watchdog or a limit; all drives have been stopped by then.
        """
        status, motion = self._status, self._motion
        self._refuse_ended()
        try:
            tick = self._ticks.watched()
            if status.state is CYCLIC:
                self._start_up.idle()
                return motion.sample(tick)
            self._supervisor.states(tick.time_ns)
            sample = motion.sample(tick)
            motion.check(sample)
        except BaseException as error:  # Whatever is raised, the drives stop.
            self._ending.stop_after(error)
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
        if not self._parts.read_only:
            raise DriveError("this link may lead drives; limits have to watch it: use exchange")
        with self._stop_on_error:
            tick = self._ticks.settling()
            self._start_up.idle()
        return self._motion.sample(tick)

    def command(self, motor_pos: Sequence[float]) -> tuple[float, ...]:
        """Send a command for the coming period; what of it was applied [rad].

        Raises:
            PlantFault: it is not finite or jumps too far; all drives have been stopped by then.
            DriveError: the drives are not enabled.
        """
        status = self._status
        if status.fault is not None or status.state is not RUNNING:
            self._refuse_ended()
            why = (
                "this link is read-only" if self._parts.read_only else "the drives are not enabled"
            )
            raise DriveError(why)
        try:
            applied, words = self._motion.aim(motor_pos)
            self._supervisor.sent(complete=self.cycle.send(words))
        except BaseException as error:  # Whatever is raised, the drives stop.
            self._ending.stop_after(error)
            raise
        return applied

    def restart_from_applied(self) -> tuple[float, ...]:
        """Measure the next step of the command from what was applied last; returns that [rad]."""
        self._guard.restart_from_applied()
        return self._guard.applied

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
            self._ending.end(error)
            raise error
        return sample

    def _refuse_ended(self) -> None:
        status = self._status
        if status.fault is not None:
            raise status.fault
        if status.state not in EXCHANGING:
            raise DriveError(f"the link is {status.state.name.lower()}; start it first")
