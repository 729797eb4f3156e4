"""Start-up of configured drives: enabling cycle by cycle, without a jump of the target."""

from collections.abc import Callable, Sequence
from typing import final

from legbench.drives.errors import DriveError
from legbench.drives.master.axis_link import AxisLink
from legbench.drives.master.cycle import Cycle
from legbench.drives.master.port import Port
from legbench.drives.master.tick import Tick
from legbench.drives.protocol.cia402 import (
    DriveState,
    Goal,
    StatusBit,
    decode_state,
    describe_statusword,
)
from legbench.drives.protocol.nmt import NmtCommand, nmt_frame
from legbench.drives.setup.config import BusConfig
from legbench.errors import PlantFault

SETTLE_PATIENCE_MS = 2000
"""Time within which process data has to become regular [ms]."""
ENABLE_PATIENCE_MS = 2000
"""Time within which all drives have to be enabled [ms]."""
STILL_RANGE = 0.02
"""Largest motion of a motor while it is enabled; beyond it the start-up ends [rad]."""
IGNORE_PATIENCE = 5
"""Number of cycles within which an enabled drive has to follow its target."""


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
            self._cycle.send_rest()
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
        """Lead drives to a goal, the rest stays where it is.

        Raises:
            DriveError: one does not get there; `words` say what it was to do.
            PlantFault: as `tick`.
        """
        for axis in axes:
            axis.machine.seek(goal)
        refused: list[AxisLink] = []
        stood = [axis.motor_pos for axis in axes]
        ignored = 0
        for _ in range(self._config.cycles_in(_patience_ms(axes))):
            last = tick()
            if goal is Goal.ENABLED:
                ignored = ignored + 1 if any(map(_ignores, axes)) else 0
                _check_still(axes, stood, ignored)
            if all(map(_there, axes)):
                if goal is not Goal.ENABLED:
                    for axis in axes:
                        axis.machine.seek(Goal.DISABLED)
                    self.idle()
                return last
            self.idle()
            refused = [axis for axis in axes if axis.machine.refused]
            if refused:
                break
        behind = [axis for axis in axes if not _there(axis)]
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
    if axis.in_mode or decode_state(axis.statusword) is not DriveState.OPERATION_ENABLED:
        return ""
    return (
        f"; mode 8 is not shown in 6061h within {axis.node.quirks.mode_patience_ms} ms: raise "
        "mode_patience_ms in [node.quirks]"
    )


def _ignores(axis: AxisLink) -> bool:
    """Whether a drive is enabled but does not follow its target."""
    enabled = decode_state(axis.statusword) is DriveState.OPERATION_ENABLED
    return enabled and axis.in_mode and axis.statusword & axis.follows != axis.follows


def _check_still(axes: Sequence[AxisLink], stood: Sequence[float], ignored: int) -> None:
    """Check that no motor moves while drives are enabled; raises PlantFault."""
    for axis, before in zip(axes, stood, strict=True):
        who = f"drive '{axis.node.name}' (node {axis.node.node_id})"
        moved = axis.motor_pos - before
        if abs(moved) > STILL_RANGE:
            raise PlantFault(
                "moved while enabling",
                f"{who} moved by {moved:.3f} rad while it was enabled, the limit is "
                f"{STILL_RANGE:g} rad; look at its software limits and position offset",
            )
        enabled = decode_state(axis.statusword) is DriveState.OPERATION_ENABLED
        limited = bool(axis.statusword & StatusBit.INTERNAL_LIMIT)
        if enabled and (limited or (ignored > IGNORE_PATIENCE and _ignores(axis))):
            raise PlantFault(
                "command ignored",
                f"{who} does not follow its target on enabling: "
                f"{describe_statusword(axis.statusword)}",
            )


def _there(axis: AxisLink) -> bool:
    """Whether a drive has reached its goal."""
    state = decode_state(axis.statusword)
    if axis.machine.goal is Goal.ENABLED:
        following = axis.statusword & axis.follows == axis.follows
        return state is DriveState.OPERATION_ENABLED and following and axis.in_mode
    return state is DriveState.SWITCH_ON_DISABLED
