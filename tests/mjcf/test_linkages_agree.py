"""Bars against reduced, undamped, released by 0.3 rad in z2: states, loop gaps, energy.

The set point is z2 = 1.0 rad, the paper's. How far both linkages drift apart in 0.5 s grows a
little with the swing's period.
"""

from dataclasses import dataclass, replace
from functools import cache

import numpy as np
import pytest
from mjcf_legs import MODELS_BY_NAME, options

from legbench.design.statics import motor_holding
from legbench.kinematics import modal_to_joint
from legbench.plant.sim import SimPlant
from legbench.plant.start import Start
from legbench.signals import Command, Floats, Observation

SET_POINT, DEFLECTION, CYCLES = 1.0, 0.3, 500
WITHOUT_IMPACT = ["hfts", "vfts", "ffs", "boom"]
DENSITIES = (0.012, 0.006, 0.003)
DEFAULT_DENSITY = 0.006


@dataclass(frozen=True, kw_only=True)
class Release:
    joint_pos: Floats
    loop_gap: float
    energy_drift: float
    """Over the peak kinetic energy [-]."""


@cache
def released(name: str, setup: str, linkage: str, density: float) -> Release:
    design = replace(MODELS_BY_NAME[name], damping=(0.0, 0.0))
    chosen = options(setup, linkage, density)
    rest = modal_to_joint(np.array([0.0, SET_POINT]))
    motor_pos = motor_holding(design, rest, chosen.setup.support)
    begin = modal_to_joint(np.array([0.0, SET_POINT + DEFLECTION]))
    plant = SimPlant(design, chosen, Start(joint_pos=begin, motor_pos=motor_pos))
    command = Command.holding(motor_pos)
    seen = [plant.reset(), *(plant.step(command) for _ in range(CYCLES))]
    stiffness = np.array(design.stiffness)

    def energy(one: Observation) -> float:
        assert one.truth is not None
        stretch = one.motor_pos - one.joint_pos
        return float(np.sum(one.truth.energy) + 0.5 * np.sum(stiffness * stretch**2))

    energies = np.array([energy(one) for one in seen])
    truths = [one.truth for one in seen if one.truth is not None]
    peak = max(float(truth.energy[1]) for truth in truths)
    return Release(
        joint_pos=np.array([one.joint_pos for one in seen]),
        loop_gap=max(float(np.max(truth.loop_gap)) for truth in truths),
        energy_drift=float(np.max(np.abs(energies - energies[0]))) / peak,
    )


@pytest.mark.parametrize("setup", WITHOUT_IMPACT)
@pytest.mark.parametrize("name", [pytest.param("optimal", marks=pytest.mark.long), "prototype"])
def test_bars_move_as_the_constraint_they_make(name: str, setup: str) -> None:
    massless = released(name, setup, "reduced", DEFAULT_DENSITY).joint_pos
    assert np.ptp(massless[:, 1]) > 0.3
    apart = [
        float(np.max(np.abs(released(name, setup, "bars", density).joint_pos - massless)))
        for density in DENSITIES
    ]
    assert apart[DENSITIES.index(DEFAULT_DENSITY)] < 0.03
    assert apart[0] > 1.6 * apart[1] > 1.6 * 1.6 * apart[2] > 0.0


@pytest.mark.parametrize("setup", WITHOUT_IMPACT)
@pytest.mark.parametrize("name", MODELS_BY_NAME)
def test_loops_stay_closed(name: str, setup: str) -> None:
    # How the gap depends on the bars' mass is a matter of the linkage, not of the leg.
    for density in DENSITIES if name == "prototype" else (DEFAULT_DENSITY,):
        assert 0.0 < released(name, setup, "bars", density).loop_gap < 2e-5
    assert released(name, setup, "reduced", DEFAULT_DENSITY).loop_gap == 0.0


@pytest.mark.parametrize("linkage", ["bars", "reduced"])
@pytest.mark.parametrize("setup", WITHOUT_IMPACT)
@pytest.mark.parametrize("name", MODELS_BY_NAME)
def test_energy_is_kept(name: str, setup: str, linkage: str) -> None:
    assert released(name, setup, linkage, DEFAULT_DENSITY).energy_drift < 1e-3


@pytest.mark.parametrize("setup", ["hfts", "vfts", "ffs"])
def test_an_undamped_leg_finds_its_way_back(setup: str) -> None:
    """Time runs backwards when every velocity is turned round."""
    design = replace(MODELS_BY_NAME["optimal"], damping=(0.0, 0.0))
    chosen = options(setup, "reduced")
    rest = modal_to_joint(np.array([0.0, SET_POINT]))
    motor_pos = motor_holding(design, rest, chosen.setup.support)
    begin = rest + np.array([-0.1, 0.25])
    plant = SimPlant(design, chosen, Start(joint_pos=begin, motor_pos=motor_pos))
    away = plant.reset()
    command = Command.holding(motor_pos)
    for _ in range(200):
        away = plant.step(command)
    assert np.max(np.abs(away.joint_pos - begin)) > 0.1
    plant.data.qvel[:] *= -1.0
    back = away
    for _ in range(200):
        back = plant.step(command)
    assert np.max(np.abs(back.joint_pos - begin)) < 1e-5
    assert np.max(np.abs(back.joint_vel)) < 1e-3
