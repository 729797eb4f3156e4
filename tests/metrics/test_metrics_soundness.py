import math

import pytest

from legbench.metrics.soundness import LARGEST_GAP, LARGEST_RESIDUAL, Soundness, judge_numerics


@pytest.mark.parametrize(
    ("residual", "gap", "verdict"),
    [
        (LARGEST_RESIDUAL, LARGEST_GAP, Soundness.SOUND),
        (1.01 * LARGEST_RESIDUAL, 0.0, Soundness.UNSOUND),
        (0.0, 1.01 * LARGEST_GAP, Soundness.UNSOUND),
        (math.nan, 1.01 * LARGEST_GAP, Soundness.UNSOUND),
        (math.nan, 0.0, Soundness.SOUND),
        (math.nan, math.nan, Soundness.UNKNOWN),
    ],
)
def test_numerics_are_sound_within_both_bounds(
    residual: float, gap: float, verdict: Soundness
) -> None:
    assert judge_numerics(residual, gap).soundness is verdict


def test_each_bound_that_is_exceeded_is_told_with_value_limit_and_way_out() -> None:
    energy, gap = judge_numerics(0.65, 3e-4).reasons
    assert "0.65 of the peak kinetic energy; up to 0.01" in energy
    assert "300 um; up to 20 um" in gap
    assert "numerics.timestep" in energy
    assert "linkage.bar_density" in gap
