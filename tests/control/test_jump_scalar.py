"""One leg in plain floats obeys the law of a batch in arrays, to the bit."""

import numpy as np
import pytest

from legbench.control import Jump, JumpConfig, LegTargets
from legbench.design import LegDesign
from legbench.design.statics import Support
from legbench.signals import Observation

STEPS = 60_000


def observed(time: float, motor_pos: np.ndarray, torque: np.ndarray) -> Observation:
    zero = np.zeros(motor_pos.shape)
    return Observation(
        time=time,
        motor_pos=motor_pos,
        joint_pos=zero,
        joint_vel=zero,
        spring_torque=torque,
        applied_pos=motor_pos,
    )


@pytest.mark.parametrize("turn", [0.001, 0.01])
def test_one_leg_and_a_batch_of_one_never_differ(prototype: LegDesign, turn: float) -> None:
    """Loads wander through every phase; half of the steps with each setting."""
    config = JumpConfig(delay=0.01, release_time=0.004, touchdown_time=0.006, apex_turn=turn)
    one = Jump(config, LegTargets(designs=prototype, support=Support.FOOT))
    batch = Jump(config, LegTargets(designs=[prototype], support=Support.FOOT))
    rng = np.random.default_rng(11)
    rest = one.start_motor_pos
    standing = np.array([0.3, -0.3])
    one.reset(observed(0.0, rest, standing))
    batch.reset(observed(0.0, rest[np.newaxis], standing[np.newaxis]))
    steps = STEPS // 2
    swing = np.cumsum(rng.normal(0.0, 0.25, steps)) * 0.2
    loads = 0.3 + 0.6 * np.sin(0.02 * np.arange(steps) + swing) + rng.normal(0.0, 0.05, steps)
    different, seen = 0, set()
    for step, load in enumerate(loads.tolist()):
        torque = np.array([load, -load])
        single = one.step(observed(1e-3 * step, rest, torque))
        rows = batch.step(observed(1e-3 * step, rest[np.newaxis], torque[np.newaxis]))
        seen.add(int(single.phase))
        same = single.motor_pos.tobytes() == rows.motor_pos[0].tobytes()
        different += not (same and single.phase == rows.phase[0])
    assert different == 0
    assert seen == {0, 5, 6, 7, 8}
