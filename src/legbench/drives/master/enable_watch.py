"""Watch of drives while they are enabled: none moves, none disobeys, none stays enabled alone."""

from collections.abc import Sequence
from typing import final

from legbench.drives.master.axis_link import AxisLink
from legbench.drives.protocol.cia402 import (
    DriveState,
    StatusBit,
    decode_state,
    describe_statusword,
)
from legbench.drives.setup.config import BusConfig
from legbench.errors import PlantFault

STILL_RANGE = 0.02
"""Largest motion of a motor while it is enabled; beyond it the start-up ends [rad]."""
IGNORE_PATIENCE = 5
"""Number of cycles within which an enabled drive has to follow its target."""


def enabled(axis: AxisLink) -> bool:
    """Whether a drive shows operation enabled."""
    return decode_state(axis.statusword) is DriveState.OPERATION_ENABLED


def obeys(axis: AxisLink) -> bool:
    """Whether a drive is enabled, has shown its mode and follows its target."""
    return enabled(axis) and axis.in_mode and axis.statusword & axis.follows == axis.follows


@final
class EnableWatch:
    """Looks at the drives of a leg in every cycle in which they are enabled; stops nothing."""

    def __init__(self, axes: Sequence[AxisLink], config: BusConfig) -> None:
        """Begin where the motors stand now."""
        self._axes = axes
        self._stood = [axis.motor_pos for axis in axes]
        self._spread_ms = config.enable_spread_ms
        # Whole cycles, and the last one not beyond the time.
        self._spread = -(-1000 * config.enable_spread_ms // config.period_us)
        self._ignored = self._alone = 0

    def see(self) -> None:
        """Look at a cycle.

        Raises:
            PlantFault: a motor has moved, a drive does not follow its target, or one has been
                enabled for too long while another is not.
        """
        self._ignored = self._ignored + 1 if any(map(_ignores, self._axes)) else 0
        for axis, before in zip(self._axes, self._stood, strict=True):
            self._check_still(axis, before)
        self._check_together()

    def _check_still(self, axis: AxisLink, before: float) -> None:
        moved = axis.motor_pos - before
        if abs(moved) > STILL_RANGE:
            raise PlantFault(
                "moved while enabling",
                f"{_who(axis)} moved by {moved:.3f} rad while it was enabled, the limit is "
                f"{STILL_RANGE:g} rad; look at its software limits and position offset",
            )
        limited = bool(axis.statusword & StatusBit.INTERNAL_LIMIT)
        if enabled(axis) and (limited or (self._ignored > IGNORE_PATIENCE and _ignores(axis))):
            raise PlantFault(
                "command ignored",
                f"{_who(axis)} does not follow its target on enabling: "
                f"{describe_statusword(axis.statusword)}; look at its software limits (607Dh), or "
                "give follows_bit = false in [node.quirks] if it never shows bit 12 of 6041h",
            )

    def _check_together(self) -> None:
        """One motor of a leg that holds alone turns every load into torque of its joint."""
        behind = [axis for axis in self._axes if not enabled(axis)]
        self._alone = self._alone + 1 if 0 < len(behind) < len(self._axes) else 0
        if self._alone >= self._spread:
            slow = behind[0]
            raise PlantFault(
                "drive not enabled",
                f"{_who(slow)} is not enabled {self._spread_ms} ms after the other one: "
                f"{describe_statusword(slow.statusword)}; the limit is enable_spread_ms in the "
                "bus file; look at its brake, its supply and its error",
            )


def _ignores(axis: AxisLink) -> bool:
    """Whether a drive is enabled and in its mode, but does not follow its target."""
    return enabled(axis) and axis.in_mode and not obeys(axis)


def _who(axis: AxisLink) -> str:
    return f"drive '{axis.node.name}' (node {axis.node.node_id})"
