"""Fits on targets whose truth is known, because it was planted."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from legbench.design import load_design
from legbench.design.setup import SetupKind
from legbench.errors import ConfigError

pytest.importorskip("heyoka")

from legbench.explain.apart import POSTURE, differ, propose, resting
from legbench.explain.causes import CAUSES, causes_named, combined
from legbench.explain.engine import rate_many
from legbench.explain.explanation import choose
from legbench.explain.fitting import CauseFit, effective, fit_pairs, fit_singles
from legbench.explain.least_squares import refine
from legbench.explain.sensitivity import sensitivities
from legbench.explain.targets import MISSING, PERIODS, Target, step_target
from legbench.signals import Floats, Ints

PROTOTYPE = load_design(Path(__file__).parents[2] / "models" / "prototype.toml")
STEP = Target(name="planted", z2=1.0, dz2=0.3, shape=(0.9,) * 4, setup=SetupKind.HFTS)
SOME = causes_named(["stiffness-apart", "damping", "link-zero-polar"])


def planted(names: list[str], sizes: list[float]) -> Target:
    """Target that a leg with causes of these sizes reaches."""
    leg = combined(causes_named(names), sizes)
    shapes = rate_many(STEP.experiment(PROTOTYPE), [leg], periods=4)
    assert shapes.counted[0] >= 4
    return replace(STEP, shape=tuple(shapes.equilibrium[0].tolist()))


@pytest.mark.parametrize(("name", "size"), [("stiffness-apart", -0.06), ("link-zero-polar", 0.013)])
def test_a_planted_cause_is_found_with_its_size(name: str, size: float) -> None:
    fits = fit_singles(PROTOTYPE, planted([name], [size]), SOME)
    assert fits[0].name == name
    assert fits[0].misfit < 0.02
    # Mirrored legs have mirrored ratings: without gravity the sign of a zero error is not told.
    assert abs(fits[0].sizes[0]) == pytest.approx(abs(size), rel=0.02)
    assert fits[0].within
    assert not fits[-1].within


def test_a_planted_pair_is_found_with_both_sizes() -> None:
    fits = fit_pairs(PROTOTYPE, planted(["stiffness-apart", "damping"], [0.07, 0.25]), SOME)
    assert fits[0].name == "stiffness-apart + damping"
    assert fits[0].misfit < 0.05
    assert fits[0].sizes == pytest.approx((0.07, 0.25), rel=0.05)


def test_causes_that_cannot_be_told_apart_are_named_and_the_next_step_tells_them() -> None:
    # Without gravity it is all one whether the links' or the motors' encoders are off.
    some = causes_named(["stiffness-apart", "link-zero-polar", "motor-zero-polar"])
    target = planted(["link-zero-polar"], [0.02])
    alike = [fit for fit in choose(fit_singles(PROTOTYPE, target, some), []) if fit.within]
    assert {fit.name for fit in alike} >= {"link-zero-polar", "motor-zero-polar"}
    two = [fit for fit in alike if fit.name != "stiffness-apart"]
    best = propose(PROTOTYPE, two)[0]
    assert best.setup is SetupKind.FFS
    assert (best.told, best.pairs) == (1, 1)
    assert best.nearest > 2.0
    assert set(best.nearest_names) == {"link-zero-polar", "motor-zero-polar"}


def test_postures_at_rest_show_zero_errors_and_no_springs_without_gravity() -> None:
    legs = [
        combined(causes_named([name]), [0.02]) for name in ("link-zero-polar", "stiffness-apart")
    ]
    shown = resting(STEP.experiment(PROTOTYPE), legs)
    assert np.allclose(shown, [[0.02 * np.sqrt(2.0)] * 2, [0.0] * 2], rtol=0.0, atol=1e-12)
    still = np.full((2, 4), 0.9)
    assert differ(still, shown) == pytest.approx(0.02 * np.sqrt(2.0) / POSTURE)
    assert differ(np.array([[0.9, np.nan], [0.8, 0.5]]), np.zeros((2, 2))) == pytest.approx(5.0)


def fit(name: str, misfit: float, worst: float) -> CauseFit:
    causes = causes_named(name.split(" + "))
    sizes = (0.0,) * len(causes)
    return CauseFit(causes=causes, sizes=sizes, ratings=(0.9, 0.8), misfit=misfit, worst=worst)


def test_a_pair_explains_nothing_more_than_the_cause_that_reaches_the_target_alone() -> None:
    singles = [fit("friction", 0.4, 0.8), fit("damping", 3.0, 5.0)]
    pairs = [fit("friction + damping", 0.2, 0.3), fit("damping + shank-com", 0.5, 0.9)]
    assert [one.name for one in choose(singles, pairs)][:2] == ["friction", "damping + shank-com"]
    assert len(choose(singles[1:], pairs[:1])) == 2


def test_causes_without_effect_take_no_part_in_pairs() -> None:
    some = causes_named(["foot-inertia", "guide-upward", "damping"])
    # What guides the trunk is not there with a fixed trunk.
    assert [cause.name for cause in effective(PROTOTYPE, STEP, some)] == ["foot-inertia", "damping"]


def test_effects_are_those_of_plausible_sizes_of_both_signs() -> None:
    rows = sensitivities(PROTOTYPE, STEP, causes_named(["friction", "stiffness-apart"]))
    sizes = {(row.cause.name, row.size) for row in rows}
    assert sizes == {("friction", 0.003), ("stiffness-apart", 0.04), ("stiffness-apart", -0.04)}
    assert [row.change for row in rows] == sorted((row.change for row in rows), reverse=True)
    leg = combined(causes_named(["stiffness-apart"]), [0.04])
    shapes = rate_many(STEP.experiment(PROTOTYPE), [leg], periods=4)
    found = next(row for row in rows if row.size == 0.04)
    assert np.allclose(found.ratings, shapes.equilibrium[0], rtol=0.0, atol=1e-12)


def test_causes_add_up_to_imperfections() -> None:
    names = ["stiffness-apart", "stiffness", "friction", "friction-apart", "trunk-mass"]
    leg = combined(causes_named(names), [0.04, 0.1, 0.002, -0.003, 0.05])
    assert leg.stiffness_error == pytest.approx((0.08, 0.12))
    assert leg.coulomb_friction == pytest.approx((0.005, 0.002))
    assert leg.trunk_mass_error == 0.05
    motors = combined(causes_named(["delay-apart", "slew-apart"]), [2.6, -0.1])
    assert motors.motor_delay_cycles == (0, 3)
    assert motors.motor_slew_rate is not None
    assert motors.motor_slew_rate[0] == pytest.approx(10.0)
    assert combined(causes_named(["friction"]), [0.0]).perfect


def test_every_cause_can_be_of_every_size_in_its_range() -> None:
    for cause in CAUSES.values():
        for size in (cause.low, -cause.plausible if cause.signed else 0.0, cause.high):
            combined([cause], [size]).leg_of(PROTOTYPE)
            assert cause.shown(size)


def test_unknown_causes_are_refused_with_the_nearest() -> None:
    with pytest.raises(ConfigError, match=r"no cause 'fricton'; did you mean friction\? there are"):
        causes_named(["fricton"])


def test_the_targets_are_the_published_numbers() -> None:
    text, caption = step_target("text"), step_target("caption")
    assert (text.z2, text.dz2) == (1.4, 0.3)
    assert (caption.z2, caption.dz2) == (1.0, -0.3)
    assert text.shape == pytest.approx(np.linspace(0.94, 0.78, PERIODS).tolist())
    with pytest.raises(ConfigError, match="no reading 'figure'; there are text, caption"):
        step_target("figure")
    with pytest.raises(ConfigError, match="it needs two or more"):
        replace(text, shape=(0.9,))
    with pytest.raises(ConfigError, match="it must be positive"):
        replace(text, tolerance=0.0)


def test_a_period_that_is_too_small_to_count_is_missing() -> None:
    ratings = np.array([[0.9, 0.9, 0.9, 0.9], [0.9, 0.92, np.nan, 0.9]])
    amplitude = np.array([[0.3, 0.2, 0.1, 0.015], [0.3, 0.2, np.nan, 0.1]])
    found = STEP.residuals(ratings, amplitude)
    assert np.allclose(found[0, :3], 0.0)
    assert found[0, 3] == pytest.approx(MISSING * 1.5)
    assert found[1, :2] == pytest.approx([0.0, 1.0])
    assert found[1, 2] == pytest.approx(MISSING * 2.0)


def test_least_squares_from_many_starts_find_each_its_own_valley() -> None:
    calls = []

    def residuals(points: Floats, owner: Ints) -> Floats:
        calls.append(len(points))
        x, y = points.T
        return np.stack([x**2 - 1.0 - 0.0 * owner, 3.0 * (y - x)], axis=-1)

    starts = np.array([[0.7, 0.0], [-0.4, 1.0], [1.9, -1.9]])
    low, high = np.full((3, 2), -2.0), np.full((3, 2), 2.0)
    found = refine(residuals, starts, low, high, np.full((3, 2), 1e-6))
    assert np.allclose(found, [[1.0, 1.0], [-1.0, -1.0], [1.0, 1.0]], atol=1e-4)
    assert max(calls) == 9
    # An optimum on a bound is found there.
    narrow = refine(residuals, starts[:1], low[:1], np.full((1, 2), 0.8), np.full((1, 2), 1e-6))
    assert np.allclose(narrow, [[0.8, 0.8]], atol=1e-4)
