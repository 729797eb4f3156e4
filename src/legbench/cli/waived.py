"""Saying on stderr what a bus and a limits file waive, before anything is opened."""

from pathlib import Path

from legbench.cli.output import report_error
from legbench.drives.bus_file import load_bus, load_limits
from legbench.drives.waivers import describe_waivers
from legbench.plants import LIMITS_NAME, CanChoice, PlantChoice


def tell_waived(bus: Path | None, limits: Path | None) -> None:
    """Print a line for each protection that the files waive; raises ConfigError as they do."""
    lines = describe_waivers(
        None if bus is None else load_bus(bus), None if limits is None else load_limits(limits)
    )
    for line in lines:
        report_error(line)


def tell_waived_of(choice: PlantChoice) -> None:
    """Print a line for each protection that the files of a plant waive; raises ConfigError."""
    if isinstance(choice, CanChoice):
        tell_waived(choice.bus, choice.limits or choice.bus.parent / LIMITS_NAME)
    else:
        tell_waived(None, choice.limits)
