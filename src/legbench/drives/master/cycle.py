"""The cycle itself: grid, SYNC, process data until a deadline, RPDOs; no policy, no limits.

CAN frames carry no number: an answer that is a whole cycle late looks like the next one. So SYNC
never goes out while an answer to the last one may be on its way. If one has not come by the next
tick, that tick is silent: without a SYNC, whatever comes answers an earlier one.
"""

from collections.abc import Sequence
from typing import final

import can

from legbench.drives.errors import BusError
from legbench.drives.master.axis_link import AxisLink
from legbench.drives.master.foreign_sync import await_sync
from legbench.drives.master.mode_poll import mode_polls
from legbench.drives.master.notices import Notices
from legbench.drives.master.outgoing import Outgoing
from legbench.drives.master.port import Port
from legbench.drives.master.requests import Requests
from legbench.drives.master.temperature import temperature_polls
from legbench.drives.master.tick import Tick
from legbench.drives.master.watch import NodeWatch
from legbench.drives.protocol.frame import (
    EMCY_BASE,
    HEARTBEAT_BASE,
    LAST_NODE,
    NMT_ID,
    SDO_REPLY_BASE,
    SDO_REQUEST_BASE,
    SYNC_ID,
)
from legbench.drives.setup.config import BusConfig

ERROR_FRAME_BUS_OFF = 0x40
"""Class bit of a SocketCAN error frame that says that this controller is bus-off."""


