"""Inertias that mass between a segment's joints can have, and designs that ask for more."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from legbench.design import load_design
from legbench.design.dependent import design_of, margins, solve_dependent
from legbench.design.matching import Inertial, Parameters, check_conditions
from legbench.design.mending import mends
from legbench.design.realisable import largest_inertia, reaches
from legbench.design.requirements import (
    PAPER,
    requirements_from_mapping,
    requirements_to_mapping,
)
from legbench.errors import DesignError

MODELS = Path(__file__).parents[2] / "models"
OPTIMAL = design_of(PAPER, np.array([0.95, 0.4837, 0.15, 0.5, 0.15, 1 / 16, 0.5]))


@settings(derandomize=True, max_examples=50)
@given(
    st.lists(st.tuples(st.floats(0.01, 1.0), st.floats(0.0, 1.0)), min_size=1, max_size=6),
    st.floats(0.02, 0.5),
)
def test_no_mass_between_the_joints_has_more_inertia(
    lumps: list[tuple[float, float]], length: float
) -> None:
    mass, at = np.array(lumps).T
    at = length * at
    com = float(mass @ at / mass.sum())
    inertia = float(mass @ (at - com) ** 2)
    column = np.array([mass.sum(), 1.0, 1.0])
    leg = Inertial(
        mass=column,
        length=np.array([length, 1.0, 1.0]),
        com=np.array([com, 0.5, 0.5]),
        inertia=np.zeros(3),
    )
    assert inertia <= largest_inertia(leg)[0] * (1.0 + 1e-12) + 1e-15


def test_the_optimum_needs_mass_beyond_thigh_and_foot() -> None:
    thigh, shank, foot = reaches(OPTIMAL)
    assert not thigh.realisable
    assert shank.realisable
    assert not foot.realisable
    assert thigh.most == pytest.approx(0.1275 * OPTIMAL.thigh.mass * OPTIMAL.thigh.length**2)
    for reach, segment in ((thigh, OPTIMAL.thigh), (foot, OPTIMAL.foot)):
        # All mass at the two far ends, balanced about the centre of mass.
        below, above = (
            segment.com + reach.overhang,
            segment.length - segment.com + reach.overhang,
        )
        assert segment.mass * below * above == pytest.approx(segment.inertia, rel=1e-12)


def test_no_matched_leg_has_all_its_mass_between_its_joints() -> None:
    generator = np.random.default_rng(3)
    bounds = PAPER.bounds
    free = generator.uniform(bounds.lower, bounds.upper, (20_000, 7))
    free[:, 2:5] = generator.uniform(0.01, 0.99, (20_000, 3))
    found = solve_dependent(PAPER, free)
    leg = found.leg
    exists = np.all(leg.mass > 0.0, axis=1) & np.all(leg.inertia > 0.0, axis=1)
    assert exists.sum() > 500
    lacking = np.max(leg.inertia - largest_inertia(leg), axis=1)[exists]
    assert np.all(lacking > 0.0)


def test_the_overhang_is_three_more_margins_and_survives_a_file() -> None:
    bounded = replace(PAPER, overhang=0.0197)
    free = np.array([0.95, 0.4837, 0.15, 0.5, 0.15, 1 / 16, 0.5])
    plain = margins(PAPER, solve_dependent(PAPER, free))
    more = margins(bounded, solve_dependent(bounded, free))
    assert np.array_equal(more[:5], plain)
    # Thigh and foot need 19.4 and 19.9 mm.
    assert np.array_equal(more[5:] > 0.0, [True, True, False])
    assert requirements_from_mapping(requirements_to_mapping(bounded)) == bounded
    assert "constraints" not in requirements_to_mapping(PAPER)
    in_mm = {"units": {"length": "mm"}, "constraints": {"overhang": 15}}
    assert requirements_from_mapping(in_mm).overhang == pytest.approx(0.015)
    with pytest.raises(DesignError, match=r"\[constraints\] has unknown keys: within"):
        requirements_from_mapping({"constraints": {"within": 1.0}})


@pytest.mark.parametrize("overhang", [0.0, -0.01, float("nan"), float("inf")])
def test_an_overhang_that_no_leg_meets_is_refused(overhang: float) -> None:
    with pytest.raises(DesignError, match=r"overhang is .* m; it must be positive and finite"):
        replace(PAPER, overhang=overhang)


def test_a_mend_after_which_the_leg_does_not_stand_says_so() -> None:
    leg = load_design(MODELS / "prototype.toml")
    soft = replace(leg, stiffness=(leg.stiffness[0], 0.4 * leg.stiffness[0]))
    angle = 0.6
    conditions = {c.name: c for c in check_conditions(Parameters.of(soft), angle)}
    assert conditions["stability"].is_met()
    found = {m.parameter: m for m in mends(soft, conditions["elastic"], angle)}
    lowered, raised = found["springs.stiffness (k1)"], found["springs.stiffness (k2)"]
    assert lowered.topples
    assert not raised.topples
    assert next(iter(found)) == "springs.stiffness (k2)"
