"""Description of a controller, by which its runs are measured and drawn without its name.

A phase is what a controller is doing, recorded as a number in every row. Its role says what that
means for the leg; metrics and pictures ask for roles alone.
"""

import math
from dataclasses import dataclass
from enum import StrEnum

from legbench.errors import ConfigError
from legbench.signals import Signal

LARGEST_CODE = 127
"""Largest code of a phase: phases are recorded as signed bytes."""


class Role(StrEnum):
    """Role of a phase: what it means for the leg."""

    REST = "rest"
    """The rest posture is held; nothing has been commanded yet."""
    ACTING = "acting"
    """The controller moves the leg; whether its foot stands is not said."""
    STANCE = "stance"
    """The foot stands on the ground."""
    FLIGHT = "flight"
    """The leg is in the air."""


@dataclass(frozen=True, slots=True, kw_only=True)
class PhaseInfo:
    """One phase of a controller.

    Raises:
        ConfigError: a code that a recording cannot hold, or a lateness that makes no sense.
    """

    code: int
    """Number in the phase column of a recording, 0 to 127."""
    name: str
    """Lower-case word for tables and legends."""
    role: Role
    doc: str = ""
    """Sentence for readers of a run."""
    late: float = 0.0
    """Time after which the controller tells the phase: it began so much earlier [s]."""

    def __post_init__(self) -> None:
        if not 0 <= self.code <= LARGEST_CODE:
            raise ConfigError(
                f"phase '{self.name}' has code {self.code}; a recording holds 0 to {LARGEST_CODE}"
            )
        if not 0.0 <= self.late < math.inf:
            raise ConfigError(
                f"phase '{self.name}' is told {self.late:g} s late; it must be 0 s or more"
            )


@dataclass(frozen=True, slots=True, kw_only=True)
class Counting:
    """Oscillation periods of a run that count in its rating: the leading ones (Fig. 5)."""

    most: int | None = None
    """Largest number of periods; none: all."""
    smallest: float = 0.0
    """Amplitude that a period must exceed; the first that does not ends the count [rad]."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ControllerDescription:
    """Description of a controller: what it leaves in a recording and how that is measured.

    Raises:
        ConfigError: two phases share a code or a name.
    """

    phases: tuple[PhaseInfo, ...]
    signals: tuple[Signal, ...] = ()
    """Own signals of the controller, which are recorded with every row."""
    counting: Counting = Counting()

    def __post_init__(self) -> None:
        for words, values in (
            ("code", [phase.code for phase in self.phases]),
            ("name", [phase.name for phase in self.phases]),
        ):
            if len(set(values)) != len(values):
                raise ConfigError(f"two phases of a controller share a {words}: {values}")
