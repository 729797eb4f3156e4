"""The power state machine inside a drive (CiA 402-2, fig. 9): controlwords in, state out."""

from typing import final

from legbench.drives.protocol.cia402 import DriveState
from legbench.drives.protocol.objects import Key

_S = DriveState
_WORDS = {
    _S.NOT_READY_TO_SWITCH_ON: 0x00,
    _S.SWITCH_ON_DISABLED: 0x40,
    _S.READY_TO_SWITCH_ON: 0x31,
    _S.SWITCHED_ON: 0x33,
    _S.OPERATION_ENABLED: 0x37,
    _S.QUICK_STOP_ACTIVE: 0x17,
    _S.FAULT_REACTION_ACTIVE: 0x1F,
    _S.FAULT: 0x08,
}
"""Low byte of the statusword, voltage enabled (bit 4) with the main supply."""
STAY_IN_QUICK_STOP = 5
"""Lowest value of 605Ah with which a drive stays in quick stop active."""
HALT = 1 << 8
# Members by names of their own: looking one up in its class takes as long as all else here.
_DISABLED, _READY, _SWITCHED_ON = _S.SWITCH_ON_DISABLED, _S.READY_TO_SWITCH_ON, _S.SWITCHED_ON
_ENABLED, _FAULT = _S.OPERATION_ENABLED, _S.FAULT
_DEAF = (_S.FAULT_REACTION_ACTIVE, _S.NOT_READY_TO_SWITCH_ON)
"""States in which a drive obeys no controlword."""
_FAULTY = (_S.FAULT, _S.FAULT_REACTION_ACTIVE)
POWERED = (_S.OPERATION_ENABLED, _S.QUICK_STOP_ACTIVE, _S.FAULT_REACTION_ACTIVE)
"""States in which the motor holds or stops a load."""


@final
class PowerStage:
    """State and pending stop of one drive.

    Attributes:
        state: state of the machine.
        stopping: option code of the stop that runs, none if none does; 0 drops the motor at
            once, 1 is the slow-down ramp, 2 the quick-stop ramp, 3 and 4 the fastest possible.
    """

    def __init__(self, values: dict[Key, int]) -> None:
        self._values = values
        self.state = DriveState.NOT_READY_TO_SWITCH_ON
        self.stopping: int | None = None
        self._after: DriveState | None = None
        self._before = 0

    @property
    def low_byte(self) -> int:
        """Bits 0 to 6 of the statusword (6041h)."""
        return _WORDS[self.state]

    @property
    def faulted(self) -> bool:
        """Whether the drive is in a fault, or on its way there."""
        return self.state in _FAULTY

    def boot(self) -> None:
        """Enter switch on disabled after the self-test (transition 1)."""
        self._enter(DriveState.SWITCH_ON_DISABLED)

    def command(self, controlword: int, *, cause_gone: bool) -> bool:
        """Obey a controlword (6040h); returns whether a fault was reset."""
        before, self._before = self._before, controlword
        if self.state is _FAULT:
            edge = controlword & 0x80 and not before & 0x80
            if edge and cause_gone:
                self._enter(DriveState.SWITCH_ON_DISABLED)
                return True
            return False
        if controlword & 0x80 or self.state in _DEAF:
            return False
        self._transit(controlword)
        return False

    def _transit(self, word: int) -> None:
        state = self.state
        disable, quick = not word & 0x02, word & 0x06 == 0x02
        shutdown, on = word & 0x07 == 0x06, word & 0x07 == 0x07
        enable = on and bool(word & 0x08)
        if state is _DISABLED:
            if shutdown:
                self._enter(_READY)  # 2
        elif disable:
            self._enter(_DISABLED)  # 7, 9, 10, 12
        elif state is _READY:
            if quick:
                self._enter(_DISABLED)  # 7
            elif on:
                self._enter(_SWITCHED_ON)  # 3
        elif state is _SWITCHED_ON:
            if quick:
                self._enter(_DISABLED)  # 10
            elif shutdown:
                self._enter(_READY)  # 6
            elif enable:
                self._enter(_ENABLED)  # 4
        elif state is _ENABLED:
            self._from_enabled(quick=quick, shutdown=shutdown, on=on, enable=enable)
        elif enable and self._values[0x605A, 0] >= STAY_IN_QUICK_STOP:
            self._enter(_ENABLED)  # 16; only quick stop active is left here

    def _from_enabled(self, *, quick: bool, shutdown: bool, on: bool, enable: bool) -> None:
        if quick:
            self.quick_stop()  # 11
        elif shutdown:
            self._stop(self._values[0x605B, 0], _S.READY_TO_SWITCH_ON)  # 8
        elif on and not enable:
            self._stop(self._values[0x605C, 0], _S.SWITCHED_ON)  # 5
        elif enable:
            self.stopping = self._after = None

    def quick_stop(self) -> None:
        """Start the stop that the quick stop option code 605Ah selects (transition 11)."""
        if self.state is not DriveState.OPERATION_ENABLED:
            return
        option = self._values[0x605A, 0]
        if option == 0:
            self._enter(_S.SWITCH_ON_DISABLED)
            return
        self._enter(_S.QUICK_STOP_ACTIVE)
        self.stopping = option if option < STAY_IN_QUICK_STOP else option - 4
        self._after = None if option >= STAY_IN_QUICK_STOP else _S.SWITCH_ON_DISABLED

    def fault(self) -> None:
        """Start the stop that the fault reaction option code 605Eh selects (transition 13)."""
        if self.faulted:
            return
        moving = self.state in POWERED
        option = self._values[0x605E, 0]
        self._enter(_S.FAULT_REACTION_ACTIVE)
        if moving and option > 0:
            self.stopping, self._after = option, _S.FAULT
        else:
            self._enter(_S.FAULT)  # 14

    def disable(self) -> None:
        """Take the power away at once."""
        if self.state not in (_S.FAULT, _S.FAULT_REACTION_ACTIVE, _S.NOT_READY_TO_SWITCH_ON):
            self._enter(_S.SWITCH_ON_DISABLED)

    def connection_lost(self) -> None:
        """Start the reaction to a lost connection that 6007h selects."""
        option = self._values[0x6007, 0]
        if option == 1:
            self.fault()
        elif option == 2:
            self.disable()
        elif option == 3:
            self.quick_stop()

    def stopped(self) -> None:
        """Enter the state that follows a stop, at the end of its ramp."""
        after, self._after = self._after, None
        if after is not None:
            self._enter(after)

    def _stop(self, option: int, after: DriveState) -> None:
        if option <= 0:
            self._enter(after)
        else:
            self.stopping, self._after = option, after

    def _enter(self, state: DriveState) -> None:
        self.state = state
        self.stopping = self._after = None
