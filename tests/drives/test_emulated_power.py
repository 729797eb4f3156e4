"""The power state machine inside a drive, against the transitions of CiA 402-2, figure 9."""

import itertools

import pytest

from legbench.drives.emulated.power import PowerStage
from legbench.drives.protocol.cia402 import DriveState

S = DriveState
POWERED = (S.OPERATION_ENABLED, S.QUICK_STOP_ACTIVE, S.FAULT_REACTION_ACTIVE)


def stage(state: DriveState, **options: int) -> PowerStage:
    """A drive in a state that waited for nothing, its options named by their index."""
    chosen = {"605A": 2, "605B": 0, "605C": 0, "605E": 2, "6007": 1} | {
        name[1:]: value for name, value in options.items()
    }
    made = PowerStage({(int(name, 16), 0): value for name, value in chosen.items()})
    made.state = state
    return made


def command_of(word: int) -> str:
    """Name of a controlword by bits 7, 3, 2, 1, 0 as table 28 prints them."""
    bits = "".join(str(word >> place & 1) for place in (7, 3, 2, 1, 0))
    table = {
        "disable voltage": "0xx0x",
        "quick stop": "0x01x",
        "shutdown": "0x110",
        "switch on": "00111",
        "enable operation": "01111",
    }
    for name, pattern in table.items():
        if all(want in ("x", bit) for want, bit in zip(pattern, bits, strict=True)):
            return name
    return "none"


TRANSITIONS = {
    (S.SWITCH_ON_DISABLED, "shutdown"): S.READY_TO_SWITCH_ON,
    (S.READY_TO_SWITCH_ON, "switch on"): S.SWITCHED_ON,
    # Enable operation contains switch on; the drive takes one transition a command.
    (S.READY_TO_SWITCH_ON, "enable operation"): S.SWITCHED_ON,
    (S.READY_TO_SWITCH_ON, "quick stop"): S.SWITCH_ON_DISABLED,
    (S.READY_TO_SWITCH_ON, "disable voltage"): S.SWITCH_ON_DISABLED,
    (S.SWITCHED_ON, "enable operation"): S.OPERATION_ENABLED,
    (S.SWITCHED_ON, "shutdown"): S.READY_TO_SWITCH_ON,
    (S.SWITCHED_ON, "quick stop"): S.SWITCH_ON_DISABLED,
    (S.SWITCHED_ON, "disable voltage"): S.SWITCH_ON_DISABLED,
    (S.OPERATION_ENABLED, "switch on"): S.SWITCHED_ON,
    (S.OPERATION_ENABLED, "shutdown"): S.READY_TO_SWITCH_ON,
    (S.OPERATION_ENABLED, "quick stop"): S.QUICK_STOP_ACTIVE,
    (S.OPERATION_ENABLED, "disable voltage"): S.SWITCH_ON_DISABLED,
    (S.QUICK_STOP_ACTIVE, "disable voltage"): S.SWITCH_ON_DISABLED,
}


@pytest.mark.parametrize("state", list(DriveState))
def test_every_controlword_leads_where_the_figure_says(state: DriveState) -> None:
    for word in range(256):
        drive = stage(state)
        expected = TRANSITIONS.get((state, command_of(word)), state)
        reset = state is S.FAULT and word >= 0x80
        if reset:
            expected = S.SWITCH_ON_DISABLED
        assert drive.command(word, cause_gone=True) is reset
        assert drive.state is expected, f"{word:02X}h"


@pytest.mark.parametrize("option", range(9))
def test_quick_stop_is_left_only_where_605a_says_so(option: int) -> None:
    drive = stage(S.QUICK_STOP_ACTIVE, _605A=option)
    drive.command(0x0F, cause_gone=True)
    assert drive.state is (S.OPERATION_ENABLED if option >= 5 else S.QUICK_STOP_ACTIVE)


