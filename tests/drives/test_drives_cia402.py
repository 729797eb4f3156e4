import itertools
from collections import Counter

import pytest

from legbench.drives.emulated.power import PowerStage
from legbench.drives.protocol.cia402 import (
    HOLD_CYCLES,
    PATTERNS,
    RESET_PATIENCE,
    Controlword,
    DriveState,
    Goal,
    PowerMachine,
    Way,
    decode_state,
    describe_statusword,
    next_controlword,
)

BITS_OF_STATE = 0b0110_1111


def test_every_statusword_matches_at_most_one_pattern_and_decodes_to_it() -> None:
    seen: Counter[DriveState | None] = Counter()
    for statusword in range(1 << 16):
        fits = [state for mask, value, state in PATTERNS if statusword & mask == value]
        assert len(fits) <= 1
        state = decode_state(statusword)
        assert state is (fits[0] if fits else None)
        assert describe_statusword(statusword).startswith(f"{statusword:04X}h: ")
        seen[state] += 1
    # Bits 4 and 7 to 15 are free, bit 5 as well in the four masks 4Fh.
    free = 1 << 10
    for mask, _, state in PATTERNS:
        assert seen[state] == free * (2 if mask == 0x4F else 1)
    assert sum(seen.values()) == 1 << 16


def test_states_depend_on_their_bits_alone() -> None:
    for low, rest in itertools.product(range(256), (0x0000, 0xFF00, 0x5500)):
        assert decode_state(low | rest) is decode_state(low)
        assert decode_state(low) is decode_state(low & BITS_OF_STATE)


STAGE_WORDS = {
    state: stage_word
    for state, stage_word in (
        (DriveState.NOT_READY_TO_SWITCH_ON, 0x00),
        (DriveState.SWITCH_ON_DISABLED, 0x40),
        (DriveState.READY_TO_SWITCH_ON, 0x31),
        (DriveState.SWITCHED_ON, 0x33),
        (DriveState.OPERATION_ENABLED, 0x37),
        (DriveState.QUICK_STOP_ACTIVE, 0x17),
        (DriveState.FAULT_REACTION_ACTIVE, 0x1F),
        (DriveState.FAULT, 0x08),
    )
}
REACHED = {
    Goal.DISABLED: {DriveState.SWITCH_ON_DISABLED},
    Goal.READY: {DriveState.READY_TO_SWITCH_ON},
    Goal.SWITCHED_ON: {DriveState.SWITCHED_ON},
    Goal.ENABLED: {DriveState.OPERATION_ENABLED},
    Goal.QUICK_STOP: {
        DriveState.QUICK_STOP_ACTIVE,
        DriveState.SWITCH_ON_DISABLED,
        DriveState.NOT_READY_TO_SWITCH_ON,
        DriveState.FAULT,
    },
    Goal.FAULT_RESET: {DriveState.SWITCH_ON_DISABLED},
}


def stage(state: DriveState, quick_stop_option: int) -> PowerStage:
    """The other side: a drive in a state."""
    options = {0x605A: quick_stop_option, 0x605B: 0, 0x605C: 0, 0x605E: 2}
    drive = PowerStage({(index, 0): value for index, value in options.items()})
    drive.state = state
    return drive


@pytest.mark.parametrize("quick_stop_option", [0, 2, 6])
@pytest.mark.parametrize("goal", list(Goal))
@pytest.mark.parametrize("start", list(DriveState))
def test_every_goal_is_reached_or_refused_from_every_state(
    start: DriveState, goal: Goal, quick_stop_option: int
) -> None:
    drive, machine = stage(start, quick_stop_option), PowerMachine()
    machine.seek(goal)
    way = Way.MOVING
    for cycle in range(RESET_PATIENCE + 20):
        step = machine.step(STAGE_WORDS[drive.state])
        way = step.way
        if way is not Way.MOVING:
            break
        if drive.state is DriveState.NOT_READY_TO_SWITCH_ON and cycle == 3:
            drive.boot()
        if drive.state is DriveState.FAULT_REACTION_ACTIVE and cycle == 3:
            drive.state = DriveState.FAULT
        drive.command(step.controlword, cause_gone=True)
    assert way in (Way.REACHED, Way.REFUSED)
    if way is Way.REACHED:
        assert drive.state in REACHED[goal]
        for _ in range(5):
            drive.command(machine.step(STAGE_WORDS[drive.state]).controlword, cause_gone=True)
        assert drive.state in REACHED[goal]
    else:
        assert goal is not Goal.QUICK_STOP
        faulty = drive.state in (DriveState.FAULT, DriveState.FAULT_REACTION_ACTIVE)
        stopped = drive.state is DriveState.QUICK_STOP_ACTIVE
        assert faulty or stopped or goal is Goal.FAULT_RESET


def test_no_step_leads_from_quick_stop_or_fault_to_enabled() -> None:
    for state in (
        DriveState.QUICK_STOP_ACTIVE,
        DriveState.FAULT,
        DriveState.FAULT_REACTION_ACTIVE,
    ):
        controlword, way = next_controlword(state, Goal.ENABLED)
        assert way is Way.REFUSED
        assert controlword != Controlword.ENABLE_OPERATION


