import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from legbench.metrics.rows import extreme, runs_of, without_short, zeros_before


@settings(derandomize=True)
@given(st.lists(st.integers(-1, 1), max_size=60))
def test_runs_give_the_column_back(values: list[int]) -> None:
    column = np.array(values, dtype=np.int64)
    runs = runs_of(column)
    np.testing.assert_array_equal(np.repeat(runs.value, runs.stop - runs.first), column)
    assert np.all(runs.value[1:] != runs.value[:-1])
    np.testing.assert_array_equal(runs.first[1:], runs.stop[:-1])


@settings(derandomize=True)
@given(st.lists(st.booleans(), min_size=1, max_size=80), st.integers(1, 10), st.booleans())
def test_short_stretches_go_and_nothing_else(
    values: list[bool], shortest: int, value: bool
) -> None:
    column = np.array(values)
    time = np.arange(len(column), dtype=np.float64)
    cleaned = without_short(time, column, value=value, minimum=float(shortest))
    runs = runs_of(cleaned)
    inside = runs.value[1:-1] == value
    assert np.all((runs.stop - runs.first)[1:-1][inside] >= shortest)
    assert np.all(column[cleaned != column] == value)
    np.testing.assert_array_equal(without_short(time, column, value=value, minimum=0.5), column)


@settings(derandomize=True)
@given(st.floats(-0.5, 0.5), st.floats(-2.0, 2.0), st.sampled_from([-3.0, -0.1, 0.1, 3.0]))
def test_extreme_of_a_parabola_is_exact(offset: float, top: float, bend: float) -> None:
    time = 0.1 * np.arange(11.0)
    summit = 0.1 * (5.0 + 0.999 * offset)
    value = top + bend * np.square(time - summit)
    row = int(np.argmin(bend * value))
    at, height = extreme(time, value, row)
    assert at == pytest.approx(summit, abs=1e-9)
    assert height == pytest.approx(top, abs=1e-9)


UNEVEN = np.array([0.0, 1.0, 2.4, 3.0, 4.0, 6.0, 6.7])
"""Times of rows between which ticks were late or missed."""


@settings(derandomize=True)
@given(st.floats(1.8, 4.9), st.floats(-2.0, 2.0), st.sampled_from([-3.0, -0.1, 0.1, 3.0]))
def test_extreme_between_uneven_rows_is_exact(summit: float, top: float, bend: float) -> None:
    value = top + bend * np.square(UNEVEN - summit)
    row = int(np.argmin(bend * (value - top)))
    at, height = extreme(UNEVEN, value, row)
    assert at == pytest.approx(summit, abs=1e-9)
    assert height == pytest.approx(top, abs=1e-9)


@pytest.mark.parametrize(("row", "zero"), [(2, 2.3), (3, 2.5), (4, 3.9), (5, 4.1)])
def test_zero_between_uneven_rows_is_exact(row: int, zero: float) -> None:
    falling = np.where(zero > UNEVEN, 1.7 * (zero - UNEVEN), 7.0)
    found = zeros_before(UNEVEN, falling, np.array([row]), otherwise=0.5)
    assert found[0] == pytest.approx(zero, abs=1e-12)


def test_extreme_at_an_end_or_on_a_line_is_the_sample() -> None:
    time, line = np.arange(4.0), np.arange(4.0)
    assert extreme(time, line, 3) == (3.0, 3.0)
    assert extreme(time, line, 1) == (1.0, 1.0)
    assert extreme(time, np.array([np.nan, 1.0, 2.0, 0.0]), 1) == (1.0, 1.0)


@settings(derandomize=True)
@given(st.floats(0.001, 0.999), st.floats(0.01, 10.0))
def test_zero_of_a_falling_line_is_exact(share: float, slope: float) -> None:
    time = np.linspace(0.0, 2.5, 6)
    zero = 0.5 * (3.0 + share)
    falling = np.where(time < zero, slope * (zero - time), 7.0)
    found = zeros_before(time, falling, np.array([4]), otherwise=0.5)
    assert found[0] == pytest.approx(zero, abs=1e-12)


def test_zero_that_cannot_be_seen_falls_back_and_never_leaves_its_step() -> None:
    time = np.arange(5.0)
    rows = np.array([1, 3, 4])
    rising = zeros_before(time, np.array([1.0, 2.0, 3.0, np.nan, 0.0]), rows, otherwise=0.25)
    np.testing.assert_array_equal(rising, [0.25, 2.25, 3.25])
    slow = zeros_before(time, np.array([9.0, 8.9, 8.8, 0.1, 0.0]), rows[1:2], otherwise=0.5)
    np.testing.assert_array_equal(slow, [3.0])
