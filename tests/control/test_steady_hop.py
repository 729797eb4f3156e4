"""Hop of the optimal leg after a push along the polar mode, and what steadies it."""

from dataclasses import replace

import pytest

from legbench.control import JumpConfig, make_controller
from legbench.design import LegDesign
from legbench.experiment import Experiment
from legbench.experiment.start import start_of, targets_of
from legbench.kinematics import polar_angle
from legbench.mjcf import Linkage, LinkageKind
from legbench.plant.sim import SimPlant
from legbench.servo import ServoConfig

SETTLED, LATER, END = 6_500, 9_500, 10_500
"""Cycles by which the hop has grown, from which on the push is looked for, and of the end."""
PUSH = 0.02
"""Angle by which the leg is turned about its hip, in the air [rad]."""
LIMITED = ServoConfig(slew_rate=10.0, bandwidth=30.0, delay_cycles=2, encoder_counts=4096)


def polar_rest(design: LegDesign, settings: JumpConfig, servo: ServoConfig) -> float:
    """Largest |x1| in the last of four seconds after the push [rad]."""
    chosen = Experiment(
        design=design, controller=settings, linkage=Linkage(kind=LinkageKind.REDUCED)
    )
    controller = make_controller(chosen.controller, targets_of(chosen))
    largest, airborne, pushed = 0.0, 0, False
    with SimPlant(design, chosen.options, start_of(chosen), servo) as plant:
        seen = plant.reset()
        controller.reset(seen)
        hip = plant.model.joint("hip").qposadr[0]
        for cycle in range(END):
            seen = plant.step(controller.step(seen))
            assert seen.truth is not None
            airborne = 0 if seen.truth.contact else airborne + 1
            if cycle > SETTLED and not pushed and airborne > 60:
                plant.data.qpos[hip] += PUSH
                pushed = True
            if cycle > LATER:
                largest = max(largest, abs(float(polar_angle(seen.joint_pos))))
    assert pushed
    return largest


@pytest.mark.long
@pytest.mark.parametrize("servo", [ServoConfig(), LIMITED], ids=["ideal", "limited"])
def test_a_smaller_push_or_more_damping_steadies_the_hop(
    optimal: LegDesign, servo: ServoConfig
) -> None:
    hip, knee = optimal.damping
    damped = replace(optimal, damping=(1.3 * hip, 1.3 * knee))
    assert polar_rest(optimal, JumpConfig(), servo) > 0.005
    assert polar_rest(optimal, JumpConfig(dz2=0.14), servo) < 0.001
    assert polar_rest(damped, JumpConfig(), servo) < 0.001
