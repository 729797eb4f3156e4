import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from legbench.design.dependent import (
    INFEASIBLE,
    cost,
    design_of,
    margins,
    objective,
    solve_dependent,
)
from legbench.design.matching import Parameters, check_conditions
from legbench.design.requirements import (
    PAPER,
    VARIABLES,
    Requirements,
    load_requirements,
    requirements_from_mapping,
    requirements_to_mapping,
    save_requirements,
)
from legbench.design.scaling import quadruped
from legbench.errors import DesignError

INSIDE = st.lists(st.floats(0.0, 1.0), min_size=7, max_size=7)


def ratios(shares: list[float]) -> np.ndarray:
    lower, upper = PAPER.bounds.lower, PAPER.bounds.upper
    return lower + np.array(shares) * (upper - lower)


@settings(derandomize=True, max_examples=40)
@given(INSIDE)
def test_dependent_parameters_meet_every_requirement(shares: list[float]) -> None:
    free = ratios(shares)
    found = solve_dependent(PAPER, free)
    leg = found.leg
    if not np.isfinite(leg.mass).all() or np.abs(leg.mass).max() > 1e3:
        return
    (m1, m2, m3), (l1, l2, l3), (c1, c2, c3) = leg.mass, leg.length, leg.com
    scale = np.abs(leg.mass).sum()
    assert l1 + l3 == pytest.approx(l2)
    assert l1 + l2 + l3 == pytest.approx(PAPER.relaxed_length / free[0])
    assert m1 + m2 + m3 == pytest.approx(PAPER.leg_mass, abs=1e-12 * scale)
    moment = m1 * c1 + m2 * (l1 + c2) + m3 * (l1 + l2 + c3)
    assert moment == pytest.approx(PAPER.leg_mass * PAPER.leg_com, abs=1e-12 * scale)
    sine = math.sin(float(found.relaxed_angle))
    assert found.stiffness / (2.0 * l2**2 * sine**2) == pytest.approx(PAPER.leg_stiffness)
    parameters = Parameters(
        leg=leg,
        trunk_mass=found.trunk_mass,
        stiffness=np.array([found.stiffness] * 2),
        damping=np.zeros(2),
    )
    for condition in check_conditions(parameters, 0.3)[:4]:
        assert abs(condition.ratio) < 1e-12


def test_a_batch_is_its_rows() -> None:
    free = ratios([0.9, 0.4, 0.1, 0.9, 0.2, 0.1, 0.8])
    batch = np.stack([free, PAPER.bounds.start, PAPER.bounds.upper])
    np.testing.assert_array_equal(cost(PAPER, batch), [cost(PAPER, row) for row in batch])


def test_table_1_start_is_no_leg() -> None:
    found = solve_dependent(PAPER, PAPER.bounds.start)
    assert margins(PAPER, found)[1] < 0.0
    assert cost(PAPER, PAPER.bounds.start) >= INFEASIBLE
    with pytest.raises(DesignError, match="mass is"):
        design_of(PAPER, PAPER.bounds.start)


def test_objective_is_equation_11() -> None:
    free = ratios([1.0, 0.48, 0.0, 1.0, 0.0, 0.0, 1.0])
    leg = design_of(PAPER, free)
    total = sum(leg.lengths)
    shares = [s.mass / PAPER.leg_mass - s.length / total for s in leg.segments]
    stick = leg.thigh.inertia / (leg.thigh.mass * leg.thigh.length**2) - 1.0 / 12.0
    expected = sum(share**2 for share in shares) + 0.5 * stick**2
    assert objective(PAPER, solve_dependent(PAPER, free)) == pytest.approx(expected, rel=1e-12)


def test_requirements_survive_their_file(tmp_path: Path) -> None:
    odd = replace(quadruped(17.3), weights=replace(PAPER.weights, thigh_inertia=0.1 + 0.2))
    save_requirements(odd, tmp_path / "odd.toml")
    assert load_requirements(tmp_path / "odd.toml") == odd
    assert requirements_from_mapping(requirements_to_mapping(PAPER)) == PAPER


