"""Which rows, flights and landings of two runs are compared."""

import numpy as np
import pytest
from metrics_runs import Hop, clock, guest, manifest, recording, truncated

from legbench.metrics import compare, differences
from legbench.metrics.compare import first_touchdown
from legbench.phases import PhaseInfo, Role
from legbench.recording.reader import Recording
from legbench.signals import Floats


def turning(time: Floats, speed: float = 1.0) -> Recording:
    """A leg in a fixed setup whose hip turns steadily."""
    joint = np.stack([speed * time, np.zeros_like(time)], axis=-1)
    entries = manifest(setup={"kind": "ffs"}, controller={"kind": "position-jump", "dz2": 0.1})
    return recording(time, entries, joint_pos=joint)


def test_the_rows_in_common_are_those_from_the_later_start_to_the_earlier_end() -> None:
    early, late = turning(clock(100)), turning(clock(100)[40:] + 0.025)
    for runs in ((early, late), (late, early)):
        apart = differences(*runs)
        assert (apart.time[0], apart.time[-1]) == (pytest.approx(0.065), pytest.approx(0.099))
        assert len(apart.time) == 35
        np.testing.assert_allclose(apart.joint, 0.0, atol=1e-12)


def test_runs_that_share_one_instant_have_it_in_common() -> None:
    first, second = turning(clock(51)), turning(clock(101)[50:], speed=2.0)
    seen = compare(first, second)
    assert seen.duration == 0.0
    assert seen.period == 0.0
    assert seen.joint_max == pytest.approx(0.05)


def test_a_period_is_told_to_the_nanosecond() -> None:
    time = np.arange(30.0) / 3000.0
    assert compare(turning(time), turning(time)).period == 0.000333333


def test_a_comparison_says_how_long_and_how_fine_it_is() -> None:
    seen = compare(turning(clock(100)), turning(0.002 * np.arange(30.0)))
    assert seen.period == 0.002
    assert seen.duration == pytest.approx(0.058)


def test_a_run_of_one_row_has_no_period() -> None:
    one = turning(clock(1))
    seen = compare(one, one)
    assert (seen.period, seen.duration, seen.joint_max) == (0.0, 0.0, 0.0)
    # The other's rows are those of the longer period, as one row has none.
    assert differences(one, turning(clock(9))).time.tolist() == [0.0]


@pytest.mark.parametrize("swap", [False, True])
def test_flights_are_matched_until_they_part_whichever_run_lags(swap: bool) -> None:
    short, long = Hop(hops=9.0), Hop(hops=9.0, stance=0.19)
    runs = [short.recording(), long.recording()]
    overlapping = [index for index in range(8) if long.liftoff(index) < short.touchdown(index)]
    seen = compare(*(reversed(runs) if swap else runs))
    assert len(seen.liftoff) == len(seen.touchdown) == len(seen.apex_height) == len(overlapping)


STAND = PhaseInfo(code=1, name="stand", role=Role.STANCE)
FLY = PhaseInfo(code=2, name="fly", role=Role.FLIGHT)


@pytest.mark.parametrize(("late", "matched"), [(0, 1), (9, 1), (10, 0), (11, 0)])
def test_flights_overlap_if_one_begins_before_the_other_has_ended(late: int, matched: int) -> None:
    """Flights of ten rows of a real leg, whose events lie on rows."""
    phases = [np.repeat([1, 2, 1], [10 + shift, 10, 30 - shift]) for shift in (0, late)]
    runs = [guest(phase, (STAND, FLY)) for phase in phases]
    for pair in (runs, runs[::-1]):
        seen = compare(*pair)
        assert len(seen.liftoff) == len(seen.touchdown) == matched


@pytest.mark.parametrize(("after", "counts"), [(14, False), (15, False), (16, True), (29, True)])
def test_a_landing_counts_once_the_run_is_older_than_the_shortest_phase(
    after: int, counts: bool
) -> None:
    """The run begins so many rows before the one that shows the landing, 15 ms being the bound."""
    hop = Hop()
    whole = hop.recording()
    contact = whole["contact"]
    landing = int(np.flatnonzero(~contact[:-1] & contact[1:])[0]) + 1
    later = truncated(whole, slice(landing - after, None))
    seen = first_touchdown(later, later)
    wanted = hop.touchdown(0) if counts else hop.touchdown(1)
    assert seen == pytest.approx(wanted, abs=1e-3)


def test_the_first_landing_is_of_whichever_run_lands_first() -> None:
    soon, late = Hop(speed=0.7), Hop(speed=0.8)
    for runs in ((soon, late), (late, soon)):
        seen = first_touchdown(*(hop.recording() for hop in runs))
        assert seen == pytest.approx(soon.touchdown(0), abs=1e-3)
    fixed = turning(clock(100))
    assert first_touchdown(soon.recording(), fixed) == pytest.approx(soon.touchdown(0), abs=1e-3)
    assert np.isnan(first_touchdown(fixed, fixed))


def test_ratings_differ_by_the_means_of_those_that_are_known() -> None:
    """Flights of one deflection each, the third of them without any; all radial in the run."""
    hop = Hop()
    signals = hop.signals()
    flight = np.floor((signals["time"] + 0.5 * hop.stance) / hop.cycle).astype(int)
    radial, polar = np.array([-0.1, 0.1]), np.array([0.1, 0.1])
    shares = np.array([radial, radial + polar, 0.0 * radial, polar, radial, radial])
    other = hop.recording(joint_pos=signals["motor_pos"] + shares[flight])
    seen = compare(hop.recording(), other)
    known = [1.0, np.sqrt(0.5), 0.0, 1.0]
    assert seen.rating_flight == pytest.approx(np.mean(known) - 1.0, abs=1e-9)
