"""Identification of drives: every node has to be the one that the bus file means."""

from collections.abc import Callable, Mapping, Sequence

from legbench.drives.errors import DriveError
from legbench.drives.master.sdo_port import SdoPort
from legbench.drives.protocol.datatypes import DataType
from legbench.drives.setup.config import BusConfig, Identity, NodeConfig

PROFILE_402 = 0x0192
"""Device profile number of CiA 402 drives, in the low word of 1000h."""
CSP_BIT = 1 << 7
"""Bit of 6502h, supported drive modes, for cyclic synchronous position mode."""
U32 = DataType.UNSIGNED32


def read_identity(sdo: SdoPort) -> Identity:
    """Read the identity object of a node (1018h); raises as `SdoPort.read` does."""
    vendor = sdo.get_int(0x1018, 1, U32)
    # CiA 301 (7.5.2.19) demands the vendor alone.
    product, revision, serial = (sdo.find_int(0x1018, sub, U32) for sub in (2, 3, 4))
    return Identity(vendor=vendor, product=product, revision=revision, serial=serial)


def identify(
    nodes: Sequence[NodeConfig], bus: BusConfig, sdo_of: Callable[[NodeConfig], SdoPort]
) -> None:
    """Check device type, identity and drive modes of nodes (1000h, 1018h, 6502h).

    Args:
        nodes: nodes to check.
        bus: configuration of all nodes, among which two may be swapped.
        sdo_of: access to the objects of a node.

    Raises:
        BusError: the bus has failed.
        DriveError: a node is missing, is another one, or two are swapped.
    """
    found: dict[int, Identity] = {}
    for node in nodes:
        sdo = sdo_of(node)
        device = sdo.get_int(0x1000, 0, U32)
        if device & 0xFFFF != PROFILE_402:
            raise DriveError(
                f"node {node.node_id} ('{node.name}') is no CiA 402 drive: its device type, "
                f"1000h, is {device:08X}h and does not end with 0192h; take another drive"
            )
        found[node.node_id] = read_identity(sdo)
    for node in nodes:
        _compare(node, found, bus)
    for node in nodes:
        modes = sdo_of(node).find_int(0x6502, 0, U32)
        # A drive that does not tell its modes is asked for this one, and has to show it (6061h).
        if modes is not None and not modes & CSP_BIT:
            raise DriveError(
                f"node {node.node_id} ('{node.name}') knows no cyclic synchronous position mode: "
                f"6502h is {modes:#x}; take another drive, or a firmware that has it"
            )


def _compare(node: NodeConfig, found: Mapping[int, Identity], bus: BusConfig) -> None:
    wanted, there = node.identity, found[node.node_id]
    for name in ("vendor", "product", "revision", "serial"):
        value, real = getattr(wanted, name), getattr(there, name)
        if value is None or value == real:
            continue
        if real is None:
            raise DriveError(
                f"node {node.node_id} ('{node.name}') does not tell its {name} (1018h), expected "
                f"is {value:#x}; leave {name} out of the bus file if this is the right drive"
            )
        hint = "correct the bus file if this is the right drive"
        for other in bus.nodes:
            at = found.get(other.node_id)
            if name == "serial" and other is not node and at is not None and at.serial == value:
                hint = (
                    f"that one is node {other.node_id}: '{node.name}' and '{other.name}' are "
                    "swapped"
                )
        raise DriveError(
            f"node {node.node_id} ('{node.name}') has {name} {real:#x}, expected is "
            f"{value:#x}; {hint}"
        )
