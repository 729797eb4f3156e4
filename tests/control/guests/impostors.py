"""Classes that are no controllers, each for a reason of its own."""

from dataclasses import dataclass
from typing import ClassVar

from legbench.control import (
    AbstractController,
    ControllerDescription,
    LegTargets,
    PositionJumpConfig,
    SetupKind,
)


class Plain:
    kind = "plain"


@dataclass(frozen=True, kw_only=True)
class NoBuild:
    kind: ClassVar[str] = "no-build"
    usual_setup: ClassVar[SetupKind] = SetupKind.FFS


@dataclass(frozen=True, kw_only=True)
class Thief:
    kind: ClassVar[str] = "jump"
    usual_setup: ClassVar[SetupKind] = SetupKind.FFS

    def build(self, targets: LegTargets) -> AbstractController:
        return PositionJumpConfig().build(targets)

    def describe(self) -> ControllerDescription:
        return PositionJumpConfig().describe()


def function() -> None:
    """No class at all."""
