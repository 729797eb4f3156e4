"""The leg on a boom: its equations against the simulated rig of bodies, hinges and a pin."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from legbench.analytic import Accuracy, Bars
from legbench.design import LegDesign, load_design
from legbench.design.setup import Setup, SetupKind
from legbench.design.statics import motor_holding
from legbench.errors import ConfigError
from legbench.imperfections import Imperfections
from legbench.mjcf import BuildOptions, Linkage, LinkageKind, Numerics
from legbench.plant.abstract import AbstractPlant
from legbench.plant.analytic import AnalyticPlant
from legbench.plant.sim import SimPlant
from legbench.plant.start import Start
from legbench.signals import Command, Floats, Observation

DESIGN = load_design(Path(__file__).parents[2] / "models" / "prototype.toml")
FINE = Accuracy(rtol=1e-12, atol=1e-14)
SHORT = Setup(kind=SetupKind.FFS, boom_radius=0.4)
"""A boom that is three times as long as the leg is high: it turns by 0.3 rad."""
REDUCED = Linkage(kind=LinkageKind.REDUCED)
SWING = np.array([-0.65, 0.65])


def start_of(posture: tuple[float, float], setup: Setup = SHORT) -> Start:
    joint_pos = np.array(posture)
    return Start(joint_pos=joint_pos, motor_pos=motor_holding(DESIGN, joint_pos, setup.support))


OFF_MODE = start_of((-0.85, 0.80))


def rollout(plant: AbstractPlant, cycles: int, posture: Floats = SWING) -> list[Observation]:
    """Observations after a step of the motors."""
    plant.reset()
    motor = motor_holding(DESIGN, posture, SHORT.support)
    return [plant.step(Command.holding(motor)) for _ in range(cycles)]


def simulated(
    step: float,
    setup: Setup = SHORT,
    linkage: Linkage = REDUCED,
    start: Start = OFF_MODE,
    imperfections: Imperfections | None = None,
) -> SimPlant:
    numerics = Numerics(timestep=step, loop_solref=(step, 1.0))
    options = BuildOptions(setup=setup, linkage=linkage, numerics=numerics)
    return SimPlant(DESIGN, options, start, imperfections=imperfections or Imperfections())


def truth(seen: list[Observation], name: str) -> Floats:
    return np.array([getattr(one.truth, name) for one in seen])


def angles(seen: list[Observation]) -> Floats:
    return np.array([one.joint_pos for one in seen])


def test_the_simulated_boom_converges_to_the_equations() -> None:
    """Posture, trunk, force of the pin and both energies, on a boom with a damped pivot."""
    flaws = Imperfections(guide_damping=(0.8, 0.5))
    with_guide = AnalyticPlant(DESIGN, SHORT, OFF_MODE, accuracy=FINE, imperfections=flaws)
    wanted = rollout(with_guide, 120)
    assert np.ptp(angles(wanted)[:, 1]) > 0.05
    errors = []
    for step in (5e-4, 2.5e-4):
        found = rollout(simulated(step, imperfections=flaws), 120)
        errors.append(np.max(np.abs(angles(found) - angles(wanted))))
    assert errors[1] < 1e-6
    assert 3.5 < errors[0] / errors[1] < 4.5
    for name, bound in (("trunk_pos", 1e-6), ("trunk_vel", 2e-5), ("energy", 1e-5)):
        assert np.max(np.abs(truth(found, name) - truth(wanted, name))) < bound, name
    # The simulation reports the force of its last step.
    force = np.abs(truth(found, "contact_force") - truth(wanted, "contact_force"))
    assert np.max(force) < 0.05 < 5.0 < np.max(truth(wanted, "contact_force"))
    assert not truth(wanted, "foot_pos").any()


def test_bars_that_have_mass_turn_with_the_boom_too() -> None:
    linkage = Linkage()
    bars = Bars(density=linkage.density(DESIGN), crank_length=linkage.crank_length)
    wanted = angles(rollout(AnalyticPlant(DESIGN, SHORT, OFF_MODE, accuracy=FINE, bars=bars), 60))
    without = angles(rollout(AnalyticPlant(DESIGN, SHORT, OFF_MODE, accuracy=FINE), 60))
    found = angles(rollout(simulated(2.5e-4, linkage=linkage), 60))
    assert np.max(np.abs(found - wanted)) < 5e-6
    assert np.max(np.abs(found - without)) > 5e-5


def test_a_knee_on_a_boom_meets_its_stop() -> None:
    """But for the inertia in the impedance: the simulator takes that of a reference posture."""
    start, straight = start_of((-0.20, 0.20)), np.array([-0.10, 0.08])
    plant = AnalyticPlant(DESIGN, SHORT, start, accuracy=FINE)
    wanted = angles(rollout(plant, 60, straight))
    assert np.min(wanted[:, 1] - wanted[:, 0]) < DESIGN.limits.knee[0] - 0.01
    found = angles(rollout(simulated(2.5e-4, start=start), 60, straight))
    assert np.max(np.abs(found - wanted)) < 2e-3


def test_a_boom_without_damping_keeps_its_energy() -> None:
    free: LegDesign = replace(DESIGN, damping=(0.0, 0.0))
    plant = AnalyticPlant(free, SHORT, OFF_MODE, accuracy=FINE)
    seen = rollout(plant, 60)
    spring = 0.5 * np.sum(
        np.array([one.spring_torque for one in seen]) ** 2 / np.array(free.stiffness), axis=-1
    )
    kinetic = truth(seen, "energy")[:, 1]
    whole = truth(seen, "energy").sum(axis=-1) + spring
    assert np.ptp(kinetic) > 1e-3
    assert np.ptp(whole) < 1e-11


def test_a_long_boom_guides_as_a_plane_does() -> None:
    """What is left goes as the square of the leg's size over the boom's length."""
    plane = Setup(kind=SetupKind.FFS)
    wanted = angles(rollout(AnalyticPlant(DESIGN, plane, OFF_MODE, accuracy=FINE), 40))
    away = []
    for radius in (20.0, 80.0):
        setup = Setup(kind=SetupKind.FFS, boom_radius=radius)
        found = angles(rollout(AnalyticPlant(DESIGN, setup, OFF_MODE, accuracy=FINE), 40))
        away.append(np.max(np.abs(found - wanted)))
    assert away[1] < 1e-6
    assert 14.0 < away[0] / away[1] < 18.0


def test_a_boom_shorter_than_the_leg_is_refused() -> None:
    setup = Setup(kind=SetupKind.FFS, boom_radius=0.2)
    with pytest.raises(ConfigError, match=r"boom_radius is 0\.2 m; a boom that is shorter"):
        AnalyticPlant(DESIGN, setup, OFF_MODE)
