"""The cycle itself: grid, SYNC, process data until a deadline, RPDOs; no policy, no limits."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import final

import can

from legbench.drives.codec.frame import (
    EMCY_BASE,
    HEARTBEAT_BASE,
    LAST_NODE,
    NMT_ID,
    SDO_REPLY_BASE,
    SYNC_ID,
)
from legbench.drives.codec.nmt import NmtState, heartbeat_frame
from legbench.drives.codec.pdo import PdoMap
from legbench.drives.config import BusConfig
from legbench.drives.errors import BusError
from legbench.drives.master.axis_link import AxisLink
from legbench.drives.master.port import Port
from legbench.drives.master.temperature import TemperaturePoll
from legbench.drives.master.watch import NodeWatch
from legbench.drives.wire import plain_bits

ERROR_FRAME_BUS_OFF = 0x40
"""Class of a SocketCAN error frame: this controller has left the bus."""


@dataclass(frozen=True, slots=True)
class Tick:
    """When a cycle began."""

    time_ns: int
    """SYNC was sent."""
    late_ns: int
    """After its place on the grid."""
    skipped: int
    """Ticks that were missed before it."""
    complete: bool
    """All process data came before the deadline."""


@final
class Cycle:
    """Ticks on an absolute grid: late is late, missed is skipped and counted, never made up.

    Attributes:
        axes: the drives, in the order of the leg's joints.
        watches: the same, as watched.
        bus_error: why the last cycle could not send.
        bus_off: the controller has left the bus.
        stranger: identifier of a frame that only this master may send, and another one did.
        error_frames: heard so far.
        late_frames: process data that came after its deadline.
    """

    def __init__(self, port: Port, config: BusConfig) -> None:
        now_ns = port.timebase.now_ns()
        self._port, self._config = port, config
        self.axes = tuple(AxisLink(node) for node in config.nodes)
        self.watches = tuple(NodeWatch(config, node, now_ns) for node in config.nodes)
        self.polls = tuple(TemperaturePoll(node) for node in config.nodes)
        self.bus_error: BusError | None = None
        self.bus_off = False
        self.stranger: int | None = None
        self.error_frames = 0
        self.late_frames = 0
        self._tpdos = {cob: axis for axis in self.axes for cob in axis.tpdo_ids}
        self._expected = len(self._tpdos)
        self._ours = frozenset(
            {NMT_ID, SYNC_ID, HEARTBEAT_BASE + config.master_id}
            | {node.rpdo_id(pdo) for node in config.nodes for pdo in node.rpdos}
        )
        self._by_node = {
            node.node_id: watch for node, watch in zip(config.nodes, self.watches, strict=True)
        }
        self._polls = {
            node.node_id: poll for node, poll in zip(config.nodes, self.polls, strict=True)
        }
        self._period_ns = config.period_ns
        self._deadline_ns = 1000 * config.tpdo_deadline_us
        self._beat = heartbeat_frame(config.master_id, NmtState.OPERATIONAL)
        self._beat_cycles = max(1, 1000 * config.master_heartbeat_ms // config.period_us)
        smallest = min(PdoMap(pdo.objects).size for node in config.nodes for pdo in node.tpdos)
        bits = plain_bits(0) + plain_bits(smallest)
        self._soonest_ns = 1_000_000_000 * bits // config.bitrate
        self._due_ns = 0
        self._count = 0
        self._complete = True
        self._owed: set[int] = set()
        self._early: set[int] = set()

    def begin(self) -> None:
        """Lay the grid: the next tick is one period from now, on a whole period."""
        now_ns = self._port.timebase.now_ns()
        self._due_ns = (now_ns // self._period_ns + 1) * self._period_ns
        self.arm()

    def arm(self) -> None:
        """Watch from now on, whatever was before."""
        now_ns = self._port.timebase.now_ns()
        for watch in self.watches:
            watch.arm(now_ns)

    def tick(self) -> Tick:
        """Wait for the next tick of the grid, send SYNC, gather process data."""
        timebase = self._port.timebase
        now_ns = timebase.now_ns()
        late_ns = now_ns - self._due_ns
        # Up to half a period late SYNC still goes out; beyond, it would crowd the next one.
        skipped = max(0, (late_ns + self._period_ns // 2) // self._period_ns)
        self._due_ns += skipped * self._period_ns
        due_ns = self._due_ns
        timebase.wait_until(due_ns)
        self.bus_error = None
        self._drain()
        for axis in self.axes:
            axis.begin_cycle()
        sync_ns = timebase.now_ns()
        missing = self._expected
        try:
            self._port.send(SYNC_ID)
            missing = self._gather(sync_ns + self._deadline_ns)
        except BusError as error:
            self._failed(error)
        self._complete = missing == 0
        self._remember()
        for axis, watch in zip(self.axes, self.watches, strict=True):
            watch.cycle(complete=axis.fresh)
        self._due_ns = due_ns + self._period_ns
        self._count += 1
        return Tick(sync_ns, sync_ns - due_ns, skipped, self._complete)

    def send(self, controlwords: Sequence[int | None]) -> bool:
        """Send the RPDOs of all drives; they act at the next SYNC. False: the bus failed.

        A frame that is refused keeps no other drive from its own; no word, no frame.
        """
        sent = True
        for axis, controlword in zip(self.axes, controlwords, strict=True):
            if controlword is None:
                continue
            for cob_id, data in axis.frames(controlword):
                try:
                    self._port.send(cob_id, data)
                except BusError as error:
                    self._failed(error)
                    sent = False
        return self.send_rest() and sent

    def send_rest(self) -> bool:
        """What has to go out now and then: heartbeat, polls. False: the bus failed."""
        try:
            if self._count % self._beat_cycles == 0:
                self._port.send_frame(self._beat)
            for place, poll in enumerate(self.polls):
                frame = poll.due(self._count + place)
                if frame is not None:
                    self._port.send_frame(frame)
        except BusError as error:
            self._failed(error)
            return False
        return True

    def other(self, message: can.Message) -> None:
        """Take a frame that is no process data of this cycle."""
        cob_id = message.arbitration_id
        if message.is_error_frame:
            self.error_frames += 1
            self.bus_off = self.bus_off or bool(cob_id & ERROR_FRAME_BUS_OFF)
            return
        if cob_id in self._ours and self._port.foreign(message):
            # Only a master sends these.
            self.stranger = cob_id
            return
        node_id = cob_id & LAST_NODE
        watch = self._by_node.get(node_id)
        if watch is None:
            return
        base = cob_id - node_id
        if base == HEARTBEAT_BASE:
            watch.hear_heartbeat(bytes(message.data), self._port.timebase.now_ns())
        elif base == EMCY_BASE:
            watch.hear_emergency(bytes(message.data))
        elif base == SDO_REPLY_BASE:
            self._polls[node_id].feed(bytes(message.data))

    def _gather(self, until_ns: int) -> int:
        """Take frames until all process data is there or the deadline; how many are missing."""
        missing, receive, tpdos = self._expected, self._port.receive, self._tpdos
        soonest_ns = until_ns - self._deadline_ns + self._soonest_ns
        while missing:
            message = receive(until_ns)
            if message is None:
                break
            axis = tpdos.get(message.arbitration_id)
            if axis is None or message.is_error_frame:
                self.other(message)
                if self._port.timebase.now_ns() >= until_ns:
                    break
                continue
            if self._owed and self._stale(message.arbitration_id, soonest_ns):
                continue
            before = axis.fresh
            if not axis.feed(message.arbitration_id, bytes(message.data)):
                self._by_node[axis.node.node_id].bad_total += 1
            elif not before and axis.fresh:
                missing -= len(axis.tpdo_ids)
        return missing

    def _stale(self, cob_id: int, soonest_ns: int) -> bool:
        """Whether a frame owed by the last cycle came sooner than an answer to this SYNC can."""
        if cob_id not in self._owed or self._port.timebase.now_ns() >= soonest_ns:
            return False
        self._owed.discard(cob_id)
        self._early.add(cob_id)
        self.late_frames += 1
        return True

    def _remember(self) -> None:
        """Which frames of this cycle may still come.

        A bus without the wire's timing answers sooner than a wire: a frame that was refused for
        that is not refused again.
        """
        if self._complete:
            self._owed.clear()
        else:
            missing = {cob for cob, axis in self._tpdos.items() if not axis.fresh}
            self._owed = missing - self._early
        self._early.clear()

    def _drain(self) -> None:
        """Before SYNC: what has come by now is late or a copy, and must not pass for new."""
        try:
            while (message := self._port.receive(0)) is not None:
                if message.arbitration_id in self._tpdos and not message.is_error_frame:
                    self.late_frames += 1
                    self._owed.discard(message.arbitration_id)
                else:
                    self.other(message)
        except BusError as error:
            self._failed(error)

    def _failed(self, error: BusError) -> None:
        self.bus_error = error
        self.bus_off = self.bus_off or self._port.off_bus
