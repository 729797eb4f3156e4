import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from legbench.phases import PhaseInfo, Role
from legbench.recording.format_1 import built_in
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


BUILT_IN = {
    "jump": {
        "rest": (120, 120, 128),
        "flight": style.FLIGHT,
        "compress": (0, 150, 136),
        "push": style.STANCE,
        "release": (142, 108, 190),
    },
    "bang-bang": {
        "rest": (120, 120, 128),
        "middle": (158, 158, 120),
        "folded": (0, 150, 136),
        "stretched": (214, 130, 40),
    },
    "position-jump": {"rest": (120, 120, 128), "stepped": (142, 108, 190)},
}
"""Colours that pictures of these controllers have always had."""


@pytest.mark.parametrize("kind", list(BUILT_IN))
def test_known_phases_keep_their_colours(kind: str) -> None:
    phases = built_in(kind, {}).phases
    colours = style.phase_colours(phases)
    assert {phase.name: colours[phase.code] for phase in phases} == BUILT_IN[kind]


@pytest.mark.parametrize("role", list(Role))
def test_phases_of_one_role_are_told_apart(role: Role) -> None:
    codes = (3, 7, 11, 127)
    phases = [PhaseInfo(code=code, name=f"p{code}", role=role) for code in codes]
    assert len(set(style.phase_colours(phases).values())) == len(codes)
    more = [*phases, PhaseInfo(code=15, name="p15", role=role)]
    assert style.phase_colours(more)[15] in style.PHASES[role]


def test_a_phase_that_nobody_declared_has_a_colour_of_its_own() -> None:
    phases = built_in("jump", {}).phases
    colours = style.colours_by_code(phases, np.array([5, 99, -1]))
    np.testing.assert_array_equal(colours[:2], [style.FLIGHT, style.UNDECLARED])


def test_colours_are_packed_as_rerun_wants_them() -> None:
    assert style.packed((0x12, 0x34, 0x56)) == 0x123456FF
