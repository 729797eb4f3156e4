"""Actual values of an emulated axis: what its objects show of motion, link and torque; pure."""

from collections.abc import Callable, Sequence
from functools import partial
from typing import final

from legbench.drives.emulated.motion import Motion
from legbench.drives.emulated.sensors import Sensors
from legbench.drives.protocol.datatypes import DataType, range_of
from legbench.drives.protocol.objects import LINK_SHORT, Key
from legbench.drives.setup.config import NodeConfig
from legbench.drives.setup.units import wrap

SHORT = (LINK_SHORT, 0)
PERMILLE = range_of(DataType.INTEGER16)
"""Lowest and highest torque that 6077h holds [permille]."""


@final
class ActualValues:
    """Objects that show where an axis is, by how much it lags behind, and its torque."""

    def __init__(
        self, node: NodeConfig, rated_torque: float, values: dict[Key, int], links: Sequence[Key]
    ) -> None:
        """Look the objects of a node up once.

        Args:
            node: configuration, which says what shows the motor, the link and the torque.
            rated_torque: torque of which 6077h shows permille [N m].
            values: numbers of the object dictionary.
            links: objects that show the position of the link.
        """
        self._values, self._rated, self._scale = values, rated_torque, node.torque_scale
        self._motor, self._show_motor = node.motor_object.key, node.motor.show
        self._links = tuple((key, _link_in(key, node)) for key in links if node.link is not None)
        torque = node.torque_object
        self._torque = None if torque is None else (torque.key, range_of(torque.kind))

    def update(
        self, motion: Motion, sensors: Sensors, link_counts: int, spring_torque: float
    ) -> None:
        """Show a motion, the link [counts] and the torque of the spring [N m]."""
        values, sign = self._values, motion.sign
        actual = sensors.motor.show(round(motion.actual + motion.beside))
        demand = round(motion.demand)
        values[self._motor] = self._show_motor(sign * actual)
        values[0x6062, 0] = wrap(sign * demand)
        values[0x60F4, 0] = wrap(sign * (demand - actual))
        if self._links:
            link = sensors.link.show(link_counts)
            for key, shown in self._links:
                values[key] = shown(link)
        values[0x6077, 0] = _saturated(1000.0 * spring_torque / self._rated, PERMILLE)
        if self._torque is not None:
            key, limits = self._torque
            values[key] = _saturated(spring_torque / self._scale, limits)


def _link_in(key: Key, node: NodeConfig) -> Callable[[int], int]:
    """Function that turns a count of the link's encoder into what an object shows of it."""
    if key == node.link_object.key:
        return node.link_units.show
    return partial(wrap, bits=16 if key == SHORT else 32)


def _saturated(value: float, limits: tuple[int, int]) -> int:
    """The nearest number that an object with these limits holds."""
    low, high = limits
    return min(max(round(value), low), high)
