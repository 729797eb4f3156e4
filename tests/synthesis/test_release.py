"""Legs at rest against potential energy, and released against the equations of another engine."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import minimize

from legbench.design import LegDesign
from legbench.design.dependent import design_of
from legbench.design.requirements import PAPER
from legbench.design.setup import Setup, SetupKind
from legbench.design.statics import GRAVITY, Support
from legbench.errors import ConfigError
from legbench.kinematics import leg_points
from legbench.metrics import Reference, rate
from legbench.plant.analytic import AnalyticPlant
from legbench.plant.start import Start
from legbench.signals import Command, Floats
from legbench.synthesis.release import KEPT, Ratings, Release, rate_legs, released
from legbench.synthesis.scatter import scatter
from legbench.synthesis.tolerance import Tolerances

LEG = design_of(PAPER, np.array([0.95, 0.4837, 0.15, 0.5, 0.15, 1 / 16, 0.5]))
MADE = scatter(LEG, Tolerances(), 3, 11)
SETUPS = {Support.FOOT: SetupKind.FFS, Support.TRUNK: SetupKind.VFTS, Support.NONE: SetupKind.HFTS}


def potential(leg: LegDesign, joint_pos: Floats, motor_pos: Floats, support: Support) -> float:
    """Energy of springs and heights, each body where the leg's points put it [J]."""
    thigh, shank, foot = (part.length for part in leg.segments)
    hip, knee, ankle, tip = leg_points(joint_pos, (thigh, shank, foot))
    ends = ((hip, knee), (knee, ankle), (ankle, tip))
    heights = [
        start[1] + part.com / part.length * (end[1] - start[1])
        for part, (start, end) in zip(leg.segments, ends, strict=True)
    ]
    masses = [part.mass for part in leg.segments]
    lowest = tip[1] if support is Support.FOOT else hip[1]
    weight = leg.trunk_mass * (hip[1] - lowest)
    weight += sum(mass * (height - lowest) for mass, height in zip(masses, heights, strict=True))
    spring = 0.5 * float(np.asarray(leg.stiffness) @ np.square(motor_pos - joint_pos))
    return spring + (0.0 if support is Support.NONE else GRAVITY * weight)


@pytest.mark.parametrize("support", SETUPS)
def test_legs_are_found_where_their_potential_energy_is_least(support: Support) -> None:
    release = Release(setup=SETUPS[support], z2=1.2, dz2=0.2)
    legs = released([LEG] * len(MADE), MADE, release)
    for leg, joint_pos, motor_pos in zip(MADE, legs.start, legs.held, strict=True):
        least = minimize(
            lambda q, leg=leg, motor=motor_pos: potential(leg, q, motor, support),
            motor_pos,
            method="Nelder-Mead",
            options={"xatol": 1e-9, "fatol": 1e-15, "maxiter": 2000},
        )
        np.testing.assert_allclose(joint_pos, least.x, atol=2e-6)
        assert potential(leg, joint_pos, motor_pos, support) <= least.fun + 1e-12


@pytest.mark.parametrize("kind", [SetupKind.FFS, SetupKind.VFTS])
def test_many_legs_at_once_are_rated_as_one_by_the_equations_of_the_paper(kind: SetupKind) -> None:
    """Runge-Kutta on arrays against the analytic plant, which goes from row to row by DOP853."""
    release = Release(setup=kind, z2=1.2, dz2=0.2, duration=0.25, reference=Reference.MOTOR)
    unequal = [replace(leg, stiffness=(1.1 * leg.stiffness[0], leg.stiffness[1])) for leg in MADE]
    found = rate_legs([LEG] * len(unequal), unequal, release)
    assert not found.faulted.any()
    legs = released([LEG] * len(unequal), unequal, release)
    for place, leg in enumerate(unequal):
        alone = released([LEG], [leg], release)
        np.testing.assert_array_equal(alone.start[0], legs.start[place])
        begin = Start(joint_pos=legs.start[place], motor_pos=legs.held[place])
        command = Command.holding(legs.motor[place])
        with AnalyticPlant(leg, Setup(kind=kind), begin) as plant:
            plant.reset()
            rows = [plant.step(command).joint_pos - legs.motor[place] for _ in range(250)]
        assert found.values[place] == pytest.approx(rate(np.array(rows)), abs=1e-5)
    assert float(np.ptp(found.values)) > 1e-3


def test_the_yield_is_the_share_that_keeps_its_mode() -> None:
    ratings = Ratings(
        values=np.array([KEPT, np.nextafter(KEPT, 1.0), 1.0, 0.0]),
        faulted=np.array([False, False, False, True]),
    )
    assert (ratings.kept, ratings.share) == (2, 0.5)


def test_legs_that_cannot_be_held_are_counted() -> None:
    soft = replace(LEG, stiffness=(0.02, 0.02))
    with pytest.raises(ConfigError, match=r"^1 of 2 scattered legs find no equilibrium"):
        released([LEG, LEG], [LEG, soft], Release(z2=0.5, dz2=0.1))
