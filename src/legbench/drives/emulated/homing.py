"""Homing methods of an emulated drive (6098h): in place, and against the mechanical stops."""

from enum import Enum, auto
from typing import final

from legbench.drives.emulated.motion import Motion
from legbench.drives.protocol.cia402 import StatusBit
from legbench.drives.protocol.objects import Key

IN_PLACE = (35, 37)
TO_STOP = {-1: -1, -2: 1, -3: -1, -4: 1}
"""Method -> direction; -1 and -2 go back to the next index pulse of the encoder."""
WITH_INDEX = (-1, -2)
START = 1 << 4
"""Bit 4 of 6040h; homing starts at its rising edge and is interrupted by its end."""


class HomingState(Enum):
    """States of homing, shown by bits 10, 12 and 13 of the statusword (6041h)."""

    IDLE = auto()
    SEARCHING = auto()
    LEAVING = auto()
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
    """Homing run of an emulated motor."""

    def __init__(self, values: dict[Key, int], counts_per_rev: int) -> None:
        self._values, self._per_rev = values, counts_per_rev
        self.state = HomingState.IDLE
        self._asked = False
        self._index = 0.0

    def status(self, *, halted: bool, standing: bool) -> int:
        """Bits 10, 12 and 13 of the statusword; a halt interrupts homing once the motor stands."""
        if halted and standing and self.state in (HomingState.SEARCHING, HomingState.LEAVING):
            return StatusBit.TARGET_REACHED
        return STATUS.get(self.state, 0)

    def command(self, controlword: int) -> None:
        """Start or interrupt homing by bit 4 of a controlword."""
        asked = bool(controlword & START)
        if asked and not self._asked:
            known = self._values[0x6098, 0] in (*IN_PLACE, *TO_STOP)
            self.state = HomingState.SEARCHING if known else HomingState.FAILED
        elif not asked and self.state in (HomingState.SEARCHING, HomingState.LEAVING):
            self.state = HomingState.IDLE
        self._asked = asked

    def step(self, motion: Motion, step_ns: int) -> None:
        """Run homing for one motion cycle."""
        method = self._values[0x6098, 0]
        home = motion.sign * self._values[0x607C, 0]
        if self.state is HomingState.SEARCHING:
            if method in IN_PLACE:
                motion.call_it(home)
                self.state = HomingState.ATTAINED
            elif motion.blocked():
                motion.demand = motion.actual
                self._at_stop(motion, method, home)
            else:
                motion.seek(motion.sign * TO_STOP[method] * float(self._values[0x6099, 1]), step_ns)
        elif self.state is HomingState.LEAVING:
            speed = -motion.sign * TO_STOP[method] * float(self._values[0x6099, 2])
            motion.seek(speed, step_ns)
            if (motion.demand - self._index) * speed >= 0.0:
                motion.demand = self._index
                motion.drive(step_ns)
                motion.call_it(home)
                self.state = HomingState.ATTAINED

    def _at_stop(self, motion: Motion, method: int, home: int) -> None:
        if method not in WITH_INDEX:
            motion.call_it(home)
            self.state = HomingState.ATTAINED
            return
        turns = motion.actual // self._per_rev
        self._index = self._per_rev * (turns if motion.sign * TO_STOP[method] > 0 else turns + 1)
        self.state = HomingState.LEAVING if self._values[0x6099, 2] else HomingState.FAILED
