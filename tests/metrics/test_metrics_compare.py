import json
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from metrics_runs import PROTOTYPE, Hop, clock, manifest, recording, truncated

from legbench.errors import FormatError, RecordingError
from legbench.kinematics import modal_to_joint
from legbench.metrics import Analysis, Comparison, compare, differences, summarise
from legbench.recording.reader import Recording
from legbench.signals import Floats

FIXED: dict[str, Any] = {
    "setup": {"kind": "ffs"},
    "controller": {"kind": "position-jump", "z2": 1.0, "dz2": 0.1},
}


def swung(time: Floats, amplitude: float, **entries: Any) -> Recording:
    """A radial oscillation about z = (0, 1)."""
    z2 = 1.0 + amplitude * np.sin(2 * np.pi * 1.5 * time)
    joint = modal_to_joint(np.stack([0 * z2, z2], axis=-1))
    return recording(time, manifest(**(FIXED | entries)), joint_pos=joint)


def test_a_run_against_itself_differs_in_nothing() -> None:
    run = Hop().recording()
    same = compare(run, run)
    assert same.joint_max == same.z2_max == same.joint_before_touchdown == 0.0
    assert set(same.liftoff) == set(same.touchdown) == set(same.apex_height) == {0.0}
    assert len(same.liftoff) == len(summarise(run).rating_flight)
    assert (same.rating_stance, same.rating_flight) == (0.0, 0.0)
    assert same.unlike == []


def test_signals_of_two_runs_are_not_kept_together() -> None:
    run, other = Analysis(Hop().recording()), Analysis(Hop().recording())
    for each in (run, other):
        assert len(each["joint_vel"]) == len(each.time)
    assert compare(run, other).joint_max == 0.0
    assert set(run._signals) == set(other._signals) == {"joint_pos"}


def test_a_known_difference_is_measured() -> None:
    seen = compare(swung(clock(2000), 0.10), swung(clock(2000), 0.13))
    assert seen.z2_max == pytest.approx(0.03, rel=1e-4)
    assert seen.joint_max == pytest.approx(0.03 / np.sqrt(2.0), rel=1e-4)
    assert np.isnan(seen.first_touchdown)
    assert np.isnan(seen.joint_before_touchdown)
    assert np.isnan(seen.rating_stance)


def test_exchanging_the_runs_turns_the_signs() -> None:
    low, high = Hop(speed=0.8).recording(), Hop(speed=0.82).recording()
    there, back = compare(low, high), compare(high, low)
    assert there.joint_max == back.joint_max
    assert there.first_touchdown == back.first_touchdown
    np.testing.assert_allclose(there.liftoff, np.negative(back.liftoff), atol=1e-15)
    np.testing.assert_allclose(there.touchdown, np.negative(back.touchdown), atol=1e-15)
    assert there.rating_flight == -back.rating_flight


def test_events_and_apexes_are_those_of_the_closed_form() -> None:
    low, high = Hop(speed=0.8), Hop(speed=0.82)
    seen = compare(low.recording(), high.recording())
    assert len(seen.liftoff) >= 4
    for index in range(4):
        late = high.liftoff(index) - low.liftoff(index)
        assert seen.liftoff[index] == pytest.approx(late, abs=1.1e-3)
        late = high.touchdown(index) - low.touchdown(index)
        assert seen.touchdown[index] == pytest.approx(late, abs=1e-3)
    expected = (high.height + high.rise) / (low.height + low.rise) - 1.0
    np.testing.assert_allclose(seen.apex_height, expected, atol=1e-4)
    assert seen.first_touchdown == pytest.approx(low.touchdown(0), abs=1e-3)


def test_flights_are_matched_until_they_no_longer_overlap() -> None:
    short, long = Hop(hops=9.0), Hop(hops=9.0, stance=0.19)
    seen = compare(short.recording(), long.recording())
    overlapping = [index for index in range(8) if long.liftoff(index) < short.touchdown(index)]
    assert 2 < len(overlapping) < 8
    assert len(seen.liftoff) == len(seen.touchdown) == len(overlapping)


