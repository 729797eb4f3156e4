"""Whether a leg is in flight or in a stance, as far as its springs tell for certain; pure."""

from typing import final

SETTLING_TIME = 0.006
"""Time for which a leg carries little before it is in flight for certain [s]: its averages are then
filled from flight, but for their tails."""
LOADED = 3.0
"""Torque on the knee at which a leg is in a stance for certain, relative to the one up to which it
may be in flight [-]: more than while it stands upright, or while its foot may leave the ground."""


@final
class GroundContact:
    """Judges from the torque on the knee that free fall leaves unexplained, and waits.

    In free fall nothing but its springs turns a knee; on the ground they carry the weight, too, and
    twice that in a stance.

    Attributes:
        in_flight: the leg is in flight, and has been for long enough.
        in_stance: the leg is in a stance, and averages have been filled since it began.
    """

    def __init__(self, light: float, stance_cycles: int, period: float) -> None:
        """Begin with a leg of which nothing is known.

        Args:
            light: torque on the knee up to which it may be in flight [N m].
            stance_cycles: cycles over which averages reach that hold on the ground.
            period: of the cycles [s].
        """
        self._light, self._heavy = light, LOADED * light
        self._settling, self._stance_cycles = round(SETTLING_TIME / period), stance_cycles
        self.forget()

    def forget(self) -> None:
        """Know nothing, as while a stop pushes at the knee."""
        self._light_cycles = self._heavy_cycles = 0
        self.in_flight = self.in_stance = False

    def after(self, knee: float) -> None:
        """Take the torque on the knee of one more cycle [N m]."""
        load = abs(knee)
        self._light_cycles = self._light_cycles + 1 if load <= self._light else 0
        self._heavy_cycles = self._heavy_cycles + 1 if load > self._heavy else 0
        self.in_flight = self._light_cycles > self._settling
        self.in_stance = self._heavy_cycles > self._stance_cycles
