"""Start-up of configured drives: enabling cycle by cycle, without a jump of the target."""

from collections.abc import Callable, Sequence
from typing import final

from legbench.drives.errors import DriveError
from legbench.drives.master.axis_link import AxisLink
from legbench.drives.master.cycle import Cycle
from legbench.drives.master.enable_watch import EnableWatch, enabled, obeys
from legbench.drives.master.port import Port
from legbench.drives.master.tick import Tick
from legbench.drives.protocol.cia402 import (
    HOLD_CYCLES,
    DriveState,
    Goal,
    decode_state,
    describe_statusword,
)
from legbench.drives.protocol.nmt import NmtCommand, nmt_frame
from legbench.drives.setup.config import BusConfig

SETTLE_PATIENCE_MS = 2000
"""Time within which process data has to become regular [ms]."""
ENABLE_PATIENCE_MS = 2000
"""Time within which all drives have to be enabled [ms]."""


@final
class StartUp:
    """Leads all drives together; until one is enabled its target is where its motor is."""

    def __init__(self, port: Port, cycle: Cycle, config: BusConfig, *, read_only: bool) -> None:
        self._port, self._cycle, self._config = port, cycle, config
        self._read_only = read_only
        self.listening = False
        """Whether another master sends SYNC, so that this one sends nothing."""

    def settle(self, tick: Callable[[], Tick]) -> Tick:
        """Start the nodes, wait for regular process data; raises DriveError or BusError."""
        if not self.listening:
            for node in self._config.nodes:
                self._port.send_frame(nmt_frame(NmtCommand.START, node.node_id))
        self._cycle.begin()
        regular = 0
        for _ in range(self._config.cycles_in(SETTLE_PATIENCE_MS)):
            last = tick()
            regular = regular + 1 if last.complete else 0
            self.idle()
            if regular >= self._config.settle_cycles:
                self._cycle.arm()
                return last
        missing = [axis.node.name for axis in self._cycle.axes if not axis.fresh]
        raise DriveError(
            f"no regular process data within {SETTLE_PATIENCE_MS} ms; missing: "
            f"{', '.join(missing) or 'now and then'}; look at the bus load and the mapping"
        )

    def idle(self) -> None:
        """End a cycle in which nothing is commanded."""
        if self.listening:
            return
        if self._read_only:
            self._cycle.send_heartbeat()
            return
        words: list[int | None] = []
        for axis in self._cycle.axes:
            if not axis.known:
                # The motor position is not known yet: any target would be a guess.
                words.append(None)
                continue
            step = axis.machine.step(axis.statusword)
            if step.state is not DriveState.OPERATION_ENABLED:
                axis.aim_at_actual()
            words.append(step.controlword)
        self._cycle.send(words)

    def faulted(self) -> list[AxisLink]:
        """Return the drives in fault."""
        return [
            axis for axis in self._cycle.axes if decode_state(axis.statusword) is DriveState.FAULT
        ]

    def seek(
        self, goal: Goal, axes: Sequence[AxisLink], tick: Callable[[], Tick], words: str
    ) -> Tick:
        """Lead drives to a goal in which they have no power, the rest stays where it is.

        Raises:
            DriveError: one does not get there; `words` say what it was to do.
            PlantFault: as `tick`.
        """
        for axis in axes:
            axis.machine.seek(goal)
        last = self._lead(axes, tick, lambda: all(map(_off, axes)), _off, words)
        for axis in axes:
            axis.machine.seek(Goal.DISABLED)
        self.idle()
        return last

    def enable(self, tick: Callable[[], Tick]) -> Tick:
        """Enable all drives together, where they stand.

        None is told to become enabled before all are switched on, which gives no torque; as soon
        as one is, the others have `enable_spread_ms` of the bus file.

        Raises:
            DriveError: one does not get there, and none is enabled.
            PlantFault: as `tick`, or as `EnableWatch.see`.
        """
        axes = self._cycle.axes
        words = "become enabled"
        watch = EnableWatch(axes, self._config)
        for axis in axes:
            axis.machine.seek(Goal.SWITCHED_ON)

        seen = 0

        def switched_on() -> bool:
            nonlocal seen
            watch.see()
            seen = seen + 1 if all(map(_switched_on, axes)) else 0
            # By then every drive has had its word for so long that all get the next one at once.
            return seen >= HOLD_CYCLES

        def reached() -> bool:
            watch.see()
            return all(map(obeys, axes))

        self._lead(axes, tick, switched_on, _switched_on, words)
        for axis in axes:
            axis.machine.seek(Goal.ENABLED)
        self.idle()
        return self._lead(axes, tick, reached, obeys, words)

    def _lead(
        self,
        axes: Sequence[AxisLink],
        tick: Callable[[], Tick],
        reached: Callable[[], bool],
        there: Callable[[AxisLink], bool],
        words: str,
    ) -> Tick:
        """Run cycles until drives have reached their goal; the last cycle is not ended."""
        refused: list[AxisLink] = []
        for _ in range(self._config.cycles_in(_patience_ms(axes))):
            last = tick()
            if reached():
                return last
            self.idle()
            refused = [axis for axis in axes if axis.machine.refused]
            if refused:
                break
        behind = [axis for axis in axes if not there(axis)]
        slow = (refused or behind or list(axes))[0]
        raise DriveError(
            f"drive '{slow.node.name}' (node {slow.node.node_id}) does not {words}: "
            f"{describe_statusword(slow.statusword)}{_why_not(slow)}"
        )


def _patience_ms(axes: Sequence[AxisLink]) -> int:
    """Time within which drives have to reach a goal, that of showing their mode included [ms]."""
    waits = [axis.node.quirks.mode_patience_ms for axis in axes if not axis.in_mode]
    return ENABLE_PATIENCE_MS + max(waits, default=0)


def _why_not(axis: AxisLink) -> str:
    """What else is missing of an enabled drive: it has not shown its mode."""
    if axis.in_mode or not enabled(axis):
        return ""
    return (
        f"; mode 8 is not shown in 6061h within {axis.node.quirks.mode_patience_ms} ms: raise "
        "mode_patience_ms in [node.quirks]"
    )


def _switched_on(axis: AxisLink) -> bool:
    return decode_state(axis.statusword) is DriveState.SWITCHED_ON


def _off(axis: AxisLink) -> bool:
    return decode_state(axis.statusword) is DriveState.SWITCH_ON_DISABLED
