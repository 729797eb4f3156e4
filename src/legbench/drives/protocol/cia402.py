"""The power state machine of CiA 402-2 (6040h, 6041h), seen from the master; pure.

One step a cycle, nothing waits. A drive that has left operation enabled is never led back by
itself: somebody has to ask again.
"""

from dataclasses import dataclass
from enum import Enum, IntEnum
from typing import final


class DriveState(Enum):
    """States of the power drive system (CiA 402-2, 8.2)."""

    NOT_READY_TO_SWITCH_ON = "not ready to switch on"
    SWITCH_ON_DISABLED = "switch on disabled"
    READY_TO_SWITCH_ON = "ready to switch on"
    SWITCHED_ON = "switched on"
    OPERATION_ENABLED = "operation enabled"
    QUICK_STOP_ACTIVE = "quick stop active"
    FAULT_REACTION_ACTIVE = "fault reaction active"
    FAULT = "fault"


_S = DriveState
PATTERNS = (
    (0x4F, 0x00, _S.NOT_READY_TO_SWITCH_ON),
    (0x4F, 0x40, _S.SWITCH_ON_DISABLED),
    (0x6F, 0x21, _S.READY_TO_SWITCH_ON),
    (0x6F, 0x23, _S.SWITCHED_ON),
    (0x6F, 0x27, _S.OPERATION_ENABLED),
    (0x6F, 0x07, _S.QUICK_STOP_ACTIVE),
    (0x4F, 0x0F, _S.FAULT_REACTION_ACTIVE),
    (0x4F, 0x08, _S.FAULT),
)
"""Mask, value, state of the statusword (CiA 402-2, table 30)."""
_BY_LOW_BYTE = tuple(
    next((state for mask, value, state in PATTERNS if low & mask == value), None)
    for low in range(256)
)


POWERED = (
    None,
    DriveState.OPERATION_ENABLED,
    DriveState.QUICK_STOP_ACTIVE,
    DriveState.FAULT_REACTION_ACTIVE,
)
"""States in which a motor may have torque; one that cannot be read counts as such."""


class Mode(IntEnum):
    """6060h, modes of operation, as far as a leg uses them."""

    NONE = 0
    HOMING = 6
    CYCLIC_SYNCHRONOUS_POSITION = 8


class StatusBit(IntEnum):
    """Bits of the statusword (6041h)."""

    VOLTAGE_ENABLED = 1 << 4
    WARNING = 1 << 7
    REMOTE = 1 << 9
    TARGET_REACHED = 1 << 10
    """Bit 10. Homing: finished. Cyclic synchronous position: vendors differ, so it is not used."""
    INTERNAL_LIMIT = 1 << 11
    FOLLOWS_COMMAND = 1 << 12
    """Bit 12. Cyclic synchronous position: the drive follows the target. Homing: attained."""
    FOLLOWING_ERROR = 1 << 13
    """Bit 13. Cyclic synchronous position: following error. Homing: homing error."""


_BIT_WORDS = (
    (StatusBit.VOLTAGE_ENABLED, "voltage enabled"),
    (StatusBit.WARNING, "warning"),
    (StatusBit.REMOTE, "remote"),
    (StatusBit.INTERNAL_LIMIT, "internal limit"),
    (StatusBit.FOLLOWS_COMMAND, "follows command"),
    (StatusBit.FOLLOWING_ERROR, "following error"),
)


class Controlword(IntEnum):
    """Commands of 6040h (CiA 402-2, table 28)."""

    DISABLE_VOLTAGE = 0x00
    QUICK_STOP = 0x02
    SHUTDOWN = 0x06
    SWITCH_ON = 0x07
    ENABLE_OPERATION = 0x0F
    FAULT_RESET = 0x80
    """Fault reset, which acts on the rising edge of bit 7."""


def decode_state(statusword: int) -> DriveState | None:
    """State of a statusword; none when no pattern fits: then do not command."""
    return _BY_LOW_BYTE[statusword & 0xFF]


