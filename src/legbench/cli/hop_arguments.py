"""Flags of `legbench hop`."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated

import tyro

from legbench.cli.parse import OrNone
from legbench.control import JumpConfig
from legbench.modes.settings import Setting


@dataclass(frozen=True, slots=True, kw_only=True)
class HopArguments:
    """Compute the hopping of a leg as a map from apex to apex."""

    design: Annotated[Path, tyro.conf.Positional]
    """Design file."""
    passive: bool = False
    """Whether motors are held and damping is left out, instead of the jump controller."""
    rest: float = 0.9
    """Set point z2 of the standing leg, orthonormal, for passive hops [rad]."""
    jump: JumpConfig = field(default_factory=JumpConfig)
    height: OrNone[float] = None
    """Apex of the centre of mass to start from [m]; none: 30 mm over standing."""
    hops: int = 60
    """Number of hops after which the leg should be periodic."""
    period: OrNone[int] = None
    """Number of hops after which the motion is to repeat; none: as it settles."""
    family: OrNone[Setting] = None
    """Setting over which the periodic hop is followed, from its present value to --to."""
    to: OrNone[float] = None
    """Value of that setting at which the family ends [rad, or a factor]."""
    basin: int = 0
    """Number of points on each side of the basin map; 0 makes none."""
    across: str = "z1"
    """Coordinate that varies to the right in the basin map."""
    across_span: float = 0.6
    """Range of that coordinate to either side, in metres, radians and seconds."""
    up: str = "speed"
    """Coordinate that varies upwards in the basin map."""
    up_span: float = 2.5
    """Range of that coordinate to either side, in metres, radians and seconds."""
    large: bool = False
    """Whether to map a basin of more than 250 000 cells all the same."""
    workers: int = 2
    """Number of processes that compute the basin map."""
    out: OrNone[Path] = None
    """Folder for hop.json, pictures and the basin's rows; a map begun there is continued."""
    json: bool = False
    """Whether to print one JSON object instead of tables."""
