"""Figures whose jumps are not all alike, and foot tips that move below the hip."""

import numpy as np
import pytest
from metrics_runs import PROTOTYPE, Hop, truncated

from legbench.kinematics import leg_points
from legbench.metrics.analysis import Analysis
from legbench.metrics.jump import JumpFigures, jump_figures
from legbench.recording.reader import Recording


def figures(run: Recording, action: int = 0, settle: float = 0.0) -> JumpFigures:
    return jump_figures(run, Analysis(run).gait, action, settle=settle)


def index_of_hop(hop: Hop) -> np.ndarray:
    """Number of the stance or of the flight after it, in every row."""
    return np.floor((hop.signals()["time"] + 0.5 * hop.stance) / hop.cycle).astype(int)


def test_foot_travel_in_the_hip_is_that_of_the_forward_kinematics() -> None:
    hop = Hop()
    signals = hop.signals()
    index = index_of_hop(hop)
    # Each flight swings the leg by its own angle; the widest is not the last.
    swing = 0.05 * (1 + index % 3) * np.sin(90.0 * signals["time"])
    joint_pos = signals["joint_pos"] + swing[:, None]
    run = hop.recording(joint_pos=joint_pos)
    foot = leg_points(joint_pos, PROTOTYPE.lengths)[:, 3, 0]
    gait = Analysis(run).gait
    flown = gait.jumps.flight[-3:]
    ranges = [np.ptp(foot[gait.flight.first[f] : gait.flight.stop[f]]) for f in flown]
    assert max(ranges) > 1.2 * ranges[-1]
    assert figures(run).foot_travel_in_hip == pytest.approx(max(ranges), abs=1e-12)


def test_a_rise_is_measured_from_the_lower_of_both_lower_apexes() -> None:
    hop = Hop()
    trunk = hop.signals()["trunk_pos"].copy()
    contact = hop.signals()["contact"]
    for deeper in (1, 2, 3, 4):
        sunk = trunk.copy()
        sunk[contact & (index_of_hop(hop) == deeper), 1] -= 0.01
        seen = figures(hop.recording(trunk_pos=sunk))
        assert seen.trunk_excursion == pytest.approx(hop.rise + hop.dip + 0.01, abs=1e-6)


@pytest.mark.parametrize("hops", [2.1, 3.1, 4.1, 6.1])
def test_a_figure_is_of_the_last_three_jumps_or_of_all_there_are(hops: float) -> None:
    """The fourth jump from the end is higher, wider and further than those after it."""
    hop = Hop(hops=hops)
    signals = hop.signals()
    index = index_of_hop(hop)
    jumps = int(hops) - 2
    earlier = index <= jumps - 3
    trunk, foot = signals["trunk_pos"].copy(), signals["foot_pos"].copy()
    flown = earlier & ~signals["contact"]
    trunk[flown, 1] += 0.2
    foot[flown, 1] *= 2.0
    foot[flown, 0] *= 3.0
    seen = figures(hop.recording(trunk_pos=trunk, foot_pos=foot))
    assert seen.count == jumps
    if jumps:
        assert seen.trunk_excursion == pytest.approx(hop.rise + hop.dip, abs=1e-6)
        assert seen.foot_clearance == pytest.approx(hop.tuck * hop.rise, abs=1e-5)
        assert seen.drift == pytest.approx(min(jumps, 3) * hop.travel * hop.cycle, abs=1e-4)
        assert seen.foot_travel == pytest.approx(hop.travel * hop.flight, abs=1e-4)


def test_the_hop_may_grow_for_a_second_after_the_first_action() -> None:
    hop = Hop(hops=9.1)
    run = hop.recording()
    starts = Analysis(run).gait.jumps.start
    for action in (0, 100, 700):
        seen = jump_figures(run, Analysis(run).gait, action)
        assert seen.first == np.count_nonzero(starts < run.time[action] + 1.0) > 0
    never = jump_figures(run, Analysis(run).gait, len(run.time))
    assert never.first == never.count == 7
    assert np.isnan([never.hop_freq, never.flight_time, never.apex_change]).all()
    assert never.foot_clearance == pytest.approx(hop.tuck * hop.rise, abs=1e-5)
    last = jump_figures(run, Analysis(run).gait, len(run.time) - 1, settle=-0.2)
    assert last.first == 7


def test_limit_cycle_figures_are_of_the_jumps_from_the_first_on() -> None:
    """Flights and stances of their own lengths, so that each jump has its own period."""
    hop = Hop(hops=7.1)
    run = hop.recording()
    gait = Analysis(run).gait
    stretched = np.cumsum(0.001 * (1.0 + 0.1 * index_of_hop(hop)))
    slower = hop.recording(time=stretched)
    seen = figures(slower, settle=float(gait.jumps.start[2] - run.time[0]) * 1.3)
    jumps = Analysis(slower).gait.jumps
    assert 0 < seen.first < seen.count
    periods = (jumps.end - jumps.start)[seen.first :]
    assert np.ptp(periods) > 0.03
    assert seen.hop_freq == pytest.approx(1.0 / np.mean(periods), rel=1e-12)
    flights = Analysis(slower).gait.flight
    stances = Analysis(slower).gait.stance
    wanted = (flights.end - flights.start)[jumps.flight[seen.first :]]
    assert seen.flight_time == pytest.approx(np.mean(wanted), rel=1e-12)
    wanted = (stances.end - stances.start)[jumps.takeoff[seen.first :]]
    assert seen.stance_time == pytest.approx(np.mean(wanted), rel=1e-12)


def test_one_jump_changes_no_apex() -> None:
    hop = Hop(hops=3.1)
    seen = figures(hop.recording())
    assert seen.count == 1
    assert np.isnan(seen.apex_change)
    assert seen.hop_freq == pytest.approx(1.0 / hop.cycle, rel=1e-4)
    assert figures(truncated(hop.recording(), slice(0, 200))).count == 0
