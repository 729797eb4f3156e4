"""Checks of bus and limits files together, before drives are led or observed; pure."""

from collections.abc import Sequence

from legbench.drives.setup.config import BusConfig
from legbench.drives.setup.field_ranges import check_field_ranges
from legbench.drives.setup.master_watch import check_master_watch
from legbench.drives.setup.stopping import check_stopping
from legbench.drives.setup.unknown import check_springs
from legbench.errors import ConfigError
from legbench.limits.safety import Range, SafetyLimits

LONGEST_MS = 50
"""Longest time that a limit in cycles may last where it is not waived [ms]: half of the time in
which drives stop that have lost their master."""
FEWEST_PERIODS = 3
"""Fewest periods without a command after which a drive may fault."""
IN_CYCLES = ("following_cycles", "overrun_cycles", "lost_frames")
"""Limits that are a number of cycles, whatever the period."""


def check_together(
    config: BusConfig,
    limits: SafetyLimits,
    *,
    stops: Sequence[Range] | None = None,
    leads: bool = True,
) -> None:
    """Refuse files that fit each on its own, but not together.

    Args:
        config: the bus.
        limits: limits of the leg, ranges of the design included.
        stops: ranges that the mechanical stops leave the links; by default those of the limits
            [rad].
        leads: drives are commanded, and so have to notice when their master dies.

    Raises:
        ConfigError: a motor runs on too far after a quick stop, an object cannot hold what it is
            to show, or a drive would go on without its master.
    """
    _check_cycles(config, limits)
    check_stopping(config, limits)
    check_field_ranges(config, limits, stops)
    if leads:
        check_springs(config)
        check_master_watch(config, speed=limits.command_speed)


def _check_cycles(config: BusConfig, limits: SafetyLimits) -> None:
    """Refuse limits in cycles, and deadlines in time, that do not fit the period of the bus."""
    for node in config.nodes:
        for pdo in node.rpdos:
            if 0 < 1000 * pdo.deadline_ms < FEWEST_PERIODS * config.period_us:
                raise ConfigError(
                    f"deadline_ms of RPDO{pdo.number} of '{node.name}' is {pdo.deadline_ms} ms, "
                    f"with period_us = {config.period_us} one late command ends the run: raise it "
                    f"to {-(-FEWEST_PERIODS * config.period_us // 1000)} or more"
                )
    for name in IN_CYCLES:
        cycles = getattr(limits, name)
        lasts_ms = 1e-3 * cycles * config.period_us
        if lasts_ms > LONGEST_MS and name not in limits.waive:
            most = int(1000 * LONGEST_MS / config.period_us)
            raise ConfigError(
                f"{name} is {cycles} cycles, {lasts_ms:g} ms with period_us = {config.period_us}; "
                f"the upper end is {LONGEST_MS} ms: lower it to {most}, "
                f'or waive = ["{name}"] in the limits file'
            )
