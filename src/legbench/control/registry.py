"""Controllers by name: built in, installed beside legbench, or in a file."""

from typing import Final

from legbench.guests import Registry

CONTROLLERS: Final = Registry(
    what="controller",
    builtin={
        "jump": "legbench.control.jump:JumpConfig",
        "bang-bang": "legbench.control.bang_bang:BangBangConfig",
        "position-jump": "legbench.control.position_jump:PositionJumpConfig",
        "chirp": "legbench.control.chirp:ChirpConfig",
    },
    group="legbench.controllers",
    members={
        "usual_setup": "usual_setup: ClassVar[SetupKind]",
        "build": "build(targets) -> AbstractController",
        "describe": "describe() -> ControllerDescription",
    },
)
"""Registry of every controller."""
