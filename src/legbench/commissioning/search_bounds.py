"""Bounds of a homing that searches: what the bus file gives, and what the drive holds of it."""

from collections.abc import Iterable

from legbench.drives.errors import DriveError
from legbench.drives.protocol.objects import name_of
from legbench.drives.setup.config import NodeConfig
from legbench.drives.setup.configuration import quick_stop_ramp
from legbench.drives.setup.outcome import ObjectOutcome
from legbench.errors import ConfigError

WINDOW, TORQUE = (0x6065, 0), (0x6072, 0)
"""Following error window and limit of torque, which bound the force at a stop."""


def check_given(node: NodeConfig) -> None:
    """Refuse a search without window, torque and ramp in the bus file; raises ConfigError."""
    given = {parameter.key for parameter in node.parameters if parameter.value > 0}
    needed = (WINDOW, TORQUE, quick_stop_ramp(node))
    missing = [name_of(*key) for key in needed if key not in given]
    if missing:
        raise ConfigError(
            f"a search moves '{node.name}' by itself, and its parameters in the bus file leave "
            f"out {', '.join(missing)}; give each a value"
        )


def check_held(node: NodeConfig, outcomes: Iterable[ObjectOutcome]) -> None:
    """Refuse a search by a drive that did not take its window or torque; raises DriveError.

    Its ramp is judged as that of every quick stop.
    """
    for entry in outcomes:
        if entry.parameter.key in (WINDOW, TORQUE) and not entry.agrees:
            raise DriveError(
                f"a search moves '{node.name}' by itself, not bounded by {entry.name}: "
                f"{entry.why}; home it where it stands, by --method 37, or with its maker's tool"
            )
