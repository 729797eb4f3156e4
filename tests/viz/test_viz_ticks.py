import math

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from legbench.signals import Phase
from legbench.viz import style
from legbench.viz.ticks import tick_labels, ticks

LOW = st.floats(-1e3, 1e3)
SPAN = st.floats(1e-3, 1e3)


@settings(derandomize=True)
@given(low=LOW, span=SPAN)
def test_ticks_lie_in_the_range_at_equal_readable_steps(low: float, span: float) -> None:
    values = ticks(low, low + span)
    assert 2 <= len(values) <= 6
    slack = 1e-6 * span
    assert low - slack <= values[0]
    assert values[-1] <= low + span + slack
    steps = np.diff(values)
    np.testing.assert_allclose(steps, steps[0], rtol=1e-6)
    mantissa = steps[0] / 10.0 ** math.floor(math.log10(steps[0]) + 1e-9)
    assert min(abs(mantissa - known) for known in (1.0, 2.0, 2.5, 5.0)) < 1e-6


@settings(derandomize=True)
@given(low=LOW, span=SPAN)
def test_labels_say_the_ticks(low: float, span: float) -> None:
    values = ticks(low, low + span)
    labels = tick_labels(values)
    np.testing.assert_allclose([float(label) for label in labels], values, atol=1e-6 * span)
    assert not any(label.startswith("-") and float(label) == 0.0 for label in labels)


def test_labels_have_no_more_decimals_than_needed() -> None:
    assert tick_labels(ticks(0.17, 0.22)) == ["0.17", "0.18", "0.19", "0.20", "0.21", "0.22"]
    assert tick_labels(ticks(-5.5, 5.5)) == ["-5.0", "-2.5", "0.0", "2.5", "5.0"]
    assert tick_labels(ticks(-12.0, 38.0)) == ["-10", "0", "10", "20", "30"]


def test_viridis_gets_brighter_all_the_way() -> None:
    colours = style.viridis(np.linspace(0.0, 1.0, 101)).astype(float)
    luminance = colours @ [0.2126, 0.7152, 0.0722]
    assert np.all(np.diff(luminance) > 0.0)


def test_late_periods_keep_the_last_colour() -> None:
    colours = style.period_colours(np.array([0, 1, 19, 20, 500]))
    assert len(np.unique(colours, axis=0)) == 3
    np.testing.assert_array_equal(colours[2], colours[4])


def test_every_phase_has_a_colour() -> None:
    assert set(style.PHASES) == set(Phase)
    assert style.packed((0x12, 0x34, 0x56)) == 0x123456FF
