"""Change of the node id of the only drive on a bus, by layer setting services (CiA 305)."""

from dataclasses import dataclass

from legbench.commissioning.scan import PROBE_MS, ScannedNode, scan
from legbench.drives.errors import DriveError, NoAnswerError, SdoAbortError
from legbench.drives.master.identification import read_identity
from legbench.drives.master.lss_port import LssPort
from legbench.drives.master.sdo_port import SdoPort
from legbench.drives.master.session import Session
from legbench.drives.protocol.cia402 import POWERED, decode_state, describe_statusword
from legbench.drives.protocol.datatypes import DataType
from legbench.drives.protocol.frame import HEARTBEAT_BASE, LAST_NODE
from legbench.drives.protocol.lss import UNCONFIGURED, LssAddress, LssError
from legbench.drives.protocol.nmt import NmtCommand, nmt_frame
from legbench.errors import ConfigError
from legbench.interrupts import shielded

BOOT_NS = 5_000_000_000
"""Longest wait for the boot-up message under the new node id [ns]."""


@dataclass(frozen=True, slots=True, kw_only=True)
class NodeIdChange:
    """Drive that has got another node id."""

    before: int | None
    """Node id before; none if it had none."""
    after: int
    vendor: int
    product: int
    revision: int
    serial: int
    stored: bool
    """Whether the drive has stored it; otherwise it lasts until its power is switched off."""


def set_node_id(session: Session, node_id: int) -> NodeIdChange:
    """Give the one drive on the bus a node id; it is selected by its whole identity (1018h).

    Raises:
        ConfigError: a node id that does not exist, or is the master's.
        BusError: the channel has a master.
        PlantFault: somebody else leads drives on this bus; nothing has been sent since.
        DriveError: no node answers, two do, the drive has power, does not know LSS, or does not
            take the node id.
    """
    master_id = session.config.master_id
    if not 1 <= node_id <= LAST_NODE or node_id == master_id:
        raise ConfigError(
            f"node id is {node_id}; it must be 1 to {LAST_NODE}, and not {master_id}, the master's"
        )
    session.hold()
    up = session.bring_up()
    up.listen()
    found = list(scan(session))
    heard = up.detector.heard_nodes - {node.node_id for node in found}
    _refuse_many(found, heard)
    lss = LssPort(session.port())
    try:
        address, before = _select(session, lss, found)
        up.poll_frames()
        lss.configure(node_id)
        stored = lss.store()
    finally:
        # No drive may stay in configuration, whatever happens: it would take the next node id.
        with shielded():
            lss.release()
    # A reset of the node loses what is not stored, but leaves no fault of a lost connection behind.
    kept = stored is LssError.NONE
    order = NmtCommand.RESET_NODE if kept else NmtCommand.RESET_COMMUNICATION
    _restart(session, before, node_id, address, order)
    if stored is LssError.STORE_FAILED:
        raise DriveError(
            f"node {node_id} could not store its node id (LSS error 2); it is back after the next "
            "power-off: look at the drive's memory, then try again"
        )
    vendor, product, revision, serial = address
    return NodeIdChange(
        before=before,
        after=node_id,
        vendor=vendor,
        product=product,
        revision=revision,
        serial=serial,
        stored=kept,
    )


def _refuse_many(found: list[ScannedNode], heard: set[int]) -> None:
    """Refuse a bus on which anything but one drive is alive; raises DriveError."""
    ids = sorted({node.node_id for node in found} | heard)
    twice = [node.node_id for node in found if node.answers > 1]
    if twice:
        raise DriveError(
            f"two drives answer as node {twice[0]}: disconnect one, give the other one its node "
            "id, then connect both"
        )
    if len(ids) > 1:
        raise DriveError(
            f"nodes {', '.join(map(str, ids))} answer; a node id is given to one drive alone on "
            "the bus: disconnect the others"
        )


def _select(
    session: Session, lss: LssPort, found: list[ScannedNode]
) -> tuple[LssAddress, int | None]:
    """Bring the one drive into configuration; returns its address and its node id, if any."""
    if not found:
        address = lss.find_unconfigured()
        if address is None:
            raise NoAnswerError(
                "no node answers, with a node id or without one; look at its power, the wiring "
                f"and the bitrate, {session.config.bitrate_text}"
            )
        before = None
    else:
        if lss.any_unconfigured():
            raise DriveError(
                f"node {found[0].node_id} answers, and a drive without node id does, too; leave "
                "one alone on the bus"
            )
        one = found[0]
        _refuse_powered(session, one.node_id)
        address = (one.vendor, one.product or 0, one.revision or 0, one.serial or 0)
        lss.select(address)
        before = one.node_id
    there = lss.node_id()
    if there != (before or UNCONFIGURED) or lss.address() != address:
        raise DriveError(
            f"the drive selected over LSS says that it is node {there}, asked for was "
            f"{before or UNCONFIGURED}; switch it off and on, then try again"
        )
    return address, before


def _refuse_powered(session: Session, node_id: int) -> None:
    """Refuse a drive whose motor may have torque; a node without statusword has no motor."""
    sdo = SdoPort(session.port(), node_id, timeout_ms=session.config.sdo_timeout_ms)
    try:
        word = sdo.get_int(0x6041, 0, DataType.UNSIGNED16)
    except SdoAbortError:
        return
    if decode_state(word) in POWERED:
        raise DriveError(
            f"node {node_id} has power ({describe_statusword(word)}); end the program that leads "
            "it, or press the stop button: nothing has been changed"
        )


def _restart(
    session: Session, before: int | None, node_id: int, address: LssAddress, order: NmtCommand
) -> None:
    """Reset the drive so that the new node id is in use; raises DriveError if it is not.

    A drive without node id boots by itself once it has one (CiA 305).
    """
    port = session.port()
    if before is not None:
        port.send_frame(nmt_frame(order, before))
    until_ns = port.timebase.now_ns() + BOOT_NS
    while (message := port.receive(until_ns)) is not None:
        if message.arbitration_id == HEARTBEAT_BASE + node_id:
            break
    sdo = SdoPort(port, node_id, timeout_ms=session.config.sdo_timeout_ms)
    there = read_identity(sdo)
    words = (there.vendor, there.product or 0, there.revision or 0, there.serial or 0)
    if words != address:
        raise DriveError(
            f"node {node_id} is another drive, serial {words[3]}, than the one that was given this "
            f"node id, serial {address[3]}: two drives have it now; disconnect one"
        )
    if before not in (None, node_id) and _answers(session, before or 0):
        raise DriveError(
            f"node {before} still answers after its drive has become node {node_id}: a second "
            "drive is on the bus; disconnect one"
        )


def _answers(session: Session, node_id: int) -> bool:
    probe = SdoPort(session.port(), node_id, timeout_ms=PROBE_MS, retries=2)
    try:
        probe.get_int(0x1000, 0, DataType.UNSIGNED32)
    except DriveError:
        return False
    return True
