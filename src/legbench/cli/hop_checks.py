"""Questions that `legbench hop` refuses before the leg has hopped."""

import math

from legbench.cli.hop_arguments import HopArguments
from legbench.errors import ConfigError
from legbench.modes.basin import GridAxis
from legbench.modes.cycles import LONGEST

LARGE = 250_000
"""Cells of a basin map beyond which it is asked whether that was meant [-]."""
CELL_TIME = 0.004
"""Time that one cell takes one process, about [s]."""


def check(flags: HopArguments) -> None:
    """Refuse what would only be found after the leg has hopped.

    Raises:
        ConfigError: a value makes no sense, or does not go with another one.
    """
    if flags.hops < 1:
        raise ConfigError(f"hops is {flags.hops}; it must be 1 or more")
    if flags.height is not None and not 0.0 < flags.height < math.inf:
        raise ConfigError(f"height is {flags.height:g} m; an apex lies above the ground")
    for name, span in ((flags.across, flags.across_span), (flags.up, flags.up_span)):
        GridAxis(name=name, low=-span, high=span, count=max(flags.basin, 2))
    if flags.across == flags.up:
        raise ConfigError(f"both axes are {flags.up}; a map needs two different ones")
    if flags.period is not None and not 1 <= flags.period <= LONGEST:
        raise ConfigError(f"period is {flags.period} hops; it must be 1 to {LONGEST}")
    if (flags.family is None) != (flags.to is None):
        raise ConfigError("a family needs both --family, what is varied, and --to, how far")
    if flags.passive and (flags.family is not None or flags.period is not None):
        raise ConfigError("--family and --period are for driven hops; leave --passive away")
    if flags.basin == 0:
        return
    if flags.basin < 2:
        raise ConfigError(f"basin is {flags.basin} points a side; it must be 0 (none), 2 or more")
    if flags.out is None:
        raise ConfigError("a basin map needs --out, the folder that it is written to")
    if flags.passive:
        raise ConfigError(
            "a passive leg gains no energy, so no hop draws others from all sides and there is no "
            "basin to map; leave --basin or --passive away"
        )
    if flags.workers < 1:
        raise ConfigError(f"workers is {flags.workers}; a map needs 1 process or more")
    if flags.basin**2 > LARGE and not flags.large:
        hours = flags.basin**2 * CELL_TIME / flags.workers / 3600.0
        raise ConfigError(
            f"basin is {flags.basin} x {flags.basin} = {flags.basin**2} cells, some {hours:.2g} h "
            f"with {flags.workers} processes; take up to {math.isqrt(LARGE)} points a side, or say "
            "--large"
        )
