"""Two models that share nothing but the design: these equations and the simulator's."""

import itertools
from pathlib import Path

import numpy as np
import pytest

from legbench.analytic import Accuracy, Bars
from legbench.design import load_design
from legbench.design.setup import Setup, SetupKind
from legbench.design.statics import motor_holding
from legbench.mjcf import BuildOptions, Linkage, LinkageKind, Numerics
from legbench.plant.abstract import AbstractPlant
from legbench.plant.analytic import AnalyticPlant
from legbench.plant.sim import SimPlant
from legbench.plant.start import Start
from legbench.signals import Command, Floats

DESIGN = load_design(Path(__file__).parents[2] / "models" / "prototype.toml")
FINE = Accuracy(rtol=1e-12, atol=1e-14)
FIXED = [
    SetupKind.FFS,
    *(pytest.param(kind, marks=pytest.mark.long) for kind in (SetupKind.HFTS, SetupKind.VFTS)),
]
STEPS = (1e-3, 5e-4, 2.5e-4, 1.25e-4)
"""The simulator's time steps [s]."""
DENSITIES = (0.007, 0.0035, 0.00175, 0.000875)
"""Of the bars [kg/m]."""


def case(kind: SetupKind) -> tuple[Setup, Start, Floats]:
    """A posture off the mode, and a motor position half a radian away from it."""
    setup, posture = Setup(kind=kind), np.array([-0.85, 0.80])
    start = Start(joint_pos=posture, motor_pos=motor_holding(DESIGN, posture, setup.support))
    return setup, start, motor_holding(DESIGN, np.array([-0.65, 0.65]), setup.support)


def rollout(plant: AbstractPlant, motor: Floats) -> Floats:
    """Joint angles over one second after a step of the motors."""
    plant.reset()
    return np.array([plant.step(Command.holding(motor)).joint_pos for _ in range(1000)])


def simulated(setup: Setup, start: Start, linkage: Linkage, timestep: float) -> SimPlant:
    numerics = Numerics(timestep=timestep, loop_solref=(timestep, 1.0))
    return SimPlant(DESIGN, BuildOptions(setup=setup, linkage=linkage, numerics=numerics), start)


def slope(sizes: tuple[float, ...], errors: list[float]) -> float:
    return float(np.polyfit(np.log(sizes), np.log(errors), 1)[0])


@pytest.mark.parametrize("kind", FIXED)
def test_reduced_linkage_converges_to_the_equations(kind: SetupKind) -> None:
    setup, start, motor = case(kind)
    wanted = rollout(AnalyticPlant(DESIGN, setup, start, accuracy=FINE), motor)
    assert np.ptp(wanted[:, 1]) > 0.2
    reduced = Linkage(kind=LinkageKind.REDUCED)
    errors = [
        float(np.max(np.abs(rollout(simulated(setup, start, reduced, step), motor) - wanted)))
        for step in STEPS
    ]
    assert errors[-1] < 1e-6
    assert slope(STEPS, errors) > 1.9


@pytest.mark.parametrize(("kind", "bound"), [("hfts", 6e-4), ("vfts", 6e-4), ("ffs", 4e-3)])
def test_a_knee_swings_into_the_same_stop(kind: str, bound: float) -> None:
    """But for the inertia in the impedance: the simulator takes that of a reference posture."""
    setup, posture = Setup(kind=SetupKind(kind)), np.array([-0.32, 0.32])
    start = Start(joint_pos=posture, motor_pos=motor_holding(DESIGN, posture, setup.support))
    motor = motor_holding(DESIGN, np.array([-0.13, 0.11]), setup.support)
    wanted = rollout(AnalyticPlant(DESIGN, setup, start, accuracy=FINE), motor)
    assert np.min(wanted[:, 1] - wanted[:, 0]) < DESIGN.limits.knee[0] - 0.03
    reduced = Linkage(kind=LinkageKind.REDUCED)
    assert np.max(np.abs(rollout(simulated(setup, start, reduced, 2.5e-4), motor) - wanted)) < bound


@pytest.mark.parametrize("kind", FIXED)
def test_bars_converge_to_the_equations_as_their_mass_vanishes(kind: SetupKind) -> None:
    setup, start, motor = case(kind)
    wanted = rollout(AnalyticPlant(DESIGN, setup, start, accuracy=FINE), motor)
    errors = [
        float(
            np.max(
                np.abs(
                    rollout(simulated(setup, start, Linkage(bar_density=density), 2.5e-4), motor)
                    - wanted
                )
            )
        )
        for density in DENSITIES
    ]
    assert all(b < a for a, b in itertools.pairwise(errors))
    assert 0.8 < slope(DENSITIES, errors) < 1.3


@pytest.mark.parametrize("kind", FIXED)
def test_bars_with_their_mass_are_the_bars_of_the_equations(kind: SetupKind) -> None:
    setup, start, motor = case(kind)
    linkage = Linkage()
    bars = Bars(density=linkage.density(DESIGN), crank_length=linkage.crank_length)
    wanted = rollout(AnalyticPlant(DESIGN, setup, start, accuracy=FINE, bars=bars), motor)
    errors = [
        float(np.max(np.abs(rollout(simulated(setup, start, linkage, step), motor) - wanted)))
        for step in (5e-4, 2.5e-4, 1.25e-4)
    ]
    assert errors[-1] < 2e-5
    assert slope((5e-4, 2.5e-4, 1.25e-4), errors) > 1.5
