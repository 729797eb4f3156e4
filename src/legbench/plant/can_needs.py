"""Whether the drives of a bus tell what a controller needs; pure."""

from legbench.drives.setup.config import BusConfig, NodeConfig
from legbench.drives.setup.encoders import Side
from legbench.errors import ConfigError
from legbench.plant.opening import Needs
from legbench.signals import MEASURED


def known_of(config: BusConfig) -> frozenset[str]:
    """Names of the measured signals that every drive of a bus tells of its joint."""
    known = frozenset(MEASURED)
    for node in config.nodes:
        known &= node.knows
    return known


def check_needs(config: BusConfig, needs: Needs) -> None:
    """Refuse a controller that needs what a drive does not tell.

    Raises:
        ConfigError: the drive, what it does not tell and why, and who can run on it are named.
    """
    for node in config.nodes:
        missing = [name for name in MEASURED if name in needs.signals - node.knows]
        if not missing:
            continue
        others = needs.run_on(known_of(config))
        who = (
            f"of the built-in ones {', '.join(others)} can run"
            if others
            else ("of the built-in ones none can run, --read-only looks on")
        )
        raise ConfigError(
            f"controller {needs.controller} needs {' and '.join(missing)}, which drive "
            f"'{node.name}' does not tell: {_why(node)}; {who}"
        )


def _why(node: NodeConfig) -> str:
    """Why a drive with one encoder does not tell everything, and what would mend it."""
    if node.side is Side.LINK:
        return (
            "its one encoder is at the link, over which its position loop is closed, so that "
            "commands lead the link and no motor behind a spring"
        )
    return "its one encoder is at the motor, and no torque_object stands for that of its spring"
