"""The body of emulated drives against the simulated plant, which it moves like to the bit."""

from collections.abc import Callable

import numpy as np
import pytest
from plants import PROTOTYPE, built

from legbench.design.setup import Setup, SetupKind
from legbench.errors import PlantFault
from legbench.imperfections import Imperfections
from legbench.mjcf import LinkageKind
from legbench.plant.emulated_leg import EmulatedLeg
from legbench.plant.sim import SimPlant
from legbench.plant.start import Start
from legbench.signals import Command

START = Start(joint_pos=np.array([-0.6, 0.6]), motor_pos=np.array([-0.6, 0.6]))
FLAWS = Imperfections(
    motor_zero=(0.02, -0.01),
    link_zero=(0.01, 0.0),
    link_noise=(1e-3, 2e-3),
    stiffness_error=(0.05, -0.05),
)


@pytest.mark.parametrize(
    "flaws",
    [Imperfections(), FLAWS, Imperfections(backlash=(0.02, 0.01))],
    ids=["perfect", "flawed", "with play"],
)
@pytest.mark.parametrize("linkage", list(LinkageKind))
@pytest.mark.parametrize("kind", [SetupKind.HFTS, SetupKind.JUMP])
def test_it_moves_as_the_simulated_plant_to_the_bit(
    kind: SetupKind, linkage: LinkageKind, flaws: Imperfections
) -> None:
    """Motors that sway through flight and landings: link angles and spring torques are the same."""
    options = built(Setup(kind=kind), linkage)
    body = EmulatedLeg(PROTOTYPE, options, START, flaws, seed=5)
    plant = SimPlant(PROTOTYPE, options, START, None, flaws, seed=5)
    plant.reset()
    for cycle in range(150):
        sway = 0.3 * np.sin(0.05 * cycle)
        motors = START.motor_pos + np.array([sway, -sway])
        links, torques = body(tuple(motors.tolist()))
        seen = plant.step(Command.holding(motors))
        assert list(links) == seen.joint_pos.tolist()
        assert list(torques) == plant.spring_torque().tolist()


def test_a_body_that_comes_apart_says_so_as_the_plant_does() -> None:
    """Motors that wind the leg up end it with one cause, in the same period."""
    options = built(linkage=LinkageKind.BARS)
    body, plant = EmulatedLeg(PROTOTYPE, options, START), SimPlant(PROTOTYPE, options, START)
    plant.reset()
    motors = np.array([-3.0, 3.0])
    told = [
        _end(lambda: body(tuple(motors.tolist()))),
        _end(lambda: plant.step(Command.holding(motors))),
    ]
    assert told[0] == told[1]


def _end(step: Callable[[], object]) -> tuple[int, str]:
    """Periods until a leg comes apart, and what it says."""
    for period in range(200):
        try:
            step()
        except PlantFault as fault:
            return period, f"{fault.cause}: {fault}"
    raise AssertionError("the leg stays whole")
