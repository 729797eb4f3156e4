"""The stop ladder: quick stop of all drives, disable voltage for one that does not obey."""

from typing import final

from legbench.drives.cia402 import POWERED, DriveState, Goal, decode_state
from legbench.drives.master.axis_link import AxisLink
from legbench.drives.master.cycle import Cycle
from legbench.drives.master.watch import NodeWatch

OBEY_CYCLES = 50
"""A drive that is still enabled so long after quick stop loses its voltage."""
RAMP_CYCLES = 1000
"""Longest that a quick-stop ramp is waited for."""
LAST_CYCLES = 3
"""With no voltage, so that the drives have seen the word."""


@final
class StopLadder:
    """One stop of all drives of a cycle; never raises.

    Attributes:
        cut_off: names of drives that lost their voltage because they did not obey.
        errors: what failed on the way.
    """

    def __init__(self, cycle: Cycle) -> None:
        self._cycle = cycle
        self.cut_off: list[str] = []
        self.errors: list[Exception] = []

    def run(self) -> None:
        """Send quick stop to all drives now, then lead them to switch on disabled."""
        cycle = self._cycle
        cycle.stopping = True
        for axis in cycle.axes:
            axis.machine.seek(Goal.QUICK_STOP)
        self._send()
        failed = 0
        for count in range(RAMP_CYCLES):
            failed = 0 if self._tick() else failed + 1
            standing = all(map(self._standing, cycle.axes, cycle.watches))
            if standing or cycle.bus_off or failed == LAST_CYCLES:
                break
            if count == OBEY_CYCLES:
                self._cut_off()
            self._send()
        for axis in cycle.axes:
            axis.machine.seek(Goal.DISABLED)
        for _ in range(LAST_CYCLES):
            self._send()
            self._tick()

    def _send(self) -> None:
        """One word to every drive; whatever fails, the next step is still taken."""
        try:
            self._cycle.send(
                [axis.machine.step(axis.statusword).controlword for axis in self._cycle.axes]
            )
        except Exception as error:
            self.errors.append(error)

    def _tick(self) -> bool:
        """One cycle; false if it failed, such as with the body of an emulated leg."""
        try:
            self._cycle.tick()
        except Exception as error:
            self.errors.append(error)
            return False
        return True

    @staticmethod
    def _standing(axis: AxisLink, watch: NodeWatch) -> bool:
        """Without power, or out of reach: then its own watchdogs stop it."""
        return decode_state(axis.statusword) not in POWERED or watch.missed > OBEY_CYCLES

    def _cut_off(self) -> None:
        for axis in self._cycle.axes:
            if decode_state(axis.statusword) in (None, DriveState.OPERATION_ENABLED):
                axis.machine.seek(Goal.DISABLED)
                self.cut_off.append(axis.node.name)
