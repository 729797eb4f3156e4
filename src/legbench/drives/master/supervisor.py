"""Checks that end a run besides the limits of motion: bus, grid, and state of the drives."""

import math
from typing import final

from legbench.drives.master.axis_link import AxisLink
from legbench.drives.master.cycle import Cycle
from legbench.drives.master.notices import TOLD
from legbench.drives.master.tick import Tick
from legbench.drives.protocol.cia402 import Way, describe_statusword
from legbench.drives.setup.config import BusConfig
from legbench.drives.transport.timebase import Timebase
from legbench.errors import PlantFault
from legbench.limits.safety import OVERRUNS, SafetyLimits

MISSING_TEMPERATURES = 3
"""Number of unanswered temperature requests in a row that end a run with such a limit."""


@final
class Supervisor:
    """Checks of every cycle; raises what it finds, stops nothing itself."""

    def __init__(
        self, cycle: Cycle, config: BusConfig, limits: SafetyLimits, timebase: Timebase
    ) -> None:
        self._cycle, self._config, self._limits = cycle, config, limits
        self._timebase = timebase
        self._overruns = 0
        self._ignored = 0
        self._unsent = 0
        self._lost_frames = limits.lost_frames
        self._polls = cycle.polls if math.isfinite(limits.temperature) else ()

    def bus(self, tick: Tick) -> None:
        """Check that the controller is on the bus and the grid is kept; raises PlantFault."""
        cycle = self._cycle
        if cycle.stranger is not None:
            self.check_no_other_master()
        if cycle.bus_off:
            raise PlantFault(
                "bus off", "the controller has left the bus; check wiring and termination"
            )
        missed = tick.skipped - tick.silent
        if not missed:
            self._overruns = 0
            return
        self._overruns += missed
        if self._overruns >= self._limits.overrun_cycles:
            raise PlantFault(
                OVERRUNS,
                f"{self._overruns} ticks of {self._config.period_us} us missed in a row, the limit "
                f"is {self._limits.overrun_cycles}; free the processor",
            )

    def check_no_other_master(self) -> None:
        """Check that no other master leads these drives; raises PlantFault."""
        stranger = self._cycle.stranger
        if stranger is not None:
            raise PlantFault(
                "second master",
                f"somebody else sends {stranger:03X}h, which only the master of these drives does; "
                "unplug it, or end its program",
            )

    def sent(self, *, complete: bool) -> None:
        """Check that the commands of a cycle have gone out; raises PlantFault."""
        self._unsent = 0 if complete else self._unsent + 1
        if self._unsent >= self._limits.lost_frames:
            raise PlantFault(
                "command not sent",
                f"commands could not be sent for {self._unsent} cycles, the limit is "
                f"{self._limits.lost_frames}; {self._cycle.bus_error}",
            )

    def drives(self) -> None:
        """Check that every drive answers, lives and reports no emergency; raises PlantFault."""
        now_ns, cycle = self._timebase.now_ns(), self._cycle
        for poll in self._polls:
            if poll.unanswered >= MISSING_TEMPERATURES:
                axis = cycle.axes[self._polls.index(poll)]
                raise _unknown_temperature(axis, poll.unanswered)
        for watch in cycle.watches:
            if now_ns <= watch.well_until_ns:
                continue
            trouble = watch.trouble(now_ns, self._lost_frames)
            if trouble is not None:
                cause, text = trouble
                error = cycle.bus_error
                raise PlantFault(cause, text if error is None else f"{text}; {error}")

    def states(self, now_ns: int) -> None:
        """Check that every drive is enabled and follows its target; raises PlantFault.

        A statusword that was taken in the cycle before needs no new decision. Warnings in it are
        noted at this time [ns].
        """
        ignored, told = False, 0
        for axis in self._cycle.axes:
            if not axis.fresh:
                continue
            word, machine, follows = axis.statusword, axis.machine, axis.follows
            if word != machine.settled and machine.step(word).way is not Way.REACHED:
                raise PlantFault(
                    "drive not enabled",
                    f"drive '{axis.node.name}' (node {axis.node.node_id}) left operation enabled: "
                    f"{describe_statusword(word)}",
                )
            told |= word
            ignored = ignored or word & follows != follows
        if told & TOLD:
            self._cycle.notices.statuswords(self._cycle.axes, now_ns)
        if not ignored:
            self._ignored = 0
            return
        self._ignored += 1
        if self._ignored > self._limits.following_cycles:
            words = "; ".join(describe_statusword(axis.statusword) for axis in self._cycle.axes)
            raise PlantFault("command ignored", f"a drive does not follow its target: {words}")


def _unknown_temperature(axis: AxisLink, unanswered: int) -> PlantFault:
    """Fault of a drive whose temperature has a limit and is not reported."""
    return PlantFault(
        "temperature",
        f"drive '{axis.node.name}' (node {axis.node.node_id}) has not reported its "
        f"temperature for {unanswered} requests; its limit cannot be watched",
    )
