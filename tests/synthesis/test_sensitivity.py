"""Gradients by complex steps against differences, and bounds that are moved."""

from dataclasses import replace

import numpy as np
import pytest

from legbench.design.dependent import MARGINS, cost, margins, objective, solve_dependent
from legbench.design.requirements import PAPER, VARIABLES, Requirements
from legbench.errors import DesignError
from legbench.signals import Floats
from legbench.synthesis.sensitivity import (
    MARGIN_KEPT,
    _gradient,
    _margin_gradients,
    active_bounds,
    moved,
    refine,
)

WIDTH = PAPER.bounds.upper - PAPER.bounds.lower
HEAVY = replace(PAPER, total_mass=2.0 * PAPER.total_mass)


def inside(seed: int) -> Floats:
    """Ratios (7,) in the middle four fifths of their bounds."""
    share = np.random.default_rng(seed).uniform(0.1, 0.9, len(VARIABLES))
    return PAPER.bounds.lower + share * WIDTH


@pytest.mark.parametrize("requirements", [PAPER, HEAVY])
@pytest.mark.parametrize("seed", range(6))
def test_complex_steps_are_the_limit_of_differences(seed: int, requirements: Requirements) -> None:
    """Central differences come nearer by a factor of four when their step is halved."""
    free = inside(seed)
    exact = (_gradient(requirements, free), _margin_gradients(requirements, free))

    def values(at: Floats) -> tuple[Floats, Floats]:
        candidates = solve_dependent(requirements, at)
        return objective(requirements, candidates), margins(requirements, candidates)

    def apart(step: float) -> list[float]:
        errors = [0.0, 0.0]
        for index, width in enumerate(WIDTH):
            by = np.zeros(len(free))
            by[index] = step * width
            above, below = values(free + by), values(free - by)
            for which in (0, 1):
                slope = (above[which] - below[which]) / (2.0 * by[index])
                errors[which] += float(np.abs(slope - exact[which][..., index]).sum())
        return errors

    for coarse, fine, size in zip(apart(2e-3), apart(1e-3), exact, strict=True):
        scale = float(np.abs(size).sum())
        assert fine < 1e-4 * scale
        if coarse > 1e-8 * scale:
            assert coarse / fine == pytest.approx(4.0, rel=0.1)


@pytest.mark.parametrize("side", ["lower", "upper"])
@pytest.mark.parametrize("name", VARIABLES)
def test_a_bound_is_moved_outwards_alone_and_back(name: str, side: str) -> None:
    by = -1e-3 * (getattr(PAPER.bounds, name).upper - getattr(PAPER.bounds, name).lower)
    inwards = moved(PAPER, name, side, by)
    bound, old = getattr(inwards.bounds, name), getattr(PAPER.bounds, name)
    other = "lower" if side == "upper" else "upper"
    assert getattr(bound, other) == getattr(old, other)
    assert getattr(bound, side) == getattr(old, side) + (by if side == "upper" else -by)
    assert bound.lower <= bound.start <= bound.upper
    back = getattr(moved(inwards, name, side, -by).bounds, name)
    assert getattr(back, side) == pytest.approx(getattr(old, side), abs=1e-15)
    same = [each for each in VARIABLES if each != name]
    assert all(getattr(inwards.bounds, each) == getattr(PAPER.bounds, each) for each in same)


def test_a_bound_is_moved_to_no_ratio_that_cannot_be() -> None:
    with pytest.raises(DesignError):
        moved(PAPER, "relaxed_length", "upper", 1.0)


@pytest.mark.parametrize("seed", range(4))
def test_refining_never_makes_worse_and_ends_within_bounds_and_margins(seed: int) -> None:
    free = inside(seed)
    found = refine(PAPER, free)
    assert float(cost(PAPER, found)) <= float(cost(PAPER, free)) + 1e-12
    assert np.all((found >= PAPER.bounds.lower) & (found <= PAPER.bounds.upper))
    if found is not free:
        left = margins(PAPER, solve_dependent(PAPER, found))
        assert float(left.min()) >= min(0.0, MARGIN_KEPT - 1e-9)


def test_a_point_inside_is_held_by_nothing() -> None:
    for seed in range(40):
        free = inside(seed)
        if float(margins(PAPER, solve_dependent(PAPER, free)).min()) > 1e-3:
            assert active_bounds(PAPER, free) == ()
            return
    pytest.fail("no point inside the margins")


def test_forces_of_active_bounds_balance_the_gradient() -> None:
    """At a corner of three bounds the multipliers are the components of the gradient itself."""
    starts = [inside(seed) for seed in range(40)]
    for start in starts:
        start[[0, 3]], start[5] = PAPER.bounds.lower[[0, 3]], PAPER.bounds.upper[5]
    left = [float(margins(PAPER, solve_dependent(PAPER, start)).min()) for start in starts]
    free = starts[int(np.argmax(left))]
    assert max(left) > 1e-3
    found = {row.variable: row for row in active_bounds(PAPER, free)}
    assert set(found) == {VARIABLES[0], VARIABLES[3], VARIABLES[5]}
    assert not set(found) & set(MARGINS)
    slope = _gradient(PAPER, free)
    for place, sign in ((0, 1.0), (3, 1.0), (5, -1.0)):
        assert found[VARIABLES[place]].gain == pytest.approx(sign * slope[place], rel=1e-9)
        edge = PAPER.bounds.lower if sign > 0.0 else PAPER.bounds.upper
        assert found[VARIABLES[place]].value == edge[place]