def describe_statusword(statusword: int) -> str:
    """Description of a statusword: its state and set bits."""
    state = decode_state(statusword)
    words = [state.value if state is not None else "unknown state"]
    words += [text for bit, text in _BIT_WORDS if statusword & bit]
    return f"{statusword:04X}h: " + ", ".join(words)


class Goal(Enum):
    """State that a master wants a drive to reach."""

    DISABLED = "switch on disabled"
    READY = "ready to switch on"
    SWITCHED_ON = "switched on"
    ENABLED = "operation enabled"
    QUICK_STOP = "quick stop"
    """The drive stops on its own quick-stop ramp; without power the goal is reached at once."""
    FAULT_RESET = "fault reset"


class Way(Enum):
    """Whether a goal is reached, is being approached, or cannot be reached from a state."""

    REACHED = "reached"
    MOVING = "on the way"
    REFUSED = "refused"
    """The state machine cannot leave the present state for this goal by itself."""


HOLD = {
    _S.NOT_READY_TO_SWITCH_ON: Controlword.DISABLE_VOLTAGE,
    _S.SWITCH_ON_DISABLED: Controlword.DISABLE_VOLTAGE,
    _S.READY_TO_SWITCH_ON: Controlword.SHUTDOWN,
    _S.SWITCHED_ON: Controlword.SWITCH_ON,
    _S.OPERATION_ENABLED: Controlword.ENABLE_OPERATION,
    _S.QUICK_STOP_ACTIVE: Controlword.QUICK_STOP,
    _S.FAULT_REACTION_ACTIVE: Controlword.DISABLE_VOLTAGE,
    _S.FAULT: Controlword.DISABLE_VOLTAGE,
}
"""Controlword that keeps a drive in its state, by state."""
_ENABLING = (_S.SWITCH_ON_DISABLED, _S.READY_TO_SWITCH_ON, _S.SWITCHED_ON, _S.OPERATION_ENABLED)
_PLACE_OF_GOAL = {
    Goal.DISABLED: 0,
    Goal.READY: 1,
    Goal.SWITCHED_ON: 2,
    Goal.ENABLED: 3,
}
_FAULTY = (_S.FAULT, _S.FAULT_REACTION_ACTIVE)


def next_controlword(state: DriveState, goal: Goal) -> tuple[Controlword, Way]:
    """One step from a state towards a goal (transitions 2 to 12 and 15 of CiA 402-2, fig. 9).

    Towards operation enabled it takes one transition a call; away from it, all at once. Quick stop
    is left for switch on disabled alone, a fault by a fault reset alone.
    """
    hold = HOLD[state]
    if goal is Goal.FAULT_RESET:
        if state is _S.FAULT:
            return Controlword.FAULT_RESET, Way.MOVING
        if state in (_S.FAULT_REACTION_ACTIVE, _S.NOT_READY_TO_SWITCH_ON):
            return hold, Way.MOVING
        return hold, Way.REACHED if state is _S.SWITCH_ON_DISABLED else Way.REFUSED
    if goal is Goal.QUICK_STOP:
        if state in (_S.OPERATION_ENABLED, _S.SWITCHED_ON, _S.READY_TO_SWITCH_ON):
            return Controlword.QUICK_STOP, Way.MOVING
        return hold, Way.MOVING if state is _S.FAULT_REACTION_ACTIVE else Way.REACHED
    if state in _FAULTY:
        return hold, Way.REFUSED
    if state is _S.NOT_READY_TO_SWITCH_ON:
        return hold, Way.MOVING
    if state is _S.QUICK_STOP_ACTIVE:
        if goal is Goal.DISABLED:
            return Controlword.DISABLE_VOLTAGE, Way.MOVING
        return hold, Way.REFUSED
    place, wanted = _ENABLING.index(state), _PLACE_OF_GOAL[goal]
    if place == wanted:
        return hold, Way.REACHED
    return HOLD[_ENABLING[place + 1 if place < wanted else wanted]], Way.MOVING


_BLIND = {
    Goal.QUICK_STOP: Controlword.QUICK_STOP,
    Goal.DISABLED: Controlword.DISABLE_VOLTAGE,
}
"""Controlwords of the goals that stop a drive: they alone are sent when its state is unknown."""
HOLD_CYCLES = 2
"""Number of cycles that a controlword is held: a drive with a 1 ms loop may miss a shorter one."""