def test_units_are_interpreted() -> None:
    given_in_grams = requirements_from_mapping(
        {
            "name": "paper",
            "units": {"mass": "g", "length": "mm", "leg_stiffness": "N/mm"},
            "leg": {"leg_mass": 363, "relaxed_length": 253, "leg_stiffness": 0.905},
        }
    )
    assert given_in_grams == PAPER


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ({"leg": {"leg_mas": 1.0}}, r"\[leg\] has unknown keys: leg_mas"),
        ({"leg": {"leg_com": "long"}}, r"\[leg\] 'leg_com' is 'long'; it must be a number"),
        ({"leg": {"leg_com": float("nan")}}, "leg_com is nan; it must be a positive finite"),
        ({"leg": {"leg_mass": 2.0}}, "leg_mass is 2 kg of a total_mass of 1 kg; the trunk needs"),
        ({"bounds": {"thigh_com": [0.5, 0.4, 0.3]}}, r"thigh_com: bounds \[0\.5, 0\.3\] are empty"),
        ({"bounds": {"thigh_com": [0.2, 0.1, 0.3]}}, "start 0.1 lies outside its bounds"),
        ({"bounds": {"thigh_com": [0.2, 0.3]}}, r"needs 'thigh_com' = \[lower, start, upper\]"),
        ({"bounds": {"thigh_length": [0.1, 0.5, 1.5]}}, "bounds of thigh_length are"),
        ({"bounds": {"foot_mass": [0.1, 0.5, 0.6]}}, r"\[bounds\] has unknown keys: foot_mass"),
        ({"weights": {"thigh_inertia": -1.0}}, "weights are"),
        ({"weights": {"mass_share": [0, 0, 0], "thigh_inertia": 0}}, "all weights .* are zero"),
        ({"units": {"mass": "stone"}}, r"\[units\] mass is 'stone'; known are 'kg', 'g'"),
        ({"legs": {}}, "unknown entries: legs; there are units, leg, bounds"),
    ],
)
def test_requirements_that_make_no_sense(content: dict[str, object], message: str) -> None:
    with pytest.raises(DesignError, match=message):
        requirements_from_mapping(content)


def test_missing_file_names_the_presets(tmp_path: Path) -> None:
    with pytest.raises(DesignError, match="no such requirements file; the presets are 'paper'"):
        load_requirements(tmp_path / "none.toml")


def test_quadruped_of_4_kg_is_the_papers_leg() -> None:
    assert replace(quadruped(4.0), name="paper") == PAPER


@settings(derandomize=True, max_examples=30)
@given(st.floats(0.2, 60.0), st.floats(1.01, 2.0))
def test_scaling_is_a_power_law(mass: float, factor: float) -> None:
    small, large = quadruped(mass), quadruped(mass * factor)

    def exponent(name: str) -> float:
        return math.log(getattr(large, name) / getattr(small, name)) / math.log(factor)

    assert exponent("total_mass") == pytest.approx(1.0)
    assert exponent("leg_mass") == pytest.approx(1.0)
    assert exponent("relaxed_length") == pytest.approx(0.40)
    assert exponent("leg_com") == pytest.approx(1.0 / 3.0)
    assert exponent("leg_stiffness") == pytest.approx(0.67)
    # a damping ratio: d^2 / (k_leg l^2 * m l^2) stays
    assert 2.0 * exponent("damping") == pytest.approx(0.67 + 1.0 + 4.0 * 0.40)


@pytest.mark.parametrize("mass", [0.0, -4.0, 1000.0, math.nan, math.inf])
def test_scaling_ends_where_its_sources_do(mass: float) -> None:
    with pytest.raises(DesignError, match=r"covers 0\.1 to 140 kg"):
        quadruped(mass)


def test_variables_are_those_of_table_1() -> None:
    assert len(VARIABLES) == 7
    low, start, high = PAPER.bounds.lower, PAPER.bounds.start, PAPER.bounds.upper
    np.testing.assert_allclose(low, [0.6, 0.1, 0.15, 0.15, 0.15, 1 / 16, 1 / 16])
    np.testing.assert_allclose(start, [0.8, 0.6, 0.45, 0.45, 0.45, 1 / 12, 1 / 12])
    np.testing.assert_allclose(high, [0.95, 0.9, 0.5, 0.5, 0.5, 0.5, 0.5])
    assert Requirements() == PAPER
