"""What the drives say of themselves, in words; by SDO, nothing is written."""

from dataclasses import dataclass

from legbench.drives.master.preparation import is_homed
from legbench.drives.master.sdo_port import SdoPort
from legbench.drives.master.session import Session
from legbench.drives.protocol.cia402 import Mode, describe_statusword
from legbench.drives.protocol.datatypes import DataType
from legbench.drives.protocol.emcy import MEANINGS
from legbench.drives.setup.config import NodeConfig

MODES = {mode.value: mode.name.lower().replace("_", " ") for mode in Mode}


@dataclass(frozen=True, slots=True, kw_only=True)
class NodeStatus:
    """One drive."""

    name: str
    node_id: int
    statusword: str
    mode: str
    error: str
    side: str
    """Side of the spring on which the encoder of the position loop sits: motor or link."""
    motor_pos: float
    """Angle of that encoder [rad]."""
    link_pos: float | None
    """None without an encoder there [rad]."""
    motor_counts: int
    link_counts: int | None
    temperature: float | None
    """[deg C]"""
    homed: bool | None
    """Whether the drive says that it is homed; none if it need not be."""


def read_counts(session: Session, node: NodeConfig) -> tuple[int, int | None]:
    """Encoders as shown, not unwrapped, the second one none without it [counts].

    Raises:
        DriveError: the drive does not answer.
    """
    return _counts(session.bring_up().sdo(node), node)


def _counts(sdo: SdoPort, node: NodeConfig) -> tuple[int, int | None]:
    motor, link = node.motor_object, node.link_object
    shown = sdo.get_int(motor.index, motor.sub, motor.kind)
    if node.link is None:
        return shown, None
    return shown, sdo.get_int(link.index, link.sub, link.kind)


def status(session: Session) -> list[NodeStatus]:
    """All drives of the bus file.

    Raises:
        BusError: nobody can be asked, such as at a wrong bitrate.
        DriveError: one does not answer.
    """
    up = session.bring_up()
    with up.contact():
        nodes = session.config.nodes
        return [_status(up.sdo(node), node, is_homed(up, node)) for node in nodes]


def _status(sdo: SdoPort, node: NodeConfig, homed: bool | None) -> NodeStatus:
    motor, link = _counts(sdo, node)
    mode = sdo.get_int(0x6061, 0, DataType.INTEGER8)
    code = sdo.find_int(0x603F, 0, DataType.UNSIGNED16)
    heat = node.temperature_object
    celsius = None
    if heat is not None:
        celsius = node.temperature_scale * sdo.get_number(heat.index, heat.sub, heat.kind)
    motor_pos, link_pos = node.motor.to_rad(motor), None
    if node.link is not None and link is not None:
        near = node.link.to_counts(motor_pos)
        link_pos = node.link.to_rad(node.link.nearest(link, near))
    return NodeStatus(
        name=node.name,
        node_id=node.node_id,
        statusword=describe_statusword(sdo.get_int(0x6041, 0, DataType.UNSIGNED16)),
        mode=MODES.get(mode, str(mode)),
        error=_error(code),
        side=node.side.value,
        motor_pos=motor_pos,
        link_pos=link_pos,
        motor_counts=motor,
        link_counts=link,
        temperature=celsius,
        homed=homed,
    )


def _error(code: int | None) -> str:
    """Error code 603Fh in words; none stands for a drive that has no such object."""
    if code is None:
        return "not told"
    return f"{code:04X}h {MEANINGS.get(code, 'see the drive manual')}" if code else "none"
