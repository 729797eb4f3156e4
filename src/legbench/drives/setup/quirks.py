"""Habits of a drive in which it differs from the standard and that its master can live with."""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum

from legbench.drives.setup.bus_numbers import WORD
from legbench.errors import ConfigError
from legbench.limits.upper_ends import check_number

USUAL_PATIENCE_MS, LONGEST_PATIENCE_MS = 500, 30_000
"""Usual and longest time that a drive may take to show its mode [ms]."""


class ModeShown(StrEnum):
    """Times from which a drive shows in 6061h the mode that was written to 6060h."""

    CONFIGURED = "configured"
    """The drive shows it as soon as it is configured, before it is enabled."""
    ENABLED = "enabled"
    """The drive shows it only once it is enabled; it is held where it stands until then."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Quirks:
    """Habits of one drive, the table `[node.quirks]` of a bus file.

    Raises:
        ConfigError: a time or a code that makes no sense.
    """

    mode_patience_ms: int = USUAL_PATIENCE_MS
    """Longest time until 6061h shows the mode [ms]; some drives take 3 to 6 s."""
    mode_shown: ModeShown = ModeShown.CONFIGURED
    """Time from which 6061h follows 6060h."""
    follows_bit: bool = True
    """Whether bit 12 of the statusword says that the drive follows its target. Without it a drive
    that ignores its target is found by its following error alone."""
    warnings: tuple[int, ...] = ()
    """Codes of emergency messages that are warnings: they are told in the end and stop nothing. A
    drive that goes into its fault state ends the run whatever its code is."""

    def __post_init__(self) -> None:
        check_number("mode_patience_ms", self.mode_patience_ms, 1, LONGEST_PATIENCE_MS, "ms")
        check_warnings(self.warnings)


def check_warnings(codes: Sequence[int]) -> None:
    """Refuse error codes that do not exist, or say that errors have gone.

    Raises:
        ConfigError: one is not 1 to FFFFh, or stands there twice.
    """
    for code in codes:
        if not 0 < code <= WORD:
            raise ConfigError(f"warnings holds {code:#x}; error codes are 0x1 to 0xFFFF")
        if list(codes).count(code) > 1:
            raise ConfigError(f"warnings holds {code:#06x} twice; give it once")
