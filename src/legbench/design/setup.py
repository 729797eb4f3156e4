"""The paper's four ways of holding a leg (section VI-B, VI-C)."""

import math
from dataclasses import dataclass
from enum import StrEnum

from legbench.choices import choose
from legbench.design.leg import LegDesign
from legbench.design.statics import Support
from legbench.errors import ConfigError


class SetupKind(StrEnum):
    """Which parts are fixed and where gravity points."""

    HFTS = "hfts"
    """Horizontal fixed trunk: the motion plane lies flat, gravity does no work."""
    VFTS = "vfts"
    """Vertical fixed trunk: the leg hangs, gravity acts along it."""
    FFS = "ffs"
    """Fixed foot: the foot is pinned, the trunk moves, rotation locked."""
    JUMP = "jump"
    """Hopping in place: the trunk moves in x and z, rotation locked, foot against the ground."""


SUPPORTS = {
    SetupKind.HFTS: Support.NONE,
    SetupKind.VFTS: Support.TRUNK,
    SetupKind.FFS: Support.FOOT,
    SetupKind.JUMP: Support.FOOT,
}


@dataclass(frozen=True, slots=True, kw_only=True)
class Setup:
    """A setup and its dimensions.

    Raises:
        ConfigError: a boom where there is none, or one without length.
    """

    kind: SetupKind = SetupKind.JUMP
    boom_radius: float | None = None
    """Length of the boom that guides the trunk in `ffs` [m]; none: a perfect plane."""

    def __post_init__(self) -> None:
        choose(self, kind=SetupKind)
        if self.boom_radius is None:
            return
        if self.kind is not SetupKind.FFS:
            raise ConfigError(f"setup {self.kind} has no boom; boom_radius belongs to ffs")
        if not 0.0 < self.boom_radius < math.inf:
            raise ConfigError(
                f"boom_radius is {self.boom_radius:g} m; it must be positive and finite"
            )

    def check_boom(self, design: LegDesign) -> None:
        """Refuse a boom that a leg is too long for.

        Raises:
            ConfigError: the boom is shorter than the stretched leg.
        """
        reach = sum(design.lengths)
        if self.boom_radius is not None and self.boom_radius < reach:
            raise ConfigError(
                f"setup.boom_radius is {self.boom_radius:g} m; a boom that is shorter than the "
                f"stretched leg, {reach:.3g} m, cannot carry its trunk; take a longer one, or none "
                "for a plane"
            )

    @property
    def support(self) -> Support:
        """Support that carries the weight at rest."""
        return SUPPORTS[self.kind]

    @property
    def trunk_moves(self) -> bool:
        """Whether the trunk is free in the plane."""
        return self.kind in (SetupKind.FFS, SetupKind.JUMP)
