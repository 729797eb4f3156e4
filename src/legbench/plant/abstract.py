"""Interface of a plant, which everything that can be controlled has.

    with SimPlant(...) as plant:
        observation = plant.reset()
        while ...:
            observation = plant.step(controller.step(observation))

`command_k` is computed from `observation_k` and holds over `[t_k, t_k + period)`; its effect is
first seen in `observation_{k+1}`. Time comes from the plant, waiting from the loop.
"""

from abc import abstractmethod
from collections.abc import Callable

from legbench.closing import Closing
from legbench.signals import Command, Floats, Observation


class AbstractPlant(Closing):
    """One leg, or a batch of legs in step, at a fixed control period."""

    period: float
    """Control period [s]."""

    @abstractmethod
    def reset(self) -> Observation:
        """Put the leg into its initial state and look at it."""

    @abstractmethod
    def step(self, command: Command) -> Observation:
        """Apply a command over one period.

        Raises:
            PlantFault: the plant cannot go on; what it did until then stands.
        """

    def rest(self, motor_pos: Floats, interrupted: Callable[[], bool]) -> str | None:
        """Lead the leg to rest with its motors at a posture, after the last step of a run.

        A leg that nothing can happen to, such as a simulated one, is left as it is: nothing is
        done, a later `step` goes on as if this had not been called. Returns early, and stops
        nothing, once `interrupted` says so; `close` stops.

        Args:
            motor_pos: the posture (..., 2) [rad].
            interrupted: asked in every period.

        Returns:
            What to tell the user about it, None if there is nothing.

        Raises:
            PlantFault: the plant cannot go on; the run ends with this fault.
        """
        return None

    @abstractmethod
    def close(self) -> None:
        """Leave everything safe; may be called twice, never raises."""
