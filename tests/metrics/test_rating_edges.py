"""Rows of a rating that are alone, unknown or hardly deflected."""

import numpy as np
import pytest
from metrics_runs import PROTOTYPE, Hop

from legbench.design.statics import Support, equilibrium
from legbench.metrics.analysis import Analysis
from legbench.metrics.rating import AT_REST, alignment, deflection, link_equilibrium, rate_phases
from legbench.metrics.source import Reference

SUPPORTED = (Support.FOOT, Support.TRUNK)


@pytest.mark.parametrize("size", [1.001e-9, 1.9e-9, 1e-6])
def test_a_row_counts_from_a_billionth_of_a_radian_on(size: float) -> None:
    rows = size * np.array([[0.6, 0.8], [-1.0, 0.0]])
    np.testing.assert_allclose(alignment(rows), [0.2 / np.sqrt(2.0), np.sqrt(0.5)], rtol=1e-9)
    assert np.isnan(alignment(0.5 * AT_REST * rows / size)).all()
    # The edge itself has no direction.
    assert np.isnan(alignment(np.array([[AT_REST, 0.0], [0.0, -AT_REST]]))).all()


@pytest.mark.parametrize("support", SUPPORTED)
@pytest.mark.parametrize("rows", [0, 1, 2])
def test_few_rows_have_the_equilibria_of_many(support: Support, rows: int) -> None:
    motor_pos = np.array([[-0.8, 0.7], [-0.5, 0.9]])[:rows]
    found = link_equilibrium(PROTOTYPE, motor_pos, support)
    assert found.shape == (rows, 2)
    if rows:
        np.testing.assert_allclose(found, equilibrium(PROTOTYPE, motor_pos, support), atol=1e-12)
        assert np.all(np.abs(found - motor_pos).max(axis=-1) > 1e-3)


@pytest.mark.parametrize("unknown", [(np.nan, 0.7), (-0.8, np.nan), (np.nan, np.nan)])
def test_a_motor_that_is_unknown_leaves_its_row_alone_unknown(unknown: tuple[float, float]) -> None:
    motor_pos = np.tile([-0.8, 0.7], (5, 1))
    motor_pos[2] = unknown
    found = link_equilibrium(PROTOTYPE, motor_pos, Support.FOOT)
    assert np.isnan(found[2]).all()
    known = [0, 1, 3, 4]
    expected = equilibrium(PROTOTYPE, motor_pos[known], Support.FOOT)
    np.testing.assert_allclose(found[known], expected, atol=1e-12)


def test_a_leg_that_nothing_loads_is_at_its_motors_as_far_as_they_are_known() -> None:
    motor_pos = np.array([[-0.8, 0.7], [-0.8, np.nan]])
    found = link_equilibrium(PROTOTYPE, motor_pos, Support.NONE)
    np.testing.assert_array_equal(found, motor_pos)


def test_motors_that_stand_still_for_a_while_keep_their_own_equilibria() -> None:
    places = np.random.default_rng(8).uniform([-1.2, 0.3], [-0.3, 1.2], (6, 2))
    motor_pos = np.repeat(places, [1, 3, 2, 5, 1, 4], axis=0)
    found = link_equilibrium(PROTOTYPE, motor_pos, Support.FOOT)
    expected = equilibrium(PROTOTYPE, motor_pos, Support.FOOT)
    np.testing.assert_allclose(found, expected, atol=1e-12)


def test_each_stretch_of_rows_is_rated_by_its_own_rows() -> None:
    """Against eq. (14) summed by hand; stretches may leave rows out, and need no order."""
    hop = Hop()
    count = len(hop.signals()["time"])
    joint_pos = np.random.default_rng(9).uniform([-0.9, 0.4], [-0.4, 0.9], (count, 2))
    run = hop.recording(joint_pos=joint_pos)
    first, stop = np.array([5, 40, 300]), np.array([25, 41, 777])
    for reference in Reference:
        rated = rate_phases(run, Support.FOOT, reference, first, stop)
        apart = deflection(PROTOTYPE, joint_pos, run["motor_pos"], Support.FOOT, reference)
        for value, low, high in zip(rated, first, stop, strict=True):
            shares = [
                abs(row[1] - row[0]) / (np.sqrt(2.0) * np.hypot(*row)) for row in apart[low:high]
            ]
            assert value == pytest.approx(np.mean(shares), abs=1e-12)
    none = np.zeros(0, dtype=np.int64)
    assert rate_phases(run, Support.FOOT, Reference.MOTOR, none, none) == []


def test_flights_carry_nothing_whatever_the_reference() -> None:
    run = Hop().recording(entries=None)
    ratings = Analysis(run).ratings
    assert ratings.chosen.flight == ratings.equilibrium.flight
    assert ratings.chosen.stance != ratings.equilibrium.stance
