"""Saying on stderr what a bus and a limits file waive, before anything is opened."""

from pathlib import Path

from legbench.cli.output import report_error
from legbench.drives.setup.bus_file import load_bus, load_limits
from legbench.drives.setup.waivers import describe_waivers
from legbench.limits.safety import SafetyLimits
from legbench.plants import LIMITS_NAME, CanChoice, PlantSettings


def tell_waived(bus: Path | None, limits: SafetyLimits | None) -> None:
    """Print a line for each protection that a bus file and limits waive; raises ConfigError."""
    for line in describe_waivers(None if bus is None else load_bus(bus), limits):
        report_error(line)


def tell_waived_of(choice: PlantSettings) -> None:
    """Print a line for each protection that the files of a plant waive; raises ConfigError."""
    if isinstance(choice, CanChoice):
        beside = choice.bus.parent / LIMITS_NAME
        tell_waived(choice.bus, choice.limits or load_limits(beside))
        return
    limits = getattr(choice, "limits", None)
    tell_waived(None, limits if isinstance(limits, SafetyLimits) else None)
