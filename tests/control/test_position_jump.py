import numpy as np
import pytest
from torque_traces import Pulled

from legbench.control import LegTargets, PositionJump, PositionJumpConfig
from legbench.control.jump_rules import JumpPhase
from legbench.control.position_jump import PositionJumpPhase
from legbench.design import LegDesign
from legbench.design.statics import Support
from legbench.errors import ConfigError
from legbench.kinematics import joint_to_modal


@pytest.mark.parametrize("many", [False, True])
def test_one_step_at_the_delay_for_good(
    optimal: LegDesign, prototype: LegDesign, many: bool
) -> None:
    targets = LegTargets(designs=[optimal, prototype] if many else optimal, support=Support.NONE)
    controller = PositionJump(PositionJumpConfig(z2=1.0, dz2=0.3, delay=0.01), targets)
    assert np.allclose(joint_to_modal(controller.start_motor_pos)[..., 1], 1.3)
    leg = Pulled(controller, np.zeros(2) if many else 0.0)
    for _ in range(10):
        command = leg.pull(np.zeros(2) if many else 0.0)
        assert np.all(command.phase == JumpPhase.REST)
        assert np.allclose(joint_to_modal(command.motor_pos)[..., 1], 1.3)
    for _ in range(50):
        command = leg.pull(np.ones(2) if many else 1.0)
        assert np.all(command.phase == PositionJumpPhase.STEPPED)
        assert np.allclose(joint_to_modal(command.motor_pos)[..., 1], 1.0)


def test_both_ends_must_be_reachable(optimal: LegDesign) -> None:
    targets = LegTargets(designs=optimal, support=Support.NONE)
    with pytest.raises(ConfigError, match=r"set point z2 \+ dz2 = 2\.2 rad"):
        PositionJump(PositionJumpConfig(z2=1.9, dz2=0.3), targets)
    with pytest.raises(ConfigError, match=r"set point z2 = 0\.1 rad"):
        PositionJump(PositionJumpConfig(z2=0.1, dz2=0.3), targets)
