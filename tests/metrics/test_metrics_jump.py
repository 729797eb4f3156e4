from dataclasses import asdict

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from metrics_runs import Hop, truncated

from legbench.metrics.analysis import Analysis
from legbench.metrics.jump import JumpFigures, jump_figures
from legbench.recording.reader import Recording


def figures(run: Recording, settle: float = 0.0) -> JumpFigures:
    return jump_figures(run, Analysis(run).gait, Analysis(run).first_action, settle=settle)


@settings(derandomize=True, max_examples=40)
@given(
    st.builds(
        Hop,
        speed=st.floats(0.4, 1.0),
        stance=st.floats(0.08, 0.2),
        tuck=st.floats(1.0, 2.0),
        travel=st.floats(-0.2, 0.2),
        offset=st.floats(0.0, 0.00099),
    )
)
def test_figures_of_a_ballistic_hop_come_out_in_closed_form(hop: Hop) -> None:
    seen = figures(hop.recording())
    assert seen.count == 3
    assert seen.trunk_excursion == pytest.approx(hop.rise + hop.dip, abs=1e-6)
    assert seen.foot_clearance == pytest.approx(hop.tuck * hop.rise, abs=1e-5)
    assert seen.drift == pytest.approx(3.0 * abs(hop.travel) * hop.cycle, abs=0.001)
    assert seen.foot_travel == pytest.approx(abs(hop.travel) * hop.flight, abs=0.0005)
    assert seen.foot_travel_in_hip == pytest.approx(0.0, abs=1e-12)
    assert seen.hop_freq == pytest.approx(1.0 / hop.cycle, rel=1e-4)
    assert seen.flight_time == pytest.approx(hop.flight, abs=4e-5)
    assert seen.stance_time == pytest.approx(hop.stance, abs=4e-5)
    assert seen.apex_change == pytest.approx(0.0, abs=1e-9)
    assert seen.polar_max == pytest.approx(0.0, abs=1e-12)


def test_figures_are_of_the_last_three_jumps_and_the_limit_cycle() -> None:
    hop = Hop(hops=8.1)
    signals = hop.signals()
    early = signals["time"] < 3.2 * hop.cycle
    trunk, foot, joint = (signals[name].copy() for name in ("trunk_pos", "foot_pos", "joint_pos"))
    trunk[early, 1] *= 1.5
    trunk[early, 0] += 1.0
    foot[early, 1] *= 3.0
    joint[early] += 0.2
    leaving = np.mod(signals["time"] - hop.liftoff(0), hop.cycle) > hop.cycle - 0.01
    contact = signals["contact"] & ~(early & leaving)
    run = hop.recording(trunk_pos=trunk, foot_pos=foot, joint_pos=joint, contact=contact)
    seen = figures(run, 3.5 * hop.cycle)
    assert seen.stance_time == pytest.approx(hop.stance, abs=4e-5)
    assert figures(run).stance_time < hop.stance - 0.003
    assert (seen.count, seen.first) == (6, 3)
    assert seen.trunk_excursion == pytest.approx(hop.rise + hop.dip, abs=1e-6)
    assert seen.foot_clearance == pytest.approx(hop.tuck * hop.rise, abs=1e-5)
    assert seen.drift == pytest.approx(3.0 * hop.travel * hop.cycle, abs=1e-4)
    assert seen.polar_max == pytest.approx(0.0, abs=1e-12)
    assert figures(hop.recording(joint_pos=joint)).polar_max == pytest.approx(0.2, abs=1e-12)


@settings(derandomize=True, max_examples=20)
@given(st.floats(0.0, 2.0))
def test_first_is_the_first_jump_after_settling(settle: float) -> None:
    run = Hop().recording()
    jumps = Analysis(run).gait.jumps
    seen = figures(run, settle)
    begins = jumps.start - run.time[0]
    assert np.all(begins[: seen.first] < settle)
    assert np.all(begins[seen.first :] >= settle)


def test_apex_change_is_the_largest_step_between_upper_apexes() -> None:
    hop = Hop(hops=7.1)
    signals = hop.signals()
    trunk = signals["trunk_pos"].copy()
    flights = np.floor((signals["time"] + 0.5 * hop.stance) / hop.cycle)
    lift = np.array([0.0, 0.0, 0.003, 0.003, -0.004, -0.004, 0.0, 0.0])[flights.astype(int)]
    trunk[:, 1] += np.where(signals["contact"], 0.0, lift)
    assert figures(hop.recording(trunk_pos=trunk)).apex_change == pytest.approx(0.007, abs=1e-9)


def test_without_truth_what_the_leg_itself_shows_remains() -> None:
    hop = Hop()
    seen, true = asdict(figures(hop.real())), asdict(figures(hop.recording()))
    unknown = {"trunk_excursion", "foot_clearance", "drift", "foot_travel", "apex_change"}
    assert {name for name, value in seen.items() if np.isnan(value)} == unknown
    for name in seen.keys() - unknown:
        assert seen[name] == pytest.approx(true[name], abs=0.001), name


def test_a_run_without_a_jump_has_no_figures() -> None:
    seen = asdict(figures(truncated(Hop().recording(), slice(0, 300))))
    assert (seen.pop("count"), seen.pop("first")) == (0, 0)
    assert np.isnan(list(seen.values())).all()
