from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from metrics_runs import PERIOD, Hop, clock, truncated

from legbench.control.jump_rules import JumpPhase
from legbench.metrics.analysis import Analysis
from legbench.metrics.stance import loaded_by_contact

HOPS = st.builds(
    Hop,
    speed=st.floats(0.4, 1.0),
    stance=st.floats(0.08, 0.2),
    tuck=st.floats(1.0, 2.0),
    offset=st.floats(0.0, 0.00099),
)


@settings(derandomize=True, max_examples=30)
@given(HOPS)
def test_events_of_a_ballistic_hop_come_out_in_closed_form(hop: Hop) -> None:
    gait = Analysis(hop.recording()).gait
    assert (len(gait.stance), len(gait.flight), len(gait.jumps)) == (4, 5, 3)
    index = np.arange(5)
    liftoff, touchdown = hop.liftoff(0) + index * hop.cycle, hop.touchdown(0) + index * hop.cycle
    # A line is drawn where the foot is on a parabola: off by at most g dt^2 / speed, 25 us.
    np.testing.assert_allclose(gait.flight.start, liftoff, atol=2e-5)
    np.testing.assert_allclose(gait.flight.end, touchdown, atol=2.5e-5)
    np.testing.assert_allclose(gait.flight.apex, hop.upper_apex(0) + index * hop.cycle, atol=1e-9)
    np.testing.assert_allclose(gait.flight.apex_height, hop.height + hop.rise, atol=1e-9)
    np.testing.assert_allclose(
        gait.stance.apex, hop.lower_apex(1) + index[:4] * hop.cycle, atol=1e-5
    )
    np.testing.assert_allclose(gait.stance.apex_height, hop.height - hop.dip, atol=1e-6)


def test_a_jump_is_a_flight_between_two_complete_stances() -> None:
    hop = Hop()
    gait = Analysis(hop.recording()).gait
    jumps = gait.jumps
    np.testing.assert_array_equal(gait.stance.stop[jumps.takeoff], gait.flight.first[jumps.flight])
    np.testing.assert_array_equal(gait.flight.stop[jumps.flight], gait.stance.first[jumps.landing])
    np.testing.assert_allclose(jumps.end - jumps.start, hop.cycle, atol=1e-5)


def test_rows_of_phases_are_those_of_the_contact() -> None:
    run = Hop().recording()
    gait = Analysis(run).gait
    for kind, touching in ((gait.stance, True), (gait.flight, False)):
        for first, stop in zip(kind.first, kind.stop, strict=True):
            assert np.all(run["contact"][first:stop] == touching)
            assert run["contact"][first - 1] != touching
            assert run["contact"][stop] != touching


@settings(derandomize=True, max_examples=30)
@given(st.integers(0, 2**32 - 1))
def test_chattering_contact_changes_no_phase(seed: int) -> None:
    hop = Hop()
    signals = hop.signals()
    contact, clean = signals["contact"].copy(), Analysis(hop.recording()).gait
    chatter = np.random.default_rng(seed)
    for event in np.flatnonzero(np.diff(contact)):
        contact[event - 4 : event + 5] = chatter.random(9) < 0.5
    gait = Analysis(hop.recording(contact=contact)).gait
    for kind in ("stance", "flight"):
        seen, true = getattr(gait, kind), getattr(clean, kind)
        np.testing.assert_allclose(seen.start, true.start, atol=6 * PERIOD)
        np.testing.assert_allclose(seen.end, true.end, atol=6 * PERIOD)
        np.testing.assert_allclose(seen.apex, true.apex, atol=1e-12)


def test_contact_that_begins_while_the_foot_rises_is_no_touchdown() -> None:
    time = clock(400)
    contact = (time < 0.1) | (time >= 0.3)
    foot = np.interp(time, [0.0, 0.1, 0.2, 0.3, 0.4], [0.0, 0.0, 0.05, 0.0, 0.0])
    grazing = contact | ((time >= 0.12) & (time < 0.14))
    hip = np.interp(time, [0.0, 0.05, 0.2, 0.35, 0.4], [0.2, 0.18, 0.25, 0.18, 0.2])
    np.testing.assert_array_equal(loaded_by_contact(time, grazing, foot, hip), contact)
    falling = contact | ((time >= 0.25) & (time < 0.27))
    np.testing.assert_array_equal(
        loaded_by_contact(time, falling, foot, hip), contact | (time >= 0.25)
    )


