"""One axis of an emulated drive, cycle by cycle: controlwords, modes and words that come late."""

from dataclasses import replace
from typing import Any

import pytest
from drives_rig import MS, node

from legbench.drives.emulated.axis import Axis
from legbench.drives.emulated.behaviour import Behaviour
from legbench.drives.emulated.drive import EmulatedDrive
from legbench.drives.protocol.cia402 import DriveState
from legbench.drives.setup.config import POSITION_ACTUAL, STATUSWORD, PdoConfig
from legbench.drives.setup.encoders import Side

MODE, DISPLAY, CONTROL, STATUS = (0x6060, 0), (0x6061, 0), (0x6040, 0), (0x6041, 0)
CYCLIC = 8
"""Cyclic synchronous position mode (CiA 402)."""


class Led:
    """An axis that has booted, and a hand that writes its objects and lets milliseconds pass."""

    def __init__(self, changed: Any = None, **how: Any) -> None:
        self.axis: Axis = EmulatedDrive(changed or node(0), Behaviour(**how)).axis
        self.now_ns = 0
        self.axis.boot(0)

    def write(self, key: tuple[int, int], value: int) -> None:
        self.axis._values[key] = value
        self.axis.written(key, self.now_ns)

    def show(self, key: tuple[int, int]) -> int:
        return self.axis._values[key]

    def tick(self, cycles: int = 1) -> None:
        for _ in range(cycles):
            self.now_ns += MS
            self.axis.tick(self.now_ns, MS)
            self.axis.publish()

    def enable(self) -> None:
        """Shutdown, switch on, enable operation, in the mode that is set."""
        for word in (0x06, 0x07, 0x0F):
            self.write(CONTROL, word)
            self.tick()
        assert self.axis.power.state is DriveState.OPERATION_ENABLED


def test_a_slow_loop_reads_the_last_controlword_of_a_cycle_and_no_other() -> None:
    for slow, state in ((False, DriveState.SWITCHED_ON), (True, DriveState.SWITCH_ON_DISABLED)):
        it = Led(slow_loop=slow)
        it.write(CONTROL, 0x06)
        it.write(CONTROL, 0x07)
        it.tick()
        assert it.axis.power.state is state
    it = Led(slow_loop=True)
    it.write(CONTROL, 0x06)
    assert it.axis.power.state is DriveState.SWITCH_ON_DISABLED
    it.tick()
    assert it.axis.power.state is DriveState.READY_TO_SWITCH_ON


@pytest.mark.parametrize("needs_power", [True, False])
def test_a_mode_is_shown_late_and_of_some_drives_only_with_power(*, needs_power: bool) -> None:
    it = Led(mode_needs_power=needs_power, mode_lag_us=3000)
    it.write(MODE, CYCLIC)
    shown = []
    for _ in range(5):
        it.tick()
        shown.append(it.show(DISPLAY))
    assert shown == ([0] * 5 if needs_power else [0, 0, CYCLIC, CYCLIC, CYCLIC])
    it.enable()
    shown = [it.show(DISPLAY)]
    for _ in range(3):
        it.tick()
        shown.append(it.show(DISPLAY))
    # Three milliseconds after the last cycle without power.
    assert shown == ([0, 0, CYCLIC, CYCLIC] if needs_power else [CYCLIC] * 4)


def test_targets_are_latched_by_a_drive_that_is_enabled_in_the_cyclic_mode_alone() -> None:
    for mode, enabled, missing in ((CYCLIC, True, 2), (CYCLIC, False, 0), (6, True, 0)):
        it = Led(mode_lag_us=0)
        it.write(MODE, mode)
        it.tick()
        if enabled:
            it.enable()
        for _ in range(2):
            it.axis.sync(False, it.now_ns)
        assert it.axis.motion.missing == missing


def test_a_statusword_comes_late_and_none_of_before_comes_after_a_restart() -> None:
    it = Led(status_lag_us=2000)
    it.tick(5)
    it.write(CONTROL, 0x06)
    shown = []
    for _ in range(4):
        it.tick()
        shown.append(it.show(STATUS) & 0x6F)
    # Switch on disabled, then ready to switch on (CiA 402).
    assert shown == [0x40, 0x21, 0x21, 0x21]
    assert it.axis._late_words
    it.axis.restart()
    assert not it.axis._late_words


def test_a_loop_over_the_links_encoder_is_led_by_where_the_link_is() -> None:
    one_tpdo = (PdoConfig(number=1, objects=(STATUSWORD, POSITION_ACTUAL)),)
    at_link = replace(node(0), link=None, side=Side.LINK, tpdos=one_tpdo)
    it = Led(at_link, start_pos=0.25)
    it.axis.sense(0.35, 0.0)
    per_rad = (1 << 20) / 6.283185307179586
    assert it.axis.motion.beside == pytest.approx(0.1 * per_rad)
    it.axis.publish()
    assert it.show((0x6064, 0)) == round(777 + 0.35 * per_rad)
    # With an encoder of its own at the motor, a link moves nothing.
    beside = Led(start_pos=0.25)
    beside.axis.sense(0.35, 0.0)
    assert beside.axis.motion.beside == 0.0


def test_a_link_is_where_its_motor_is_until_it_is_shown_elsewhere() -> None:
    it = Led(start_pos=0.25)
    assert it.show((0x2064, 0)) == round(-55 + 0.25 * 65536 / 6.283185307179586)