def test_a_drive_that_left_operation_enabled_is_not_led_back() -> None:
    machine = PowerMachine()
    machine.seek(Goal.ENABLED)
    for statusword in (0x40, 0x40, 0x31, 0x31, 0x33, 0x33, 0x37, 0x37):
        machine.step(statusword)
    assert machine.step(0x37).way is Way.REACHED
    for statusword in (0x17, 0x40, 0x31, 0x33, 0x37, 0x40) * 5:
        step = machine.step(statusword)
        assert step.way is Way.REFUSED
        assert step.controlword == (0x02 if statusword == 0x17 and step.controlword else 0x00)
    assert machine.lost
    assert machine.goal is Goal.DISABLED


def test_a_statusword_is_settled_once_its_goal_is_reached_and_its_controlword_was_held() -> None:
    machine = PowerMachine()
    machine.seek(Goal.ENABLED)
    for statusword in (0x40, 0x40, 0x31, 0x31, 0x33, 0x33):
        machine.step(statusword)
        assert machine.settled is None
    seen = [machine.settled for _ in range(4) if machine.step(0x1237)]
    assert seen[-1] == 0x1237
    assert all(word in (None, 0x1237) for word in seen)
    # Another word with the same state is settled as itself; another state is none.
    machine.step(0x0237)
    assert machine.settled == 0x0237
    machine.step(0x17)
    assert machine.settled is None
    # A word that was settled under one goal is not under the next one.
    again = PowerMachine()
    for _ in range(4):
        again.step(0x40)
    assert again.settled == 0x40
    again.seek(Goal.ENABLED)
    assert again.settled is None


def test_controlwords_on_the_way_up_stand_at_least_two_cycles() -> None:
    machine = PowerMachine()
    machine.seek(Goal.ENABLED)
    words = [machine.step(0x40).controlword for _ in range(4)]
    words += [machine.step(0x31).controlword for _ in range(4)]
    words += [machine.step(0x33).controlword for _ in range(1)]
    words += [machine.step(0x37).controlword for _ in range(4)]
    runs = [(word, len(list(group))) for word, group in itertools.groupby(words)]
    assert [word for word, _ in runs] == [0x06, 0x07, 0x0F]
    assert all(length >= HOLD_CYCLES for _, length in runs)


def test_fault_reset_is_one_edge_of_two_cycles_a_request() -> None:
    machine = PowerMachine()
    machine.seek(Goal.FAULT_RESET)
    steps = [machine.step(0x08) for _ in range(RESET_PATIENCE + 20)]
    words = [step.controlword for step in steps]
    runs = [(word, len(list(group))) for word, group in itertools.groupby(words)]
    assert [word for word, _ in runs] == [0x00, 0x80, 0x00]
    assert runs[0][1] >= 2
    assert runs[1][1] == 2
    assert steps[-1].way is Way.REFUSED
    machine.seek(Goal.FAULT_RESET)
    assert 0x80 in [machine.step(0x08).controlword for _ in range(6)]


@pytest.mark.parametrize("gone", [0, 1, 30])
def test_a_fault_that_comes_back_is_waited_for_as_long_as_one_that_stays(gone: int) -> None:
    machine = PowerMachine()
    machine.seek(Goal.FAULT_RESET)
    words = [machine.step(0x08).controlword]
    while words[-2:] != [0x80, 0x00]:
        words.append(machine.step(0x08).controlword)
    ways = [machine.step(0x40).way for _ in range(gone)]
    assert ways == [Way.REACHED] * gone
    ways += [machine.step(0x08).way for _ in range(60)]
    # Refused in the 51st cycle after the bit was taken back.
    assert ways.index(Way.REFUSED) == 50
    assert machine.refused


def test_a_drive_that_shows_zeros_after_it_was_enabled_is_lost() -> None:
    machine = PowerMachine()
    assert not machine.refused
    machine.seek(Goal.ENABLED)
    for statusword in (0x40, 0x40, 0x31, 0x31, 0x33, 0x33, 0x37, 0x37):
        step = machine.step(statusword)
    assert step.way is Way.REACHED
    assert machine.step(0x00).way is Way.REFUSED
    assert machine.lost


def test_an_unknown_statusword_changes_nothing() -> None:
    unknown = [word for word in range(256) if decode_state(word) is None]
    assert unknown
    for word in unknown:
        machine = PowerMachine()
        machine.seek(Goal.ENABLED)
        for known in (0x40, 0x40, 0x40):
            before = machine.step(known).controlword
        assert machine.step(word).controlword == before
        assert machine.step(word).state is None


def test_a_stop_is_sent_at_once_even_if_the_state_cannot_be_read() -> None:
    for goal, word in ((Goal.QUICK_STOP, 0x02), (Goal.DISABLED, 0x00)):
        for age in (1, 2, 3):
            machine = PowerMachine()
            machine.seek(Goal.ENABLED)
            assert [machine.step(0x40).controlword for _ in range(age)] == [0x06] * age
            machine.seek(goal)
            assert machine.step(0x01).controlword == word
