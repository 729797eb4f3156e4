"""Scan of a bus for the identities of its nodes."""

from collections.abc import Iterator
from dataclasses import dataclass

from legbench.drives.errors import DriveError, NoAnswerError
from legbench.drives.master.doubles import count_answers
from legbench.drives.master.first_contact import first_contact
from legbench.drives.master.identification import read_identity
from legbench.drives.master.sdo_port import SdoPort
from legbench.drives.master.session import Session
from legbench.drives.protocol.datatypes import DataType
from legbench.drives.protocol.frame import LAST_NODE
from legbench.drives.setup.config import BusConfig, Identity

PROBE_MS = 15
"""Patience with a node that may not be there, asked twice; a booted drive answers within 5 ms."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ScannedNode:
    """Node that was found on the bus."""

    node_id: int
    device_type: int
    """Device type (1000h)."""
    vendor: int
    product: int | None
    revision: int | None
    serial: int | None
    """Serial number (1018h:04); None if the drive has none."""
    answers: int
    """Number of drives that answer under this node id; each has to have one of its own."""
    verdict: str
    """Comparison with the bus file, in words."""


def scan(session: Session, last: int = LAST_NODE) -> Iterator[ScannedNode]:
    """Ask every node id up to `last` for its identity; nothing is written.

    Raises:
        BusError: nobody can be asked, such as at a wrong bitrate.
    """
    config, port = session.config, session.port()
    found = 0
    with first_contact(port, config):
        for node_id in range(1, last + 1):
            probe = SdoPort(port, node_id, timeout_ms=PROBE_MS, retries=2)
            try:
                device = probe.get_int(0x1000, 0, DataType.UNSIGNED32)
            except DriveError:
                continue
            found += 1
            sdo = SdoPort(port, node_id, timeout_ms=config.sdo_timeout_ms)
            there = read_identity(sdo)
            answers = count_answers(port, node_id, 0x1018, 4)
            yield ScannedNode(
                node_id=node_id,
                device_type=device,
                vendor=there.vendor,
                product=there.product,
                revision=there.revision,
                serial=there.serial,
                answers=answers,
                verdict=_verdict(config, node_id, there)
                if answers < 2
                else f"{answers} drives answer with this node id",
            )
        if not found and port.error_frames:
            raise NoAnswerError(f"no node up to {last} answers")


def _verdict(config: BusConfig, node_id: int, there: Identity) -> str:
    for node in config.nodes:
        wanted = node.identity
        same = wanted.vendor == there.vendor
        same = same and wanted.product in (None, there.product)
        same = same and wanted.serial in (None, there.serial)
        if node.node_id == node_id and same:
            return f"'{node.name}' of the bus file"
        if node.node_id == node_id:
            return f"in the place of '{node.name}', but another drive"
        if same and wanted.serial is not None:
            return f"'{node.name}' of the bus file, which expects it at node {node.node_id}"
    return "not in the bus file"
