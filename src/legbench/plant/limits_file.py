"""A file of safety limits for a design."""

from pathlib import Path

from legbench.design import LegDesign
from legbench.drives.setup.bus_file import load_limits
from legbench.errors import ConfigError
from legbench.limits.safety import SafetyLimits
from legbench.plant.design_limits import limits_within


def limits_for(path: Path, design: LegDesign) -> SafetyLimits:
    """Limits of a file; a range that it leaves out is the design's.

    Raises:
        ConfigError: the file makes no sense, or is looser than the design.
    """
    limits = load_limits(path)
    try:
        return limits_within(limits, design)
    except ConfigError as error:
        raise ConfigError(f"{path}: {error}") from None
