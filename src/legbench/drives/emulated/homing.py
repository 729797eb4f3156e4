"""Homing run of an emulated drive (CiA 402-2, homing mode): a sequence of moves, then home."""

from collections.abc import Mapping
from dataclasses import replace
from enum import Enum, auto
from typing import final

from legbench.drives.emulated.homing_methods import METHODS, Move, Until, mirrored
from legbench.drives.emulated.motion import SECOND_NS, Motion
from legbench.drives.emulated.switches import Switches
from legbench.drives.protocol.cia402 import StatusBit
from legbench.drives.protocol.objects import Key

START = 1 << 4
"""Bit 4 of 6040h; homing starts at its rising edge and is interrupted by its end."""

POSITION_POLARITY = 1 << 7
"""Bit 7 of 607Eh, which turns the sign of positions."""
AT_INDEX = 1e-3
"""Distance from an index pulse at which the motor stands on it [counts]."""


class HomingState(Enum):
    """States of homing, shown by bits 10, 12 and 13 of the statusword (6041h)."""

    IDLE = auto()
    SEARCHING = auto()
    ATTAINED = auto()
    FAILED = auto()


STATUS = {
    HomingState.ATTAINED: StatusBit.TARGET_REACHED | StatusBit.FOLLOWS_COMMAND,
    HomingState.FAILED: StatusBit.TARGET_REACHED | StatusBit.FOLLOWING_ERROR,
    HomingState.IDLE: StatusBit.TARGET_REACHED,
}
"""Bits of the statusword by state; homing in progress has none of them."""


@final
class Homing:
    """Homing run of an emulated motor.

    Attributes:
        state: how far it is.
        done: whether the position refers to a home since power-on.
    """

    def __init__(self, values: Mapping[Key, int], switches: Switches) -> None:
        self._values, self._switches = values, switches
        self.state = HomingState.IDLE
        self.done = False
        self._asked = False
        self._moves: list[Move] = []
        self._index: float | None = None

    def status(self, *, halted: bool, standing: bool) -> int:
        """Bits 10, 12 and 13 of the statusword; a halt interrupts homing once the motor stands."""
        if halted and standing and self.state is HomingState.SEARCHING:
            return StatusBit.TARGET_REACHED
        return STATUS.get(self.state, 0)

    def command(self, controlword: int) -> None:
        """Start or interrupt homing by bit 4 of a controlword."""
        asked = bool(controlword & START)
        if asked and not self._asked:
            moves = METHODS.get(self._values[0x6098, 0])
            self.state = HomingState.FAILED if moves is None else HomingState.SEARCHING
            # The polarity turns the axis round, and its limit switches with it.
            turned = self._values[0x607E, 0] & POSITION_POLARITY
            self._moves = list(mirrored(moves or ()) if turned else moves or ())
            self._index = None
            self.done = False
        elif not asked and self.state is HomingState.SEARCHING:
            self.state = HomingState.IDLE
        self._asked = asked

    def step(self, motion: Motion, step_ns: int) -> None:
        """Run homing for one motion cycle."""
        if self.state is not HomingState.SEARCHING:
            return
        while self._moves and self._ended(self._moves[0], motion):
            self._moves.pop(0)
            self._index = None
        if not self._moves:
            motion.set_position(motion.sign * self._values[0x607C, 0])
            self.state, self.done = HomingState.ATTAINED, True
            return
        move = self._moves[0]
        speed = float(self._values[0x6099, 1 if move.fast else 2])
        if not speed or not self._free(move, motion):
            self.state = HomingState.FAILED
            motion.seek(0.0, step_ns)
            return
        motion.seek(self._moves[0].direction * speed, step_ns)
        self._catch_index(motion, step_ns)

    def _ended(self, move: Move, motion: Motion) -> bool:
        if move.until is Until.STOP:
            if motion.blocked():
                motion.demand = motion.actual
                return True
            return False
        if move.until is Until.INDEX:
            if self._index is None:
                self._index = self._switches.next_index(motion.travel, move.direction)
            return abs(motion.travel - self._index) < AT_INDEX
        return self._switches.active(move.until, motion.travel) == move.on

    def _free(self, move: Move, motion: Motion) -> bool:
        """Whether the way is free; a search that may turn round at a limit switch does it once."""
        towards = Until.POSITIVE_LIMIT if move.direction > 0 else Until.NEGATIVE_LIMIT
        # A limit switch lies before its mechanical stop, so no other move ever reaches one.
        if move.until in (Until.STOP, towards) or not self._switches.active(towards, motion.travel):
            return True
        if move.turns:
            self._moves[0] = replace(move, direction=-move.direction, turns=False)
        return move.turns

    def _catch_index(self, motion: Motion, step_ns: int) -> None:
        """Stop at the index pulse itself, which the drive's hardware latches."""
        move, index = self._moves[0], self._index
        if move.until is not Until.INDEX or index is None:
            return
        left = index - (motion.travel + motion.demand - motion.actual)
        if left * move.direction <= 0.0:
            motion.seek(left * SECOND_NS / step_ns, step_ns)