def test_a_leg_put_down_in_its_first_row_has_not_landed() -> None:
    hop = Hop()
    contact = hop.signals()["contact"].copy()
    contact[0] = False
    seen = compare(hop.recording(), hop.recording(contact=contact))
    assert seen.first_touchdown == pytest.approx(hop.touchdown(0), abs=1e-3)


def test_before_the_touchdown_only_earlier_rows_count() -> None:
    hop = Hop()
    signals = hop.signals()
    later = signals["time"] > hop.touchdown(0)
    shift = np.where(later, 0.2, 0.01)[:, None] * np.array([1.0, -1.0])
    seen = compare(hop.recording(), hop.recording(joint_pos=signals["joint_pos"] + shift))
    assert seen.joint_before_touchdown == pytest.approx(0.01)
    assert seen.joint_max == pytest.approx(0.2)
    assert seen.z2_before_touchdown == pytest.approx(0.01 * np.sqrt(2.0))


@pytest.mark.parametrize("swap", [False, True])
def test_the_finer_run_is_interpolated_to_the_coarser_grid(swap: bool) -> None:
    coarse, fine = swung(4.0 * clock(400), 0.1), swung(0.7 * clock(2000), 0.1)
    runs = (fine, coarse) if swap else (coarse, fine)
    apart = differences(*runs)
    np.testing.assert_array_equal(apart.time, coarse.time[coarse.time <= fine.time[-1]])
    curvature = 0.1 * (2 * np.pi * 1.5) ** 2
    assert np.abs(apart.z2).max() <= 1.01 * curvature * 0.0007**2 / 8.0
    assert compare(*runs).period == 0.004


def test_both_are_measured_in_the_runs_modal_convention() -> None:
    printed = {"conventions": {"modal": "literal"}}
    run, other = swung(clock(1000), 0.10), swung(clock(1000), 0.12, **printed)
    seen = compare(run, other)
    assert seen.z2_max == pytest.approx(0.02, rel=1e-3)
    assert seen.unlike == ["conventions.modal"]


def test_another_design_and_setup_are_named_entry_by_entry() -> None:
    heavy = replace(PROTOTYPE, name="heavy", trunk_mass=1.0)
    other = Hop().recording(entries=manifest(heavy, setup={"kind": "jump", "later": 1.0}))
    seen = compare(Hop().recording(), other)
    assert seen.unlike == ["design.name", "design.trunk.mass", "setup.later"]
    fixed = compare(Hop().recording(), swung(clock(1000), 0.1))
    assert fixed.liftoff == []
    assert "setup.kind" in fixed.unlike
    assert np.isnan(fixed.rating_periods)


def test_names_say_what_made_a_run() -> None:
    bars = {"kind": "bars"}
    for entries, title in (
        ({"plant": "sim", "linkage": bars}, "sim / bars / prototype"),
        ({"plant": "analytic", "linkage": bars}, "analytic / prototype"),
        ({}, "prototype"),
    ):
        assert recording(clock(1), manifest(**entries)).description.title == title


@pytest.mark.parametrize("rows", [1, 2, 5, 60, 250, 900])
@pytest.mark.parametrize("real", [False, True])
def test_stubs_are_compared_and_told_in_strict_json(rows: int, real: bool) -> None:
    stub = truncated(Hop().real() if real else Hop().recording(), slice(0, rows))
    seen = compare(Hop().recording(), stub)
    told = json.loads(json.dumps(seen.to_json(), allow_nan=False))
    assert told.keys() == set(Comparison.__dataclass_fields__)
    assert told["joint_max"] == 0.0
    if rows < 60:
        assert told["rating_flight"] is None


def test_runs_that_cannot_be_compared_say_why() -> None:
    run = Hop().recording()
    with pytest.raises(RecordingError, match="runs/one has no rows: there is nothing to compare"):
        compare(run, truncated(run, slice(0, 0)))
    with pytest.raises(RecordingError, match=r"no time in common: 0\.0004 to .* and 9 to 9\.099 s"):
        compare(run, swung(9.0 + clock(100), 0.1))
    with pytest.raises(FormatError, match=r"manifest setup\.kind is 'moon'"):
        compare(run, swung(clock(100), 0.1, setup={"kind": "moon"}))
