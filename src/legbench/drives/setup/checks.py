"""What bus and limits files must fulfil together before drives are led or looked at; pure."""

from collections.abc import Sequence

from legbench.drives.setup.config import BusConfig
from legbench.drives.setup.field_ranges import check_field_ranges
from legbench.drives.setup.master_watch import check_master_watch
from legbench.drives.setup.stopping import check_stopping
from legbench.limits.safety import Range, SafetyLimits


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
    check_stopping(config, limits)
    check_field_ranges(config, limits, stops)
    if leads:
        check_master_watch(config, speed=limits.command_speed)
