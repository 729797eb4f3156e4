"""The stop of all drives: quick stop, no voltage for slow drives, check of the statuswords."""

from collections.abc import Callable
from typing import final

from legbench.drives.master.axis_link import AxisLink
from legbench.drives.master.cycle import Cycle
from legbench.drives.master.stop_report import StopReport
from legbench.drives.protocol.cia402 import POWERED, Goal, decode_state, describe_statusword

RAMP_MS = 40
"""Longest wait for a quick-stop ramp [ms]. A drive that still has power then loses its voltage,
and obeys two cycles later: every drive is without power after 50 ms."""
OFF_MS = 100
"""Longest wait until drives whose voltage is disabled show no power [ms]."""
SURE_CYCLES = 3
"""Number of cycles in a row that all drives must show no power to count as stopped."""
SILENT_MS = 20
"""Time without process data beyond which a drive counts as silent [ms]."""
FAILED_CYCLES = 3
"""Number of failed cycles in a row that end a wait, as no time passes in them."""


@final
class StopSequence:
    """Stop of all drives of a cycle; raises nothing.

    Whatever a step raises, a KeyboardInterrupt out of a driver included, the next step is taken.
    """

    def __init__(
        self,
        cycle: Cycle,
        hold: Callable[[BaseException], None],
        cycles_in: Callable[[float], int] = round,
    ) -> None:
        """Prepare to stop the drives of a cycle.

        Args:
            cycle: cycle of the drives, which this stop alone leads from now on.
            hold: called with what was raised, such as `Shield.hold`.
            cycles_in: number of cycles in a time [ms], see `BusConfig.cycles_in`; by default of
                1 ms each.
        """
        self._cycle, self._hold = cycle, hold
        self._ramp, self._off_wait, self._silence = map(cycles_in, (RAMP_MS, OFF_MS, SILENT_MS))
        self._cut_off: list[str] = []
        self._errors: dict[str, None] = {}
        self._quiet = dict.fromkeys(cycle.axes, 0)
        self._failed = 0

    def run(self) -> StopReport:
        """Send quick stop to all drives now, lead them to switch on disabled, look if they are."""
        cycle = self._cycle
        cycle.stopping = True
        for axis in cycle.axes:
            axis.hold()
            axis.machine.seek(Goal.QUICK_STOP)
        self._send()
        for _ in range(self._ramp):
            self._tick()
            if all(map(self._standing, cycle.axes)) or self._failed == FAILED_CYCLES:
                break
            self._send()
        for axis in cycle.axes:
            if not self._standing(axis):
                self._cut_off.append(axis.node.name)
            axis.machine.seek(Goal.DISABLED)
        self._lead_to_rest()
        return self._report()

    def _lead_to_rest(self) -> None:
        """Disable the voltage until every drive has shown for a while that it has no power."""
        sure, self._failed = 0, 0
        for _ in range(self._off_wait):
            self._send()
            self._tick()
            sure = sure + 1 if all(map(self._standing, self._cycle.axes)) else 0
            if sure == SURE_CYCLES or self._failed == FAILED_CYCLES:
                break

    def _send(self) -> None:
        """Send one controlword to every drive, once more if an exception interrupts it."""
        for _ in range(2):
            try:
                self._cycle.send(
                    [axis.machine.step(axis.statusword).controlword for axis in self._cycle.axes]
                )
                break
            except BaseException as error:  # The controlwords must be sent, whatever is raised.
                self._note(error)

    def _tick(self) -> None:
        """Run one cycle; what it raises, such as the body of an emulated leg, is counted."""
        try:
            self._cycle.tick()
            self._failed = 0
        except BaseException as error:  # The stop goes on, whatever a cycle raises.
            self._failed += 1
            self._note(error)
        for axis in self._cycle.axes:
            self._quiet[axis] = 0 if axis.fresh else self._quiet[axis] + 1

    def _note(self, error: BaseException) -> None:
        self._hold(error)
        self._errors[f"{type(error).__name__}: {error}".rstrip(": ")] = None

    def _standing(self, axis: AxisLink) -> bool:
        """Whether a drive is seen without power, or out of reach: its watchdogs stop it then."""
        return self._off(axis) or self._silent(axis)

    def _off(self, axis: AxisLink) -> bool:
        return axis.fresh and decode_state(axis.statusword) not in POWERED

    def _silent(self, axis: AxisLink) -> bool:
        return self._quiet[axis] > self._silence or (self._cycle.bus_off and not axis.fresh)

    def _report(self) -> StopReport:
        left = [axis for axis in self._cycle.axes if not self._off(axis)]
        silent = [axis for axis in left if not axis.fresh]
        powered = [axis for axis in left if axis.fresh]
        return StopReport(
            powered=tuple(axis.node.name for axis in powered),
            states=tuple(describe_statusword(axis.statusword) for axis in powered),
            silent=tuple(axis.node.name for axis in silent),
            cut_off=tuple(self._cut_off),
            errors=tuple(self._errors),
        )
