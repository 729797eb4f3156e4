"""Detection of another master before and during bring-up; nothing is sent from here."""

from collections.abc import Iterator
from typing import final

import can

from legbench.drives.master.port import Port
from legbench.drives.protocol.frame import (
    HEARTBEAT_BASE,
    LAST_NODE,
    NMT_ID,
    SDO_REQUEST_BASE,
    SYNC_ID,
)
from legbench.drives.protocol.lss import REQUEST_ID as LSS_REQUEST
from legbench.drives.setup.config import BusConfig, NodeConfig
from legbench.drives.transport.open_bus import listening_ns
from legbench.errors import PlantFault


@final
class MasterDetector:
    """Detector of any other master that leads the drives of a bus file or accesses their objects.

    A master of a leg is heard by its SYNC, its commands (RPDOs), its orders (NMT), its questions
    (SDO and LSS requests) and its heartbeat. A node that the bus file does not name may be
    anything, such as a sensor: it is a master if a drive watches for it (1016h), see
    `check_consumer`.

    Attributes:
        stranger: identifier of the first frame that only a master sends, and another one did.
        heard_nodes: nodes besides the drives whose heartbeat has been heard.
    """

    def __init__(self, port: Port, config: BusConfig) -> None:
        self._port, self._config = port, config
        self._names = {
            NMT_ID: "NMT order",
            SYNC_ID: "SYNC",
            LSS_REQUEST: "LSS request",
            HEARTBEAT_BASE + config.master_id: f"heartbeat of master {config.master_id}",
        }
        for node in config.nodes:
            self._names[SDO_REQUEST_BASE + node.node_id] = f"SDO request to '{node.name}'"
            self._names |= {
                node.rpdo_id(pdo): f"RPDO{pdo.number} of '{node.name}'" for pdo in node.rpdos
            }
        self._nodes = {node.node_id for node in config.nodes}
        self._armed = True
        self.stranger: int | None = None
        self.heard_nodes: set[int] = set()

    def listen(self) -> None:
        """Listen for `open_bus.LISTEN_NS`, or not at all on a bus without other participants.

        Raises:
            PlantFault: another master leads these drives, or asks them.
            BusError: the bus has failed.
        """
        port = self._port
        until_ns = port.timebase.now_ns() + listening_ns(port.bus)
        while port.timebase.now_ns() < until_ns:
            message = port.receive(until_ns)
            if message is not None:
                self.check_frame(message)

    def poll_frames(self) -> Iterator[can.Message]:
        """Take all frames that have come by now, without waiting; raises as `listen`.

        Frames that come faster than they are read are taken for a period of the bus at most.
        """
        until_ns = self._port.timebase.now_ns() + self._config.period_ns
        while (message := self._port.take()) is not None:
            self.check_frame(message)
            yield message
            if self._port.timebase.now_ns() > until_ns:
                return

    def check_frame(self, message: can.Message) -> None:
        """Judge a received frame; raises PlantFault, and names it, if only a master sends it."""
        cob_id = message.arbitration_id
        if message.is_error_frame or not self._port.foreign(message):
            return
        if HEARTBEAT_BASE < cob_id <= HEARTBEAT_BASE + LAST_NODE:
            self.heard_nodes |= {cob_id - HEARTBEAT_BASE} - self._nodes
        if cob_id in self._names:
            self._found(cob_id, self._names[cob_id])

    def check_consumer(self, node: NodeConfig, consumer: int) -> None:
        """Compare whom a drive watches (a word of 1016h) with whom this bus has been heard from.

        Raises:
            PlantFault: the drive watches for a node that lives: that one is its master.
        """
        master = consumer >> 16 & LAST_NODE
        if consumer & 0xFFFF and master in self.heard_nodes:
            what = f"the heartbeat that '{node.name}' watches for"
            self._found(HEARTBEAT_BASE + master, what)

    def disarm(self) -> None:
        """Stop raising, as these drives are led from here and a stop must get out."""
        self._armed = False

    def _found(self, cob_id: int, name: str) -> None:
        self.stranger = cob_id if self.stranger is None else self.stranger
        if self._armed:
            raise PlantFault(
                "second master",
                f"somebody else sends {cob_id:03X}h ({name}), which only "
                "the master of these drives does; nothing has been sent to them since: unplug it, "
                "or end its program",
            )