@pytest.mark.parametrize("landed_ms", [3, 20])
@pytest.mark.parametrize("bounce_ms", [10, 16, 40])
def test_a_foot_that_bounces_has_landed(landed_ms: int, bounce_ms: int) -> None:
    """A foot that is back on the ground before the hip has turned ends no second flight."""
    hop = Hop(stance=0.2)
    clean = Analysis(hop.recording())
    contact, foot = hop.signals()["contact"].copy(), hop.signals()["foot_pos"].copy()
    for touchdown in clean.gait.flight.stop.tolist()[:-1]:
        off = slice(touchdown + landed_ms, touchdown + landed_ms + bounce_ms)
        contact[off], foot[off, 1] = False, 1e-3
    seen = Analysis(hop.recording(contact=contact, foot_pos=foot)).gait
    for kind in ("stance", "flight"):
        np.testing.assert_array_equal(getattr(seen, kind).first, getattr(clean.gait, kind).first)
        np.testing.assert_array_equal(getattr(seen, kind).stop, getattr(clean.gait, kind).stop)
    np.testing.assert_allclose(seen.flight.end, clean.gait.flight.end, atol=1e-12)


def test_a_foot_that_leaves_after_the_lower_apex_flies() -> None:
    """Twenty milliseconds off the ground while the hip rises are a flight, however short."""
    hop = Hop(stance=0.2)
    contact, foot = hop.signals()["contact"].copy(), hop.signals()["foot_pos"].copy()
    stance = Analysis(hop.recording()).gait.stance
    risen = int(stance.first[0]) + 120
    contact[risen : risen + 20] = False
    foot[risen : risen + 20, 1] = np.linspace(2e-3, 1e-4, 20)
    seen = Analysis(hop.recording(contact=contact, foot_pos=foot)).gait
    assert risen in seen.flight.first
    assert len(seen.flight) == 6


def test_without_truth_the_controller_phases_give_the_same_gait() -> None:
    hop = Hop()
    seen, true = Analysis(hop.real()).gait, Analysis(hop.recording()).gait
    for kind in ("stance", "flight"):
        np.testing.assert_array_equal(getattr(seen, kind).first, getattr(true, kind).first)
        np.testing.assert_array_equal(getattr(seen, kind).stop, getattr(true, kind).stop)
        np.testing.assert_allclose(
            getattr(seen, kind).start, getattr(true, kind).start, atol=PERIOD
        )
    np.testing.assert_allclose(seen.stance.apex_height, true.stance.apex_height, atol=1e-12)
    np.testing.assert_allclose(seen.jumps.start, true.jumps.start, atol=1e-12)
    assert np.isnan(seen.flight.apex).all()


def test_a_phase_next_to_rest_may_be_cut_and_does_not_count() -> None:
    hop = Hop()
    signals = hop.signals()
    resting = signals["time"] < hop.touchdown(0) - 0.05
    phase = np.where(resting, JumpPhase.REST, signals["phase"])
    real = hop.real()
    seen = Analysis(replace(real, columns={**real.columns, "phase": phase})).gait
    assert (len(seen.stance), len(seen.flight)) == (4, 4)
    assert seen.flight.start[0] == pytest.approx(hop.liftoff(1), abs=PERIOD)


@pytest.mark.parametrize("rows", [slice(0, 0), slice(0, 1), slice(0, 2), slice(0, 100)])
@pytest.mark.parametrize("real", [False, True])
def test_phases_that_an_end_cuts_do_not_count(rows: slice, real: bool) -> None:
    run = Hop().real() if real else Hop().recording()
    gait = Analysis(truncated(run, rows)).gait
    assert (len(gait.stance), len(gait.flight), len(gait.jumps)) == (0, 0, 0)


@settings(derandomize=True, max_examples=40)
@given(st.integers(0, 1600), st.integers(0, 1600))
def test_cutting_a_run_keeps_the_phases_that_are_left_whole(one: int, other: int) -> None:
    run = Hop().recording()
    low, high = sorted((one, other))
    whole, part = Analysis(run).gait, Analysis(truncated(run, slice(low, high))).gait
    for kind in ("stance", "flight"):
        all_of, left = getattr(whole, kind), getattr(part, kind)
        inside = (all_of.first > low) & (all_of.stop < high)
        assert set(all_of.first[inside] - low) >= set(left.first)
        comfortable = (all_of.first > low + 20) & (all_of.stop < high - 20)
        assert set(all_of.first[comfortable] - low) <= set(left.first)
