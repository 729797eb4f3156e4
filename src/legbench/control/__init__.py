"""Controllers, one in each file, for one leg or a batch, and the types to write another with."""

from typing import TYPE_CHECKING

from legbench.control.abstract import AbstractController
from legbench.control.registry import CONTROLLERS
from legbench.control.setpoint import LegTargets, SetpointMeaning
from legbench.control.settings import ControllerSettings, make_controller, make_controllers
from legbench.design.setup import SetupKind
from legbench.lazily import lazy_names
from legbench.phases import ControllerDescription, Counting, PhaseInfo, Role
from legbench.signals import Command, Observation, Signal

if TYPE_CHECKING:
    from legbench.control.bang_bang import BangBang, BangBangConfig
    from legbench.control.chirp import Chirp, ChirpConfig
    from legbench.control.jump import Jump, JumpConfig
    from legbench.control.position_jump import PositionJump, PositionJumpConfig

__all__ = [
    "CONTROLLERS",
    "AbstractController",
    "BangBang",
    "BangBangConfig",
    "Chirp",
    "ChirpConfig",
    "Command",
    "ControllerDescription",
    "ControllerSettings",
    "Counting",
    "Jump",
    "JumpConfig",
    "LegTargets",
    "Observation",
    "PhaseInfo",
    "PositionJump",
    "PositionJumpConfig",
    "Role",
    "SetpointMeaning",
    "SetupKind",
    "Signal",
    "make_controller",
    "make_controllers",
]
__getattr__ = lazy_names(
    __name__,
    {
        "BangBang": "legbench.control.bang_bang",
        "BangBangConfig": "legbench.control.bang_bang",
        "Chirp": "legbench.control.chirp",
        "ChirpConfig": "legbench.control.chirp",
        "Jump": "legbench.control.jump",
        "JumpConfig": "legbench.control.jump",
        "PositionJump": "legbench.control.position_jump",
        "PositionJumpConfig": "legbench.control.position_jump",
    },
)
