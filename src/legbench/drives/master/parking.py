"""Parking of drives at the end of a link, so that no recorded command moves them again.

A log that is played back holds NMT start, SYNC, controlwords and targets. A drive that keeps its
configuration obeys all of them. One whose command frames are switched off does not, operational
or not, until it is configured again or has been without its logic supply.
"""

from collections.abc import Callable, Collection

import can

from legbench.drives.errors import BusError, DriveError
from legbench.drives.master.port import Port
from legbench.drives.master.sdo_port import SdoPort
from legbench.drives.protocol.datatypes import DataType
from legbench.drives.protocol.frame import COB_INVALID
from legbench.drives.setup.config import BusConfig, NodeConfig, Parameter

RPDO_COMMUNICATION = 0x1400
"""First of the objects whose sub-index 1 is the COB-ID of a command frame (RPDO)."""


def parked(node: NodeConfig) -> list[Parameter]:
    """Objects that switch the command frames of a drive off (CiA 301, 7.5.2.33)."""
    return [
        Parameter(
            index=RPDO_COMMUNICATION + pdo.number - 1,
            sub=1,
            kind=DataType.UNSIGNED32,
            value=COB_INVALID | node.rpdo_id(pdo),
        )
        for pdo in node.rpdos
    ]


def is_parked(node: NodeConfig, parameter: Parameter, there: int) -> bool:
    """Whether an object differs from the configuration only because its drive is parked.

    Args:
        node: the drive.
        parameter: object and value of the configuration.
        there: value that the drive holds.
    """
    return there == parameter.value | COB_INVALID and any(
        parameter.key == rest.key for rest in parked(node)
    )


def park(
    port: Port,
    bus: BusConfig,
    on_other: Callable[[can.Message], None],
    powered: Collection[str] = (),
) -> list[str]:
    """Park all drives and read every object back; returns what went wrong, one line a drive.

    No stop waits for this, nothing is tried twice, and nothing is raised. A drive that has kept its
    power is left out: the deadline of its command frames may be what stops it.

    Args:
        port: port of the bus.
        bus: configuration of the drives.
        on_other: called with frames that are no answers.
        powered: names of drives that have kept their power.
    """
    failed: list[str] = []
    for node in bus.nodes:
        who = f"drive '{node.name}' (node {node.node_id})"
        if node.name in powered:
            failed.append(f"{who} is not parked, because it has kept its power")
            continue
        sdo = SdoPort(
            port, node.node_id, timeout_ms=bus.sdo_timeout_ms, retries=1, on_other=on_other
        )
        try:
            for rest in parked(node):
                sdo.put(rest.index, rest.sub, rest.kind, rest.value)
                there = sdo.get_int(rest.index, rest.sub, rest.kind)
                if not there & COB_INVALID:
                    failed.append(
                        f"{who} keeps its commands switched on: {rest.index:04X}h:01 is "
                        f"{there:08X}h"
                    )
        except (BusError, DriveError) as error:
            failed.append(f"{who} is not parked: {error}")
    return failed
