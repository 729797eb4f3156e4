"""Interface of a controller, as the loop uses it."""

from abc import ABC, abstractmethod

from legbench.signals import Command, Floats, Observation


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

    @abstractmethod
    def reset(self, observation: Observation) -> None:
        """Begin anew; `observation` shows the leg at rest."""

    @abstractmethod
    def step(self, observation: Observation) -> Command:
        """Return the command for the period that begins at `observation.time`."""
