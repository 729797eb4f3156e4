"""Base parameters against the equations' own terms, and the way back to a design."""

import tomllib
from dataclasses import replace

import numpy as np
import pytest
from twins import PROTOTYPE

from legbench.analytic import LegModel
from legbench.analytic.compiled import parameters_of
from legbench.analytic.parameters import MOTOR
from legbench.analytic.state import Regime
from legbench.analytic.terms import Bars
from legbench.design import LegDesign
from legbench.design.setup import SetupKind
from legbench.design.statics import GRAVITY
from legbench.design.toml import design_from_mapping
from legbench.errors import ConfigError
from legbench.identify.back_to_design import design_text, written_back
from legbench.identify.base import LegParameters, equation_parameters, mended
from legbench.identify.outcome import Estimate, Identification
from legbench.identify.parameters import GROUPS, INDEX, PARAMETERS
from legbench.identify.repeated import flaws_of
from legbench.signals import Floats

BARS = Bars(density=0.006)


@pytest.mark.parametrize("bars", [None, BARS])
@pytest.mark.parametrize("kind", [SetupKind.HFTS, SetupKind.VFTS, SetupKind.FFS])
def test_the_equations_parameters_are_those_of_the_model(
    optimal: LegDesign, kind: SetupKind, bars: Bars | None
) -> None:
    gravity = 0.0 if kind is SetupKind.HFTS else GRAVITY
    regime = Regime.PINNED if kind is SetupKind.FFS else Regime.HANGING
    model = LegModel.of(optimal, gravity=gravity, bars=bars)
    leg = LegParameters.of(optimal, bars=bars)
    found, _ = equation_parameters(leg.values, leg.reach, kind)
    wanted = parameters_of(model, regime, (0.0, 0.0))[:MOTOR]
    assert found[:MOTOR] == pytest.approx(wanted, rel=1e-12, abs=1e-15)


@pytest.mark.parametrize("kind", [SetupKind.HFTS, SetupKind.VFTS, SetupKind.FFS])
def test_their_derivatives_are_those_of_finite_differences(kind: SetupKind) -> None:
    leg = LegParameters.of(PROTOTYPE)
    values = leg.values.copy()
    values[INDEX["time_base"]], values[INDEX["f1"]] = 1.02, 0.003
    _, slope = equation_parameters(values, leg.reach, kind)
    for place in range(len(values)):
        step = np.zeros_like(values)
        step[place] = 1e-6
        up, _ = equation_parameters(values + step, leg.reach, kind)
        down, _ = equation_parameters(values - step, leg.reach, kind)
        assert slope[:, place] == pytest.approx((up - down) / 2e-6, abs=1e-8)


def outcome_of(values: Floats, names: tuple[str, ...]) -> Identification:
    def estimate(name: str) -> Estimate:
        value = float(values[INDEX[name]])
        return Estimate(
            name=name,
            unit=PARAMETERS[name].unit,
            value=value,
            before=value,
            error=0.01 * value,
            white_error=0.01 * value,
            low=0.98 * value,
            high=1.02 * value,
        )

    return Identification(
        runs=("a", "b"), findings=(), estimates=tuple(map(estimate, names)), values=values
    )


@pytest.mark.parametrize("bars", [None, BARS])
def test_the_leg_that_is_written_has_what_was_identified(bars: Bars | None) -> None:
    values = LegParameters.of(PROTOTYPE, bars=bars).values.copy()
    names = GROUPS["nine"]
    for place, name in enumerate(names):
        values[INDEX[name]] *= 1.0 + 0.01 * (-1) ** place
    found = written_back(PROTOTYPE, outcome_of(values, names), bars)
    assert LegParameters.of(found, bars=bars).values == pytest.approx(values, rel=1e-12, abs=1e-15)
    assert found.lengths == PROTOTYPE.lengths
    assert found.total_mass == pytest.approx(PROTOTYPE.total_mass, rel=1e-12)


def relative(one: LegDesign) -> Floats:
    """Change of a leg against the prototype, as it is measured when it is to be smallest."""
    parts = [one.trunk_mass / PROTOTYPE.trunk_mass - 1.0]
    for mine, other in zip(one.segments, PROTOTYPE.segments, strict=True):
        parts += [
            mine.mass / other.mass - 1.0,
            (mine.com - other.com) / other.length,
            mine.inertia / other.inertia - 1.0,
        ]
    return np.array(parts)


def test_no_other_leg_with_these_combinations_is_nearer_to_the_design() -> None:
    """Legs that differ from the one found by what no recording shows are all farther away."""
    values = LegParameters.of(PROTOTYPE).values.copy()
    values[INDEX["s1"]] *= 1.03
    found = written_back(PROTOTYPE, outcome_of(values, ("s1",)))
    nearest = np.linalg.norm(relative(found))
    assert nearest > 1e-3
    random = np.random.default_rng(0)
    for _ in range(20):
        # A leg beside it is led back to the combinations from where it is, and is another one.
        shaken = replace(
            found,
            thigh=replace(found.thigh, mass=found.thigh.mass * (1 + 0.05 * random.normal())),
            foot=replace(found.foot, inertia=found.foot.inertia * (1 + 0.1 * random.normal())),
        )
        other = written_back(shaken, outcome_of(values, ("s1",)))
        assert LegParameters.of(other).values[:5] == pytest.approx(values[:5], rel=1e-12)
        assert np.linalg.norm(relative(other)) > nearest


def test_springs_alone_leave_the_masses_as_designed_and_the_file_says_where_they_come_from() -> (
    None
):
    values = LegParameters.of(PROTOTYPE).values.copy()
    values[INDEX["k1"]] = 2.4
    outcome = outcome_of(values, ("k1",))
    found = written_back(PROTOTYPE, outcome)
    assert found == replace(PROTOTYPE, stiffness=(2.4, 2.3))
    text = design_text(found, outcome)
    assert design_from_mapping(tomllib.loads(text)) == found
    assert "from the runs a, b" in text
    assert "k1 = 2.4 N m/rad, 95 % interval 2.352 to 2.448" in text
    assert "are those of the design" in text
    doubted = design_text(found, replace(outcome, reasons=("the clock is wrong",)))
    assert "# NOT TO BE TRUSTED:\n#   the clock is wrong\n" in doubted


def test_a_leg_that_cannot_be_is_refused() -> None:
    values = LegParameters.of(PROTOTYPE).values.copy()
    values[INDEX["J1"]] *= 0.2
    with pytest.raises(ConfigError, match="no leg near design 'prototype'"):
        written_back(PROTOTYPE, outcome_of(values, ("J1",)))


def test_a_leg_is_the_design_with_its_flaws() -> None:
    built = replace(
        PROTOTYPE,
        stiffness=(2.5, 2.2),
        trunk_mass=0.7,
        thigh=replace(PROTOTYPE.thigh, com=0.012, inertia=4.9e-4),
    )
    again = flaws_of(built, PROTOTYPE).leg_of(PROTOTYPE)
    assert LegParameters.of(again).values == pytest.approx(
        LegParameters.of(built).values, rel=1e-12
    )
    with pytest.raises(ConfigError, match="lengths are"):
        flaws_of(replace(PROTOTYPE, thigh=replace(PROTOTYPE.thigh, length=0.065),
                         shank=replace(PROTOTYPE.shank, length=0.134)), PROTOTYPE)  # fmt: skip


def test_parameters_that_some_leg_has_are_left_as_they_are() -> None:
    leg = LegParameters.of(PROTOTYPE)
    assert np.array_equal(mended(leg.values, leg.reach), leg.values)
