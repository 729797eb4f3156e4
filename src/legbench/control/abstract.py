"""Interface of a controller, as the loop uses it."""

from abc import ABC, abstractmethod
from collections.abc import Mapping
from types import MappingProxyType
from typing import Final

from legbench.signals import Command, Floats, Observation

NO_ERRORS: Final[Mapping[int, Exception]] = MappingProxyType({})


class AbstractController(ABC):
    """Controller that turns observations into commands; it knows nothing of the plant."""

    @property
    @abstractmethod
    def start_motor_pos(self) -> Floats:
        """Motor positions (..., 2) [rad] that a run begins at rest with, and ends at on drives."""

    @property
    def law(self) -> "AbstractController":
        """Controller whose source a fault shows: this one, or the one that it wraps."""
        return self

    def law_of(self, leg: int) -> "AbstractController":
        """Controller of one leg of a batch, whose source a fault shows."""
        return self

    @property
    def leg_errors(self) -> Mapping[int, Exception]:
        """Legs of a batch that are not controlled any more, by number, each with what went wrong.

        Such a leg gets commands that mean nothing, and the others go on. A controller of one leg
        raises instead.
        """
        return NO_ERRORS

    @abstractmethod
    def reset(self, observation: Observation) -> None:
        """Begin anew; `observation` shows the leg at rest."""

    @abstractmethod
    def step(self, observation: Observation) -> Command:
        """Return the command for the period that begins at `observation.time`."""
