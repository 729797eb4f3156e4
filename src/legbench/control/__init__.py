"""Controllers: one a file, for one leg or a batch with the same code."""

from legbench.control.abstract import AbstractController
from legbench.control.bang_bang import BangBang, BangBangConfig
from legbench.control.jump import Jump, JumpConfig
from legbench.control.position_jump import PositionJump, PositionJumpConfig
from legbench.control.registry import CONTROLLERS
from legbench.control.setpoint import LegTargets, SetpointMeaning
from legbench.control.settings import ControllerSettings, make_controller

__all__ = [
    "CONTROLLERS",
    "AbstractController",
    "BangBang",
    "BangBangConfig",
    "ControllerSettings",
    "Jump",
    "JumpConfig",
    "LegTargets",
    "PositionJump",
    "PositionJumpConfig",
    "SetpointMeaning",
    "make_controller",
]
