"""Saying on stderr what a bus and a limits file waive, before anything is opened."""

from pathlib import Path

from legbench.cli.output import report_error
from legbench.drives.setup.bus_file import load_bus, load_limits
from legbench.drives.setup.config import BusConfig
from legbench.drives.setup.waivers import describe_waivers
from legbench.limits.safety import SafetyLimits
from legbench.plants import LIMITS_NAME, CanChoice, PlantSettings


def note_waived(bus: Path | None, limits: SafetyLimits | None) -> None:
    """Print a line for each protection that a bus file and limits waive; raises ConfigError."""
    _tell(None if bus is None else load_bus(bus), limits)


def note_waived_of(choice: PlantSettings) -> None:
    """Print a line for each protection that the files of a plant waive; raises ConfigError."""
    if isinstance(choice, CanChoice):
        # The bus file was named, the limits beside it are only guessed: it is missed first.
        config = load_bus(choice.bus_file)
        _tell(config, choice.limits or load_limits(choice.bus_file.parent / LIMITS_NAME))
        return
    limits = getattr(choice, "limits", None)
    _tell(None, limits if isinstance(limits, SafetyLimits) else None)


def _tell(config: BusConfig | None, limits: SafetyLimits | None) -> None:
    for line in describe_waivers(config, limits):
        report_error(line)
