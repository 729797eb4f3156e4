"""Random sequences of faults on the emulated leg, and whether what they must not do is noticed."""

import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest
from sequence_draw import (
    Interrupt,
    Sequence,
    Strike,
    describe,
    draw,
    name_of,
)
from sequence_judge import judge
from sequence_trial import Seen, play

from legbench.drives.emulated.faults import (
    FrameFault,
    FrameFaultKind,
    NodeFault,
    NodeFaultKind,
)
from legbench.drives.emulated.power import PowerStage
from legbench.drives.master.link_end import LinkEnd
from legbench.drives.master.stop_report import StopReport
from legbench.limits.guard import Guard

SCRIPT = Path(__file__).parents[2] / "scripts" / "fault_sequences.py"
MS = 1_000_000
SCHEDULES = {
    ("jump", True): {
        "open": (0, 300 * MS),
        "start": (300 * MS, 370 * MS),
        "run": (370 * MS, 620 * MS),
        "rest": (620 * MS, 900 * MS),
        "stop": (900 * MS, 907 * MS),
    }
}
HOT = NodeFault(kind=NodeFaultKind.OVER_TEMPERATURE, node_id=2, start_ns=450 * MS)
"""In the run."""


def sequence(*strikes: Strike, controller: str = "position-jump") -> Sequence:
    return Sequence(number=0, controller=controller, rests=False, strikes=strikes)


def ended(
    status: str, cause: str | None = None, message: str | None = "what it was", **more: object
) -> Seen:
    """A run of 200 rows whose drives have been stopped after 500 ms, and had no power 10 ms on."""
    seen = Seen(
        status=status,
        cause=cause,
        message=message,
        marks=[(0, "open"), (300 * MS, "start"), (370 * MS, "run"), (500 * MS, "stop")],
        rows=200,
        power_ns=510 * MS,
        lost_ns=[511 * MS, 511 * MS],
        powered=(False, False),
        left=(False, False),
        ended_ns=600 * MS,
    )
    for name, value in more.items():
        setattr(seen, name, value)
    return seen


