"""Encoders of a drive: on which side of the series spring they sit, and what they tell; pure."""

from enum import StrEnum

from legbench.drives.protocol.datatypes import FORMATS, range_of
from legbench.drives.protocol.pdo import Mapped
from legbench.drives.setup.units import AxisUnits
from legbench.errors import ConfigError

MOTOR_POS, JOINT_POS, SPRING_TORQUE = "motor_pos", "joint_pos", "spring_torque"
"""Names of the signals of an observation that encoders and torques tell."""


class Side(StrEnum):
    """Sides of a series spring on which the encoder of a drive's position loop may sit."""

    MOTOR = "motor"
    LINK = "link"


def known_signals(side: Side, *, second: bool, torque: bool) -> frozenset[str]:
    """Names of the signals that a drive tells of its joint.

    With a second encoder the spring's torque is stiffness times the difference of both. With the
    drive's torque in its place it is that torque, and the side without an encoder lies beside the
    other one by torque over stiffness. A drive whose position loop is closed over the link leads
    no motor: its position is not among them.

    Args:
        side: side of the encoder of the position loop.
        second: there is another encoder on the other side.
        torque: the drive sends its torque.
    """
    if side is Side.LINK:
        return frozenset((JOINT_POS, SPRING_TORQUE) if torque else (JOINT_POS,))
    return frozenset((MOTOR_POS, JOINT_POS, SPRING_TORQUE) if second or torque else (MOTOR_POS,))


def check_encoder(name: str, axis: str, units: AxisUnits, entry: Mapped) -> None:
    """Refuse units that do not fit the object which shows the position.

    Args:
        name: name of the drive.
        axis: side of the encoder, `motor` or `link`.
        units: units of the position.
        entry: its object.

    Raises:
        ConfigError: another length than the object's, or counts that it does not hold.
    """
    if units.bits != entry.bits:
        raise ConfigError(
            f"node '{name}': {axis} bits is {units.bits}, but {entry} has {entry.bits}"
        )
    if entry.kind not in FORMATS:
        raise ConfigError(f"node '{name}': {axis} position {entry} is no whole number")
    low, high = range_of(entry.kind)
    first, last = units.lowest, units.lowest + units.modulus - 1
    if first < low or last > high:
        raise ConfigError(
            f"node '{name}': {axis} shows {first} to {last} counts, but {entry} holds {low} to "
            f"{high}; correct lowest_count or modulus_counts"
        )


def check_sides(name: str, side: Side, link: AxisUnits | None) -> None:
    """Refuse two encoders on one side of a spring.

    Raises:
        ConfigError: the encoder of the position loop is at the link, and there is another one.
    """
    if side is Side.LINK and link is not None:
        raise ConfigError(
            f"node '{name}' has two encoders at its link; describe the one of the motor as "
            "[node.motor]"
        )