@final
class Cycle:
    """Cycle on an absolute grid of ticks; a missed tick is skipped and counted, never repeated.

    Attributes:
        axes: drives, in the order of the leg's joints.
        watches: watches of the drives, in the same order.
        bus_error: reason why the last cycle could not send.
        bus_off: the controller has left the bus.
        stranger: identifier of a frame that only this master may send, and another one did.
        error_frames: number of error frames received so far.
        late_frames: process data that came after its deadline.
        silent_total: ticks that were left out to find late answers.
        notices: irregularities that end no run.
        stopping: whether a stop is under way, for which SYNC goes out at every tick.
    """

    def __init__(self, port: Port, config: BusConfig) -> None:
        now_ns = port.timebase.now_ns()
        self._port, self._config = port, config
        self.axes = tuple(AxisLink(node) for node in config.nodes)
        self.watches = tuple(NodeWatch(config, node, now_ns) for node in config.nodes)
        self.polls = temperature_polls(config)
        self.bus_error: BusError | None = None
        self.bus_off = False
        self.stranger: int | None = None
        self.error_frames = 0
        self.late_frames = 0
        self.silent_total = 0
        self.notices = Notices()
        self.stopping = False
        self._gaps = True  # A drive may have missed a cycle since two in a row were complete.
        self._tpdos = {cob: axis for axis in self.axes for cob in axis.tpdo_ids}
        self._ours = frozenset(
            {NMT_ID, SYNC_ID, HEARTBEAT_BASE + config.master_id}
            | {node.rpdo_id(pdo) for node in config.nodes for pdo in node.rpdos}
        )
        self._by_node = {
            node.node_id: watch for node, watch in zip(config.nodes, self.watches, strict=True)
        }
        self._period_ns = config.period_ns
        # SYNC is still sent up to half a period late; later it would crowd the next one.
        self._latest_ns = config.period_ns - config.period_ns // 2
        self._deadline_ns = 1000 * config.deadline_us
        self._due_ns = self._tick_ns = self._sync_ns = 0
        self._skipped = self._silent = 0
        self._sent = False
        self._owed: set[int] = set()
        """COB-IDs of process data that has not come, and still may."""
        modes = mode_polls(self.axes, config)
        both = zip(config.nodes, self.polls, modes, strict=True)
        self._polls = {node.node_id: polls for node, *polls in both}
        self._requests = Requests(port, config, (*self.polls, *modes), self._failed)
        self._outgoing = Outgoing(port, config, self.axes, self._failed)

    def begin(self) -> None:
        """Lay the grid: the next tick is one period from now, on a whole period."""
        now_ns = self._port.timebase.now_ns()
        self._due_ns = (now_ns // self._period_ns + 1) * self._period_ns
        self._outgoing.begin(self._due_ns)
        self.arm()

    def arm(self) -> None:
        """Start the watches anew, clearing what they have counted."""
        now_ns = self._port.timebase.now_ns()
        for watch in self.watches:
            watch.arm(now_ns)

    def tick(self) -> Tick:
        """Wait for the next tick of the grid, send SYNC, gather process data."""
        self.sync()
        return self.answers()

    def sync(self) -> None:
        """Wait for the next tick of the grid and send SYNC; its answers are taken by `answers`."""
        timebase = self._port.timebase
        late_ns, skipped = timebase.now_ns() - self._due_ns, 0
        if late_ns >= self._latest_ns:
            skipped = (late_ns + self._period_ns // 2) // self._period_ns
            self._due_ns += skipped * self._period_ns
        timebase.wait_until(self._due_ns)
        self.bus_error = None
        self._drain()
        silent = int(bool(self._owed) and not self.stopping)
        if silent:
            self._keep_silent()
        # Whatever is raised from here on, the next SYNC leaves a period later.
        self._tick_ns, self._due_ns = self._due_ns, self._due_ns + self._period_ns
        self._skipped, self._silent, self._sync_ns = skipped, silent, timebase.now_ns()
        self._sent = self._outgoing.sync()
        for axis in self.axes:
            axis.begin_cycle()

    def answers(self) -> Tick:
        """Gather process data after `sync` until the deadline, and return the tick of both."""
        due_ns, sync_ns, silent = self._tick_ns, self._sync_ns, self._silent
        complete = self._sent and self._gather(sync_ns + self._deadline_ns)
        asks = complete and not self.stopping
        self._requests.turn(self._port.timebase.now_ns() - due_ns if asks else None)
        if self._gaps or not complete:
            self._count()
        return Tick(sync_ns, sync_ns - due_ns, self._skipped + silent, silent, complete)

    def hears_sync(self, until_ns: int) -> bool:
        """Whether another master sends SYNC by then; from its first one on this one may `follow`.

        Raises:
            BusError: the bus has failed.
        """
        heard = await_sync(self._port, until_ns, self._between) is not None
        if heard:
            self._ours, self.stranger = frozenset[int](), None
        return heard

    def follow(self) -> Tick:
        """Wait for the SYNC of another master, gather process data; nothing is sent."""
        timebase, last_ns = self._port.timebase, self._due_ns
        self.bus_error = None
        complete, skipped, sync_ns = False, 0, None
        try:
            until_ns = timebase.now_ns() + 2 * self._period_ns
            sync_ns = await_sync(self._port, until_ns, self._between)
        except BusError as error:
            self._failed(error)
        for axis in self.axes:
            axis.begin_cycle()
        if sync_ns is not None:
            skipped = max(0, round((sync_ns - last_ns) / self._period_ns) - 1)
            complete = self._gather(sync_ns + self._deadline_ns)
        self._due_ns = sync_ns or last_ns + self._period_ns
        self._count()
        return Tick(sync_ns or timebase.now_ns(), 0, skipped, skipped, complete)

    def _count(self) -> None:
        """Count this cycle for every drive; one in order changes no count while there are none."""
        for axis, watch in zip(self.axes, self.watches, strict=True):
            watch.cycle(complete=axis.fresh)
        self._gaps = any(watch.gaps for watch in self.watches)

    def _between(self, message: can.Message) -> bool:
        """Take a frame that comes between two cycles, and return whether it is late data."""
        if message.arbitration_id in self._tpdos and not message.is_error_frame:
            self.late_frames += 1
            return True
        self.other(message)
        return False

    def _keep_silent(self) -> None:
        """Let this tick pass, so that a late answer cannot be taken for one to the next SYNC."""
        self.silent_total += 1
        for axis, watch in zip(self.axes, self.watches, strict=True):
            if not self._owed.isdisjoint(axis.tpdo_ids):
                watch.cycle(complete=False)
                self._gaps = True
        self._due_ns += self._period_ns
        self._port.timebase.wait_until(self._due_ns)
        self._drain()
        self._owed.clear()

    def led_by_another(self) -> bool:
        """Whether another master has been heard, the frames that have come by now included."""
        self._drain()
        return self.stranger is not None

    def send(self, controlwords: Sequence[int | None]) -> bool:
        """Send the RPDOs and the heartbeat as `Outgoing` does; false if the bus failed."""
        sent = self._outgoing.commands(controlwords)
        return self._outgoing.heartbeat(self._due_ns) and sent

    def send_heartbeat(self) -> bool:
        """Send the heartbeat, where due; false if the bus failed."""
        return self._outgoing.heartbeat(self._due_ns)

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
            watch.take_heartbeat(bytes(message.data), self._port.timebase.now_ns())
        elif base == EMCY_BASE:
            watch.take_emergency(bytes(message.data))
        elif base == SDO_REPLY_BASE:
            for poll in self._polls[node_id]:
                poll.feed(bytes(message.data))
        elif base == SDO_REQUEST_BASE and self._port.foreign(message):
            self.notices.sdo_request(message, node_id, self._port.timebase.now_ns())

    def _gather(self, until_ns: int) -> bool:
        """Take frames until all process data is there or the deadline; whether it is complete."""
        receive, tpdos = self._port.receive, self._tpdos
        missing: set[int] = set(tpdos)
        garbled: set[int] = set()
        try:
            while missing:
                message = receive(until_ns)
                if message is None:
                    break
                cob_id = message.arbitration_id
                axis = tpdos.get(cob_id)
                if axis is None or message.is_error_frame:
                    self.other(message)
                    if self._port.timebase.now_ns() >= until_ns:
                        break
                    continue
                if cob_id not in missing:
                    self.notices.answered_twice(message, self._port.timebase.now_ns())
                if axis.feed(cob_id, message.data):
                    missing.discard(cob_id)
                else:
                    garbled.add(cob_id)
                    self._by_node[axis.node.node_id].bad_total += 1
        except BusError as error:
            self._failed(error)
        if missing:
            owed = {cob_id for axis in self.axes for cob_id in axis.missing_ids}
            self._owed = owed - garbled
        return not missing

    def _drain(self) -> None:
        """Discard, before SYNC, what has come by now: late or copied data must not pass for new.

        Frames that come as fast as they are read hold up no stop: after a period the tick goes on
        with a bus that has failed.
        """
        now_ns, until_ns = self._port.timebase.now_ns, None
        try:
            while (message := self._port.take()) is not None:
                until_ns = until_ns or now_ns() + self._period_ns
                if now_ns() > until_ns:
                    raise BusError(
                        f"frames come faster than they are read, for {1e-6 * self._period_ns:g} ms "
                        "now: look for a node or a program that babbles"
                    )
                if self._between(message):
                    self._late(message)
        except BusError as error:
            self._failed(error)
            # Frames that are still unread may be answers to an earlier SYNC.
            self._owed.update(self._tpdos)

    def _late(self, message: can.Message) -> None:
        """Take process data between two cycles: a late answer, or one too many."""
        cob_id = message.arbitration_id
        if cob_id not in self._owed and self._tpdos[cob_id].fresh:
            self.notices.answered_twice(message, self._port.timebase.now_ns())
        self._owed.discard(cob_id)

    def _failed(self, error: BusError) -> None:
        self.bus_error = error
        self.bus_off = self.bus_off or self._port.off_bus
