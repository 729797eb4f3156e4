"""States of the foot and the first action from roles and lateness, whatever controller ran."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from metrics_runs import Hop, clock, guest, manifest, recording

from legbench.control.jump_rules import JumpPhase
from legbench.kinematics import modal_to_joint
from legbench.metrics import summarise
from legbench.metrics.analysis import Analysis
from legbench.metrics.roles import FLIGHT, STANCE, UNKNOWN, foot_states
from legbench.phases import Counting, PhaseInfo, Role
from legbench.recording.format_1 import built_in
from legbench.recording.reader import Recording
from legbench.signals import Floats, Ints

LATE = 0.05
JUMP = built_in("jump", {"touchdown_time": LATE}).phases


def of_the_jump(phase: Ints, time: Floats) -> Ints:
    """States as they are defined for the jump by name: the independent path."""
    names = {JumpPhase.COMPRESS: STANCE, JumpPhase.PUSH: STANCE, JumpPhase.FLIGHT: FLIGHT}
    names[JumpPhase.RELEASE] = FLIGHT
    states = [names.get(JumpPhase(value), UNKNOWN) for value in phase]
    for row in range(1, len(phase)):
        if (phase[row - 1], phase[row]) == (JumpPhase.FLIGHT, JumpPhase.COMPRESS):
            for earlier in range(row):
                if time[earlier] >= time[row] - LATE and phase[earlier] == JumpPhase.FLIGHT:
                    states[earlier] = STANCE
    return np.array(states)


@given(
    lengths=st.lists(st.integers(1, 90), min_size=1, max_size=14),
    first=st.integers(0, 4),
)
def test_roles_and_lateness_give_the_states_of_the_jump(lengths: list[int], first: int) -> None:
    order = [JumpPhase.PUSH, JumpPhase.RELEASE, JumpPhase.FLIGHT, JumpPhase.COMPRESS]
    names = [order[(first + place) % 4] for place in range(len(lengths))]
    if first == 4:
        names[0] = JumpPhase.REST
    phase, time = np.repeat(names, lengths).astype(np.int64), clock(sum(lengths))
    np.testing.assert_array_equal(foot_states(phase, time, JUMP), of_the_jump(phase, time))


def test_a_late_phase_reaches_back_into_the_phase_before_it_alone() -> None:
    phases = (
        PhaseInfo(code=1, name="fall", role=Role.FLIGHT),
        PhaseInfo(code=2, name="stand", role=Role.STANCE),
        PhaseInfo(code=3, name="rise", role=Role.FLIGHT, late=0.02),
    )
    phase = np.repeat([1, 2, 3], [100, 10, 30])
    states = foot_states(phase, clock(140), phases)
    np.testing.assert_array_equal(states, [FLIGHT] * 100 + [FLIGHT] * 10 + [FLIGHT] * 30)
    phase = np.repeat([1, 2, 3], [100, 50, 30])
    states = foot_states(phase, clock(180), phases)
    assert np.flatnonzero(states == STANCE).tolist() == list(range(100, 130))


def test_a_phase_that_nobody_declared_says_nothing_of_the_foot_and_is_no_rest() -> None:
    run = guest(np.array([0, 0, 9, -1, 127]), ())
    assert Analysis(run).states.tolist() == [UNKNOWN] * 5
    rest = (PhaseInfo(code=0, name="wait", role=Role.REST),)
    assert Analysis(guest(np.array([0, 0, 9, -1, 127]), rest)).first_action == 2


def swinging(
    phases: tuple[PhaseInfo, ...], phase: Ints, counting: Counting | None = None
) -> Recording:
    """A leg in a fixed setup that oscillates at 4 Hz from 0.1 s on, under a guest."""
    time = clock(3000)
    since = np.maximum(time - 0.1, 0.0)
    angle = 8.0 * np.pi * since
    still = np.zeros_like(time)
    z2, rate = 0.2 * (1.0 - np.cos(angle)), 0.2 * 8.0 * np.pi * np.sin(angle)
    motor = np.where(time[:, None] < 0.1, [-0.7, 0.7], [-0.8, 0.8])
    return guest(
        phase,
        phases,
        counting or Counting(),
        setup={"kind": "hfts"},
        signals={
            "joint_pos": modal_to_joint(np.stack([still, 1.0 + z2], axis=-1)),
            "joint_vel": modal_to_joint(np.stack([still, rate], axis=-1)),
            "command_pos": motor,
            "motor_pos": motor,
        },
    )


def test_a_guest_that_only_holds_is_rated_from_its_first_command_on() -> None:
    rest = (PhaseInfo(code=0, name="rest", role=Role.REST),)
    run = swinging(rest, np.zeros(3000, dtype=np.int64))
    seen = summarise(run)
    assert Analysis(run).first_action == 100
    np.testing.assert_allclose(seen.periods, 0.25, atol=1e-4)
    assert len(seen.rating_periods) == 11
    assert len(seen.warnings) == 1
    assert "names no phase but rest: it is taken to act from 0.1 s on" in seen.warnings[0]


def test_a_guest_that_only_acts_is_rated_without_a_word() -> None:
    acting = (PhaseInfo(code=5, name="sine", role=Role.ACTING),)
    seen = summarise(swinging(acting, np.full(3000, 5)))
    assert len(seen.rating_periods) == 11
    assert seen.warnings == []


@pytest.mark.parametrize(
    ("counting", "count"), [(Counting(most=3), 3), (Counting(smallest=0.3), 0)]
)
def test_a_guest_says_which_periods_count(counting: Counting, count: int) -> None:
    acting = (PhaseInfo(code=5, name="sine", role=Role.ACTING),)
    seen = summarise(swinging(acting, np.full(3000, 5), counting))
    assert len(seen.rating_periods) == count
    assert bool(seen.warnings) is (count == 0)


def test_a_limit_of_zero_is_no_reason_why_nothing_was_rated() -> None:
    acting = (PhaseInfo(code=5, name="sine", role=Role.ACTING),)
    run = swinging(acting, np.full(3000, 5), Counting())
    short = {name: values[:200] for name, values in run.columns.items()}
    (told,) = summarise(replace(run, columns=short, time=run.time[:200])).warnings
    assert told.endswith("did not turn back and forth once after the first control action")
    (told,) = summarise(swinging(acting, np.full(3000, 5), Counting(smallest=0.3))).warnings
    assert told.endswith(", or by less than the 0.3 rad that count")


def test_a_run_in_which_nothing_is_commanded_says_so() -> None:
    run = recording(clock(50), manifest(setup={"kind": "hfts"}))
    told = summarise(run).warnings
    assert told[0].startswith("no control action: all 50 rows are at rest")
    assert told[1].startswith("nothing was rated")


def test_a_real_hop_of_a_guest_without_roles_says_why_it_has_no_gait() -> None:
    hop = Hop()
    real = hop.real()
    acting = (PhaseInfo(code=1, name="sine", role=Role.ACTING),)
    run = guest(np.ones(len(real.time), dtype=np.int64), acting, like=real)
    (told,) = summarise(run).warnings
    assert told.startswith("no stance and no flight is known: the run has no truth")
    simulated = guest(np.ones(len(real.time), dtype=np.int64), acting, like=hop.recording())
    seen = summarise(simulated)
    assert seen.jumps > 0
    # The hop in closed form keeps no account of its energy: all that it is told is that.
    assert [told for told in seen.warnings if not told.startswith("the numerics")] == []


def test_signals_are_read_once(monkeypatch: pytest.MonkeyPatch) -> None:
    reads: list[str] = []
    whole = Recording.__getitem__

    def counted(run: Recording, name: str) -> np.ndarray:
        reads.append(name)
        return whole(run, name)

    monkeypatch.setattr(Recording, "__getitem__", counted)
    for run in (Hop().recording(), swinging((), np.full(3000, 5))):
        reads.clear()
        summarise(run)
        assert sorted(reads) == sorted(set(reads))
