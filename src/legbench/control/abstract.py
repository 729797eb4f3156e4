"""What the loop asks of a controller."""

from abc import ABC, abstractmethod

from legbench.signals import Command, Floats, Observation


class AbstractController(ABC):
    """Turns observations into commands; knows nothing of the plant behind them."""

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
        """Forget everything; `observation` is the leg at rest."""

    @abstractmethod
    def step(self, observation: Observation) -> Command:
        """The command for the period that begins at `observation.time`."""
