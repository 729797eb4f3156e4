"""Which turning points count, and which of the periods between them."""

from dataclasses import replace

import numpy as np
import pytest
from metrics_runs import clock, manifest, recording

from legbench.kinematics import modal_to_joint
from legbench.metrics.analysis import Analysis
from legbench.metrics.modal import Trajectory
from legbench.metrics.periods import find_periods, turning_points
from legbench.phases import Counting
from legbench.signals import Floats

TURN = 2.0 * np.pi / 25.0
"""Period of the sine here [s]."""


def swing(cycles: float) -> tuple[Floats, Floats]:
    """Time, and a sine that begins at zero and swings so often."""
    time = clock(int(cycles * TURN / 0.001))
    return time, np.sin(25.0 * time)


@pytest.mark.parametrize(("share", "more"), [(0.0195, 0), (0.021, 3), (0.039, 3)])
def test_a_swing_counts_from_two_percent_of_the_fastest_on(share: float, more: int) -> None:
    time, rate = swing(5.3)
    # The third swing begins fast, so its turning point counts in any case.
    size = np.where(time < 2.2 * TURN, 1.0, share)
    points = turning_points(time, size * rate)
    assert len(points) == 3 + more
    np.testing.assert_allclose(points, TURN * np.arange(len(points)), atol=4e-4)


@pytest.mark.parametrize("scale", [1e-6, 1e-3, 1.0, 1e3, -1e-3])
def test_turning_points_know_no_scale_and_no_sign(scale: float) -> None:
    time, rate = swing(4.5)
    points = turning_points(time, scale * rate)
    np.testing.assert_allclose(points, TURN * np.arange(5), atol=1e-5)


def test_a_leg_that_rests_in_its_first_row_alone_turns_there() -> None:
    time = clock(400)
    rate = np.where(np.arange(400) == 0, 0.0, np.cos(25.0 * time))
    points = turning_points(time + 3.0, rate)
    assert points[0] == 3.0
    np.testing.assert_allclose(points[1:], 3.0 + TURN * (np.arange(1) + 0.75), atol=1e-5)
    moving = turning_points(time + 3.0, np.cos(25.0 * time))
    np.testing.assert_array_equal(moving, points[1:])


def test_a_rate_that_lingers_at_zero_turns_where_it_leaves_it() -> None:
    """Where it touches zero on the way and falls back, the last crossing counts."""
    rate = np.array([1.0, -1.0, -1.0, -0.01, 0.01, -0.01, 0.0, 0.0, 0.01, 1.0, 1.0])
    time = 0.5 * np.arange(11, dtype=np.float64)
    assert turning_points(time, rate).tolist() == [3.5]


def trajectory_of(radial: Floats, rate: Floats) -> Trajectory:
    pairs = [np.stack([np.full_like(each, 9.0), each], axis=-1) for each in (radial, rate)]
    none = np.zeros((len(radial), 2))
    return Trajectory(
        time=clock(len(radial)), polar=none, polar_rate=none, modal=pairs[0], modal_rate=pairs[1]
    )


def shrinking(cycles: int = 6) -> Trajectory:
    """z2 whose amplitude falls by a tenth from one period to the next."""
    time, rate = swing(cycles + 0.1)
    size = 0.9 ** np.floor(time / TURN)
    return trajectory_of(1.0 - size * np.cos(25.0 * time), size * rate)


def test_an_amplitude_must_exceed_the_smallest() -> None:
    moved = shrinking()
    every = find_periods(moved, 0, Counting())
    assert len(every) == 6
    smallest = float(every.amplitude[3])
    assert len(find_periods(moved, 0, Counting(smallest=smallest))) == 3
    assert len(find_periods(moved, 0, Counting(smallest=smallest * (1.0 - 1e-12)))) == 4


def test_a_small_period_ends_the_count_although_larger_ones_follow() -> None:
    moved = shrinking()
    radial = moved.modal[:, 1].copy()
    small = (moved.time > 2.05 * TURN) & (moved.time < 2.95 * TURN)
    radial[small] = radial[np.flatnonzero(small)[0]]
    seen = find_periods(
        replace(moved, modal=np.stack([radial, radial], axis=-1)), 0, Counting(smallest=0.3)
    )
    assert len(seen) == 2


@pytest.mark.parametrize(("most", "count"), [(1, 1), (4, 4), (6, 6), (7, 6)])
def test_no_more_than_the_leading_periods_count(most: int, count: int) -> None:
    every = find_periods(shrinking(), 0, Counting())
    some = find_periods(shrinking(), 0, Counting(most=most))
    assert len(some) == count
    for name in ("start", "end", "amplitude", "first", "stop"):
        np.testing.assert_array_equal(getattr(some, name), getattr(every, name)[:count])


def test_the_smaller_of_both_bounds_counts() -> None:
    moved = shrinking()
    smallest = 0.95 * 0.9**3
    assert len(find_periods(moved, 0, Counting(smallest=smallest, most=2))) == 2
    assert len(find_periods(moved, 0, Counting(smallest=smallest, most=5))) == 4


def test_what_was_before_the_first_action_has_no_turning_point() -> None:
    time, rate = swing(6.1)
    run = recording(
        time,
        manifest(setup={"kind": "ffs"}, controller={"kind": "other"}),
        phase=np.where(time < 2.0 * TURN - 1e-4, 0, 1),
        joint_pos=modal_to_joint(np.stack([0.0 * time, 1.0 - 0.1 * np.cos(25.0 * time)], axis=-1)),
        joint_vel=modal_to_joint(np.stack([0.0 * time, rate], axis=-1)),
    )
    seen = Analysis(run).periods
    # Still in its first row, the leg turns there: a period begins with the action.
    assert len(seen) == 4
    assert seen.start[0] == run.time[Analysis(run).first_action] == pytest.approx(0.503)
    np.testing.assert_allclose(seen.end, TURN * np.arange(3, 7), atol=1e-5)