def test_random_sequences_of_faults_end_safe_and_say_why() -> None:
    few = ["--sequences", "2", "--seed", "3", "--controllers", "bang-bang"]
    command = [sys.executable, "-W", "error", str(SCRIPT), *few]
    done = subprocess.run(command, capture_output=True, text=True, timeout=300, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "2 sequences, 0 violations" in done.stdout


def test_sequences_hold_every_fault_in_every_phase_one_to_three_at_a_time() -> None:
    drawn = [draw(number, 0, SCHEDULES) for number in range(1500)]
    assert drawn == [draw(number, 0, SCHEDULES) for number in range(1500)]
    assert drawn[:9] != [draw(number, 1, SCHEDULES) for number in range(9)]
    assert {len(each.strikes) for each in drawn} == {1, 2, 3}
    strikes = [strike for each in drawn for strike in each.strikes]
    kinds = {kind.value for kind in NodeFaultKind} | {
        f"frames {kind.value}" for kind in FrameFaultKind
    }
    for begin_ns, end_ns in SCHEDULES["jump", True].values():
        inside = {name_of(one) for one in strikes if begin_ns <= one.start_ns < end_ns}
        assert inside == kinds | {"babbling node", "^C"}


def test_a_sequence_in_words_says_what_strikes_where_and_for_how_long() -> None:
    cut = FrameFault(
        kind=FrameFaultKind.WRONG_LENGTH,
        cob_id=0x181,
        start_ns=400 * MS,
        end_ns=402 * MS,
        length=3,
    )
    words = describe(sequence(cut, Interrupt(start_ns=405 * MS), HOT))
    assert words == (
        "sequence 0, position-jump, end stop: frames wrong length at 400.0 ms for 2.0 ms, 181h, "
        "delay 0.00 ms, length 3; ^C at 405.0 ms; over-temperature at 450.0 ms, node 2, size 0"
    )


@pytest.mark.parametrize(
    "seen",
    [
        ended("fault", "drive emergency"),
        ended("complete", message=None),
        ended("refused", "DriveError"),
        ended("fault", "drive emergency", left=(True, False)),
    ],
    ids=["named", "bridged", "refused", "told of power"],
)
def test_an_end_as_it_should_be_is_no_violation(seen: Seen) -> None:
    assert judge(sequence(HOT), seen) == []


@pytest.mark.parametrize(
    ("seen", "said"),
    [
        (ended("fault", "sway"), "over-temperature was called 'sway': what it was"),
        (ended("fault", "drive emergency", ""), "told in ''"),
        (ended("fault", "drive emergency", "two\nlines"), "told in 'two\\nlines'"),
        (ended("interrupted", None), "interrupted by nobody"),
        (ended("complete", None, None, rows=199), "complete with 199 rows"),
        (ended("complete", "sway", None), "complete with 200 rows"),
        (
            ended("complete", None, None, lost_ns=[490 * MS]),
            "complete, though a drive had lost its power",
        ),
        (
            ended("complete", None, None, left=(False, True)),
            "power at the end of a run that is complete",
        ),
        (
            ended("fault", "drive emergency", power_ns=551 * MS),
            "power 51 ms after the stop began",
        ),
        (
            ended("fault", "drive emergency", powered=(True, False)),
            "power in the end: (True, False)",
        ),
        (ended("refused", "DriveError", marks=[(0, "open")]), "there was power, and no stop"),
    ],
)
def test_what_must_not_be_is_named(seen: Seen, said: str) -> None:
    assert judge(sequence(HOT), seen) == [said]


def test_a_fault_that_comes_after_the_stop_has_begun_is_no_cause() -> None:
    late = NodeFault(kind=NodeFaultKind.LINK_STEP, node_id=1, start_ns=501 * MS)
    assert judge(sequence(late), ended("fault", "sway")) == [
        "nothing was called 'sway': what it was"
    ]
    assert judge(sequence(late), ended("refused", "DriveError")) == ["refused for nothing"]


def test_a_stop_may_fail_of_what_strikes_while_it_lasts() -> None:
    late = NodeFault(kind=NodeFaultKind.SILENT, node_id=1, start_ns=501 * MS)
    assert judge(sequence(late), ended("fault", "stop failed")) == []
    later = NodeFault(kind=NodeFaultKind.SILENT, node_id=1, start_ns=601 * MS)
    assert judge(sequence(later), ended("fault", "stop failed")) == [
        "nothing was called 'stop failed': what it was"
    ]


def test_a_drive_that_does_not_hear_its_master_has_longer() -> None:
    away = NodeFault(kind=NodeFaultKind.SILENT, node_id=1, start_ns=495 * MS)
    seen = ended("fault", "process data lost", power_ns=649 * MS)
    assert judge(sequence(away), seen) == []
    seen.power_ns = 651 * MS
    assert judge(sequence(away), seen) == ["power 151 ms after the stop began"]


def never_stops(patch: pytest.MonkeyPatch) -> None:
    """Drives that no loss of their master stops, and a master that does not stop them."""
    patch.setattr(LinkEnd, "_stop", lambda end, _: setattr(end._status, "stopped", StopReport()))
    patch.setattr(PowerStage, "connection_lost", lambda _stage: None)


def slews_nothing(patch: pytest.MonkeyPatch) -> None:
    """Limits that let a command through as it is wished."""
    command = Guard.command

    def unslewed(guard: Guard, motor_pos: tuple[float, ...]) -> tuple[float, ...]:
        command(guard, motor_pos)
        return tuple(float(value) for value in motor_pos)

    patch.setattr(Guard, "command", unslewed)


HEALTHY = sequence(controller="position-jump")


def test_a_run_that_nothing_strikes_is_no_violation() -> None:
    assert judge(HEALTHY, play(HEALTHY)) == []


@pytest.mark.parametrize(
    ("spoil", "said"),
    [(never_stops, "there was power, and no stop"), (slews_nothing, "rad beyond its limits")],
)
def test_a_run_that_is_not_safe_is_noticed(
    spoil: Callable[[pytest.MonkeyPatch], None], said: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    spoil(monkeypatch)
    assert any(said in text for text in judge(HEALTHY, play(HEALTHY)))