@dataclass(frozen=True, slots=True)
class PowerStep:
    """Decision of one cycle of the state machine."""

    controlword: int
    state: DriveState | None
    way: Way


@final
class PowerMachine:
    """Leads one drive to a goal, a step a cycle, each step only after the last is confirmed.

    Attributes:
        goal: state to reach; `DISABLED` after a drive has left operation enabled unasked.
        lost: the drive left operation enabled unasked; cleared by the next `seek`.
        controlword: controlword that the last step decided.
        refused: the last step could not be taken from the drive's state.
        settled: statusword that the last step took and whose repetition needs no step, as the goal
            is reached and its controlword has been held for long enough; none otherwise.
    """

    def __init__(self) -> None:
        self.goal = Goal.DISABLED
        self.lost = False
        self._enabled = False
        self.controlword = int(Controlword.DISABLE_VOLTAGE)
        self._age = 0
        self._begun = False
        self._reset_spent = False
        self.refused = False
        self.settled: int | None = None
        self._steady: PowerStep | None = None
        self._steady_byte = 0

    def seek(self, goal: Goal) -> None:
        """Ask for a goal; asking again for the same one starts a new try."""
        self.goal, self.lost = goal, False
        self._enabled = self._reset_spent = self.refused = False
        self._steady = self.settled = None

    def step(self, statusword: int) -> PowerStep:
        """Decide the controlword of this cycle from the latest statusword."""
        steady = self._steady
        if steady is not None and statusword & 0xFF == self._steady_byte:
            self._age += 1
            self.settled = statusword if self._age >= HOLD_CYCLES else None
            return steady
        self.settled = None
        state = decode_state(statusword)
        if state is None:
            self._steady = None
            word = _BLIND.get(self.goal)
            if word is None:
                self._age += 1
            else:
                self._send(int(word), at_once=True)
            return PowerStep(self.controlword, None, Way.MOVING)
        if self.goal is Goal.ENABLED:
            if state is DriveState.OPERATION_ENABLED:
                self._enabled = True
            elif self._enabled:
                self.goal, self.lost = Goal.DISABLED, True
        wanted, way = next_controlword(state, self.goal)
        if wanted is Controlword.FAULT_RESET:
            wanted, way = self._edge()
        if self.lost:
            way = Way.REFUSED
        self.refused = way is Way.REFUSED
        self._send(int(wanted), at_once=self.goal in (Goal.QUICK_STOP, Goal.DISABLED))
        step = PowerStep(self.controlword, state, way)
        settled = way is Way.REACHED and self.controlword == wanted
        self._steady, self._steady_byte = step if settled else None, statusword & 0xFF
        return step

    def _edge(self) -> tuple[Controlword, Way]:
        """Fault reset with one rising edge of bit 7 a request: low, high, low, two cycles each."""
        if self.controlword & Controlword.FAULT_RESET:
            if self._age < HOLD_CYCLES:
                return Controlword.FAULT_RESET, Way.MOVING
            return Controlword.DISABLE_VOLTAGE, Way.MOVING
        if self._reset_spent:
            late = self._age > RESET_PATIENCE
            return Controlword.DISABLE_VOLTAGE, Way.REFUSED if late else Way.MOVING
        if self.controlword != Controlword.DISABLE_VOLTAGE or self._age < HOLD_CYCLES:
            return Controlword.DISABLE_VOLTAGE, Way.MOVING
        self._reset_spent = True
        return Controlword.FAULT_RESET, Way.MOVING

    def _send(self, wanted: int, *, at_once: bool) -> None:
        # The very first word must not disturb a drive that is found enabled.
        if wanted == self.controlword:
            self._age += 1
        elif at_once or not self._begun or self._age >= HOLD_CYCLES:
            self.controlword, self._age = wanted, 1
        else:
            self._age += 1
        self._begun = True


RESET_PATIENCE = 50
"""Cycles after a fault reset before it counts as refused: the cause is still there."""
