"""What is not known of joints whose drives have one encoder, and what is not watched then; pure."""

from legbench.drives.setup.config import BusConfig, NodeConfig
from legbench.drives.setup.encoders import JOINT_POS, SPRING_TORQUE, Side
from legbench.errors import ConfigError
from legbench.limits.upper_ends import SPRING_WATCH

WITHOUT_LINK = "joint_range, joint_knee_range, joint_speed, standing and sway do not act"


def describe_unknown(config: BusConfig) -> tuple[str, ...]:
    """Return one line for each drive with one encoder: what is not known, and what does not act."""
    return tuple(_line(node) for node in config.nodes if node.link is None)


def _line(node: NodeConfig) -> str:
    head = f"drive '{node.name}' has one encoder, at the {node.side}"
    other = "link" if node.side is Side.MOTOR else "motor"
    if node.torque_object is not None:
        return (
            f"{head}: spring torque is the drive's own ({node.torque_object}), with inertia and "
            f"friction, and the {other}'s position follows from it; joint_speed, standing and sway "
            "do not act"
        )
    lost = (
        WITHOUT_LINK if JOINT_POS not in node.knows else "joint_speed, standing and sway do not act"
    )
    return (
        f"{head}, and sends no torque: spring torque and the {other}'s position are not known; "
        f"spring_torque, {lost}"
    )


def check_springs(config: BusConfig) -> None:
    """Refuse to lead drives whose spring torque nobody knows, unless the bus file waives it.

    Raises:
        ConfigError: a drive tells no spring torque.
    """
    if SPRING_WATCH in config.waive:
        return
    for node in config.nodes:
        if SPRING_TORQUE not in node.knows:
            raise ConfigError(
                f"the spring torque of '{node.name}' is not known, and its limit would not act: "
                "its drive has one encoder and sends no torque; give torque_object and "
                "torque_scale, or "
                f'waive = ["{SPRING_WATCH}"] in the bus file'
            )