@pytest.mark.parametrize(
    ("option", "stop", "after"),
    [
        (0, None, S.SWITCH_ON_DISABLED),
        (1, 1, S.SWITCH_ON_DISABLED),
        (2, 2, S.SWITCH_ON_DISABLED),
        (3, 3, S.SWITCH_ON_DISABLED),
        (4, 4, S.SWITCH_ON_DISABLED),
        (5, 1, S.QUICK_STOP_ACTIVE),
        (6, 2, S.QUICK_STOP_ACTIVE),
        (7, 3, S.QUICK_STOP_ACTIVE),
        (8, 4, S.QUICK_STOP_ACTIVE),
    ],
)
def test_the_quick_stop_of_605a(option: int, stop: int | None, after: DriveState) -> None:
    for state in DriveState:
        drive = stage(state, _605A=option)
        drive.quick_stop()
        if state is not S.OPERATION_ENABLED:
            assert (drive.state, drive.stopping) == (state, None)
            continue
        assert drive.stopping == stop
        assert drive.state is (S.SWITCH_ON_DISABLED if option == 0 else S.QUICK_STOP_ACTIVE)
        drive.stopped()
        assert drive.state is after
        # The end of a ramp is told once.
        drive.state = S.SWITCHED_ON
        drive.stopped()
        assert drive.state is S.SWITCHED_ON


@pytest.mark.parametrize(
    ("index", "word", "after"),
    [("_605B", 0x06, S.READY_TO_SWITCH_ON), ("_605C", 0x07, S.SWITCHED_ON)],
)
def test_shutdown_and_disable_brake_first_where_their_option_says(
    index: str, word: int, after: DriveState
) -> None:
    for option in (-1, 0):
        drive = stage(S.OPERATION_ENABLED, **{index: option})
        drive.command(word, cause_gone=True)
        assert (drive.state, drive.stopping) == (after, None)
    drive = stage(S.OPERATION_ENABLED, **{index: 1})
    drive.command(word, cause_gone=True)
    assert (drive.state, drive.stopping) == (S.OPERATION_ENABLED, 1)
    # To be enabled again calls the stop off.
    drive.command(0x0F, cause_gone=True)
    assert drive.stopping is None
    drive.stopped()
    assert drive.state is S.OPERATION_ENABLED
    drive.command(word, cause_gone=True)
    drive.stopped()
    assert drive.state is after


@pytest.mark.parametrize(("state", "option"), list(itertools.product(DriveState, (0, 1, 2))))
def test_a_fault_brakes_what_moves_and_ends_in_fault(state: DriveState, option: int) -> None:
    drive = stage(state, _605E=option)
    drive.fault()
    if state in (S.FAULT, S.FAULT_REACTION_ACTIVE):
        assert (drive.state, drive.stopping) == (state, None)
    elif state in POWERED and option:
        assert (drive.state, drive.stopping) == (S.FAULT_REACTION_ACTIVE, option)
        drive.stopped()
        assert drive.state is S.FAULT
    else:
        assert (drive.state, drive.stopping) == (S.FAULT, None)


def test_a_fault_is_reset_by_an_edge_of_bit_7_once_its_cause_has_gone() -> None:
    for words, gone, reset in (
        ((0x00, 0x80), True, True),
        ((0x00, 0x8F), True, True),
        ((0x00, 0x80), False, False),
        ((0x80, 0x80), True, False),
        ((0x00, 0x0F), True, False),
    ):
        drive = stage(S.SWITCHED_ON)
        drive.command(words[0], cause_gone=True)
        drive.state = S.FAULT
        assert drive.command(words[1], cause_gone=gone) is reset
        assert drive.state is (S.SWITCH_ON_DISABLED if reset else S.FAULT)


@pytest.mark.parametrize("state", list(DriveState))
def test_a_lost_connection_acts_as_6007_says(state: DriveState) -> None:
    silent = (S.FAULT, S.FAULT_REACTION_ACTIVE, S.NOT_READY_TO_SWITCH_ON)
    braking = S.FAULT_REACTION_ACTIVE if state in POWERED else S.FAULT
    quick = S.QUICK_STOP_ACTIVE if state is S.OPERATION_ENABLED else state
    expected = {
        0: state,
        1: state if state in silent[:2] else braking,
        2: state if state in silent else S.SWITCH_ON_DISABLED,
        3: quick,
        4: state,
    }
    for option, after in expected.items():
        drive = stage(state, _6007=option)
        drive.connection_lost()
        assert drive.state is after, option


def test_a_drive_starts_not_ready_and_its_boot_disables_it() -> None:
    drive = PowerStage({})
    assert drive.state is S.NOT_READY_TO_SWITCH_ON
    assert drive.stopping is None
    drive.stopped()
    assert drive.state is S.NOT_READY_TO_SWITCH_ON
    drive.boot()
    assert drive.state is S.SWITCH_ON_DISABLED
