"""Whether a leg is in flight or on the ground, as far as its springs tell for certain; pure."""

from typing import final

SETTLING_TIME = 0.006
"""Time after which a change of contact hardly shows in averages that have been filled since [s]."""
LOADED = 2.0
"""Torque on the knee at which a leg is on the ground for certain, relative to the one up to which
it may be in flight [-]: averages of the last stance still hold the latter while the foot leaves."""


@final
class GroundContact:
    """Judges from the torque on the knee that free fall leaves unexplained, and waits.

    In free fall nothing but its springs turns a knee; on the ground they carry the weight, too.

    Attributes:
        in_flight: the leg is in flight, and has been for long enough.
        on_ground: the leg is on the ground, and averages over a stance have been filled since.
    """

    def __init__(self, light: float, stance_cycles: int, period: float) -> None:
        """Begin with a leg of which nothing is known.

        Args:
            light: torque on the knee up to which it may be in flight [N m].
            stance_cycles: cycles over which averages reach that hold on the ground.
            period: of the cycles [s].
        """
        self._light, self._heavy = light, LOADED * light
        self._settling = round(SETTLING_TIME / period)
        self._stance_cycles = stance_cycles + self._settling
        self.forget()

    def forget(self) -> None:
        """Know nothing, as while a stop pushes at the knee."""
        self._light_cycles = self._heavy_cycles = 0
        self.in_flight = self.on_ground = False

    def after(self, knee: float) -> None:
        """Take the torque on the knee of one more cycle [N m]."""
        load = abs(knee)
        self._light_cycles = self._light_cycles + 1 if load <= self._light else 0
        self._heavy_cycles = self._heavy_cycles + 1 if load > self._heavy else 0
        self.in_flight = self._light_cycles > self._settling
        self.on_ground = self._heavy_cycles > self._stance_cycles
