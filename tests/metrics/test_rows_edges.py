"""Ends of columns and limits of what is interpolated between rows."""

import numpy as np
import pytest

from legbench.metrics.rows import extreme, runs_of, without_short, zeros_before


def test_an_empty_column_has_no_stretch_and_one_value_has_one() -> None:
    none = runs_of(np.zeros(0, dtype=np.int64))
    assert (len(none.first), len(none.stop), len(none.value)) == (0, 0, 0)
    one = runs_of(np.array([7]))
    assert (one.first.tolist(), one.stop.tolist(), one.value.tolist()) == ([0], [1], [7])


def test_a_stretch_as_long_as_the_minimum_stays_and_those_at_the_ends_do() -> None:
    time = np.linspace(0.0, 2.75, 12)
    column = np.array([1, 0, 0, 0, 1, 1, 0, 0, 0, 0, 1, 1], dtype=bool)
    # Stretches of 0.25, 0.75, 0.5, 1 and 0.25 s, the first and the last of them cut by the ends.
    kept = without_short(time, column, value=True, minimum=0.5)
    np.testing.assert_array_equal(kept, column)
    gone = without_short(time, column, value=True, minimum=0.5 + 1e-9)
    np.testing.assert_array_equal(np.flatnonzero(gone), [0, 10, 11])
    filled = without_short(time, column, value=False, minimum=1.0)
    np.testing.assert_array_equal(np.flatnonzero(filled), [0, 1, 2, 3, 4, 5, 10, 11])


@pytest.mark.parametrize("rows", [2, 3])
def test_the_samples_at_both_ends_are_extremes_of_their_own(rows: int) -> None:
    time, value = np.arange(float(rows)), np.arange(float(rows)) ** 2
    for row in (0, rows - 1):
        assert extreme(time, value, row) == (time[row], value[row])


def test_three_rows_are_enough_for_a_parabola() -> None:
    time = np.array([0.0, 1.0, 3.0])
    value = 2.0 - (time - 1.25) ** 2
    assert extreme(time, value, 1) == pytest.approx((1.25, 2.0), abs=1e-12)


@pytest.mark.parametrize(
    ("summit", "at"), [(0.2, 1.5), (1.4, 1.5), (1.6, 1.6), (2.9, 2.9), (3.1, 3.0), (5.0, 3.0)]
)
def test_a_parabola_is_followed_half_way_to_the_neighbours(summit: float, at: float) -> None:
    """Rows at 1, 2 and 4 s; the extreme of what is no parabola may lie anywhere."""
    time = np.array([0.0, 1.0, 2.0, 4.0, 5.0])
    value = 1.0 - (time - summit) ** 2
    found, height = extreme(time, value, 2)
    assert found == pytest.approx(at, abs=1e-12)
    assert height == pytest.approx(1.0 - (at - summit) ** 2, abs=1e-12)


def test_a_zero_before_the_second_row_has_one_sample_alone_and_falls_back() -> None:
    time = np.array([0.0, 2.0, 3.0])
    for share in (0.0, 0.25, 1.0):
        found = zeros_before(time, np.array([1.0, 0.5, 0.2]), np.array([1]), otherwise=share)
        assert found.tolist() == [2.0 * share]


@pytest.mark.parametrize(("values", "zero"), [((3.0, 1.0), 1.5), ((3.0, -1.0), 1.0)])
def test_a_zero_lies_within_its_step(values: tuple[float, float], zero: float) -> None:
    found = zeros_before(np.arange(3.0), np.array([*values, 9.0]), np.array([2]), otherwise=0.3)
    assert found.tolist() == [zero]


def test_level_samples_do_not_fall() -> None:
    found = zeros_before(np.arange(3.0), np.array([2.0, 2.0, 0.0]), np.array([2]), otherwise=0.3)
    assert found.tolist() == [1.3]
