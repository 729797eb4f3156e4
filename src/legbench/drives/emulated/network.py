"""The wire of an emulated bus and all that hangs on it, event by event in virtual time.

Frames are sent one after the other, as arbitration decides; the body moves on a fixed grid.
Nothing here looks at a clock, and the same calls give the same frames to the nanosecond.
"""

from collections.abc import Callable, Sequence
from threading import Lock
from typing import final

from legbench.drives.emulated.body import Body, stiff_body
from legbench.drives.emulated.drive import EmulatedDrive
from legbench.drives.emulated.error_frames import BUS_OFF_FRAME, ERROR_FRAME
from legbench.drives.emulated.faults import Fault, NodeFault
from legbench.drives.emulated.injector import Injector
from legbench.drives.emulated.send_queue import SendQueue, Waiting
from legbench.drives.emulated.station import Heard, Node, Participant, Station
from legbench.drives.emulated.stuffing import Stuffing, bits_of
from legbench.drives.errors import BusError
from legbench.drives.protocol.frame import Frame
from legbench.drives.setup.wire import ERROR_BITS, worst_bits

PASSIVE, BUS_OFF = 128, 256
"""Transmit error counts from which a node is error passive, or off the bus (ISO 11898-1)."""


@final
class Network:
    """A bus with emulated drives, a body, other participants and any number of masters.

    Attributes:
        now_ns: virtual time [ns].
        drives: emulated drives, in the order of the leg's joints.
        log: every frame that was on the wire with the time of its end, if wanted.
        errors: transmit error counter of every node.
        bitrate: bitrate of the wire and of all drives [bit/s].
        lock: held by those who call from several threads.
    """

    def __init__(
        self,
        drives: Sequence[EmulatedDrive],
        *,
        body: Body = stiff_body,
        others: Sequence[Participant] = (),
        bitrate: int = 1_000_000,
        body_period_ns: int = 1_000_000,
        stuffing: Stuffing = Stuffing.WORST,
        faults: Sequence[Fault] = (),
        keep_log: bool = False,
    ) -> None:
        self.now_ns = 0
        self.lock = Lock()
        self.drives = tuple(drives)
        self.log: list[tuple[int, Frame]] | None = [] if keep_log else None
        self._body = body
        self._others = tuple(others)
        self._nodes: list[Node] = [*drives, *others]
        self.errors: dict[Node, int] = dict.fromkeys(self._nodes, 0)
        self.bitrate = bitrate
        self._bit_ns = round(1e9 / bitrate)
        self._stuffing = stuffing
        self._injector = Injector(faults)
        self._body_period_ns = self._tick_ns = body_period_ns
        self._queue = SendQueue()
        self._copied: dict[int, Node] = {}
        self._flying: Waiting | None = None
        self._broken = False
        self._end_ns = 0
        self._strangers: list[Station] = []
        """Stations at another bitrate than the wire's."""

    def attach(
        self,
        tx_queue: int = 64,
        bitrate: int | None = None,
        *,
        listen_only: bool = False,
        echo: bool = False,
    ) -> Station:
        """Plug a master in, by default at the bitrate of the wire [bit/s].

        At another bitrate it reads nothing, nobody reads what it sends, and until its controller is
        error passive it destroys what the others send.
        """
        station = Station(tx_queue, bitrate or self.bitrate, listen_only=listen_only, echo=echo)
        self._nodes.append(station)
        self.errors[station] = 0
        if station.bitrate != self.bitrate:
            self._strangers.append(station)
        return station

    def detach(self, station: Station) -> None:
        """Let a master go; what it has handed over is still sent, if it is at the bitrate."""
        self._nodes.remove(station)
        if station in self._strangers:
            self._strangers.remove(station)
            self._queue.drop(station)

    def alone(self, station: Station) -> bool:
        """Whether a master is the only one, and nothing but drives takes part besides."""
        return set(self._nodes) == {station, *self.drives}

    def inject(self, fault: Fault) -> None:
        """Add a fault."""
        self._injector.add(fault)

    def off_bus(self, node: Node) -> bool:
        """Whether a node has gone bus-off."""
        return self.errors[node] >= BUS_OFF

    def takes(self, station: Station) -> bool:
        """Whether a master's controller has room for one more frame to send."""
        return station.waiting < station.tx_queue and not self.off_bus(station)

    def level(self, station: Station) -> int:
        """The larger error counter of a master's controller."""
        return max(self.errors[station], station.unread)

    def recover(self, node: Node) -> None:
        """Take a node back onto the bus."""
        self.errors[node] = 0
        if isinstance(node, Station):
            node.unread = 0
        elif isinstance(node, EmulatedDrive):
            node.bus_on(self.now_ns)

    def send(self, station: Station, frame: Frame) -> None:
        """Hand a master's frame to its controller.

        Raises:
            BusError: the controller is bus-off, or its queue is full.
        """
        if self.errors[station] >= BUS_OFF:
            raise BusError("the controller is bus-off; find the cause, then restart the interface")
        if station.waiting >= station.tx_queue:
            raise BusError(f"the transmit queue is full ({station.tx_queue} frames)")
        station.waiting += 1
        self._queue.put(station, self.now_ns, frame)

    def advance(self, until_ns: int, station: Station | None = None) -> None:
        """Advance virtual time to `until_ns`, or until a frame for `station` has come."""
        while station is None or not station.received:
            at_ns, event = self._next()
            if at_ns > until_ns:
                break
            if at_ns > self.now_ns:
                self.now_ns = at_ns
            event()
        else:
            return
        self.now_ns = max(self.now_ns, until_ns)

    def upcoming(self) -> tuple[int, Callable[[], None]]:
        """Time [ns] and handler of the next event, for whoever leads the time of several."""
        return self._next()

    def _next(self) -> tuple[int, Callable[[], None]]:
        """Time and handler of the next event; at equal times the grid of the body goes first."""
        if self._flying is not None:
            at_ns, event = self._end_ns, self._land
        else:
            at_ns, event = max(self._end_ns, self._queue.earliest_ns), self._arbitrate
        if self._tick_ns <= at_ns:
            return self._tick_ns, self._tick
        return at_ns, event

    def _enqueue(self, node: Participant, frames: Sequence[tuple[int, Frame]]) -> None:
        if not self.off_bus(node):
            for ready_ns, frame in frames:
                self._queue.put(node, ready_ns, frame)

    def _tick(self) -> None:
        now_ns = self.now_ns
        self._tick_ns += self._body_period_ns
        for fault, begins in self._injector.node_events(now_ns):
            self._strike(fault, begins=begins)
        for frame in self._injector.babble(now_ns, self._body_period_ns):
            self._queue.put(self._injector, now_ns, frame)
        angles = tuple([drive.tick(now_ns) for drive in self.drives])
        if angles:
            links, torques = self._body(angles)
            for drive, link, torque in zip(self.drives, links, torques, strict=True):
                drive.sense(float(link), float(torque))
        for other in self._others:
            other.tick(now_ns)
        for node in self._nodes:
            if not isinstance(node, Station) and (frames := node.take()):
                self._enqueue(node, frames)

    def _arbitrate(self) -> None:
        """Start the ready frame with the lowest identifier, as arbitration does (ISO 11898-1)."""
        now_ns = self.now_ns
        self._flying = winner = self._queue.pop(now_ns)
        frame = winner.frame
        injector = self._injector
        self._broken = bool(injector.frames) and injector.breaks(frame, now_ns)
        if self._strangers and not self._broken:
            self._broken = self._garbled(winner.sender)
        bits = ERROR_BITS + worst_bits(0) if self._broken else bits_of(frame, self._stuffing)
        self._end_ns = now_ns + bits * self._bit_ns

    def _garbled(self, sender: Node) -> bool:
        """Whether a frame is destroyed because two bitrates meet.

        All others flag what a station at another bitrate sends, and such a station flags all that
        it hears until it is error passive.
        """
        if sender in self._strangers:
            return True
        broken = False
        for stranger in self._strangers:
            stranger.unread = min(BUS_OFF, stranger.unread + 8)
            active = self.level(stranger) < PASSIVE
            broken = broken or (active and not stranger.listen_only)
        return broken

    def _land(self) -> None:
        flying, self._flying = self._flying, None
        if flying is None:
            return
        _, _, sequence, sender, frame = flying
        if self._broken:
            self._fail(flying)
            return
        if self.errors.get(sender):
            self.errors[sender] -= 1
        if isinstance(sender, Station):
            sender.waiting -= 1
            if sender.echo:
                sender.received.append(Heard(self.now_ns, frame, own=True))
        if sender is self._injector:
            # No node receives a copy of its own frames.
            self._deliver(self._copied.pop(sequence, sender), frame)
            return
        if not self._injector.frames:
            self._deliver(sender, frame)
            return
        for delay_ns, changed in self._injector.fate(frame, self.now_ns):
            if delay_ns:
                copy = self._queue.put(self._injector, self.now_ns + delay_ns, changed)
                self._copied[copy] = sender
            else:
                self._deliver(sender, changed)

    def _deliver(self, sender: Node, frame: Frame) -> None:
        now_ns = self.now_ns
        if self.log is not None:
            self.log.append((now_ns, frame))
        unplugged = self._injector.unplugged
        if isinstance(sender, EmulatedDrive) and sender.node_id in unplugged:
            return
        errors = self.errors
        for node in self._nodes:
            if node is sender or errors[node] >= BUS_OFF:
                continue
            if isinstance(node, Station):
                heard = ERROR_FRAME if node in self._strangers else frame
                node.received.append(Heard(now_ns, heard))
            elif not (isinstance(node, EmulatedDrive) and node.node_id in unplugged):
                node.receive(frame, now_ns)
                if answers := node.take():
                    self._enqueue(node, answers)

    def _fail(self, flying: Waiting) -> None:
        """Send an error frame to all nodes; the sender repeats its frame until it is bus-off."""
        for node in self._nodes:
            if isinstance(node, Station):
                node.received.append(Heard(self.now_ns, ERROR_FRAME))
        sender = flying.sender
        if sender not in self.errors:
            return
        self.errors[sender] += 8
        if not self.off_bus(sender):
            self._queue.put_back(flying, self.now_ns)
            return
        self._queue.drop(sender)
        if isinstance(sender, Station):
            sender.waiting = 0
            sender.received.append(Heard(self.now_ns, BUS_OFF_FRAME))
        elif isinstance(sender, EmulatedDrive):
            sender.bus_off(self.now_ns)

    def _strike(self, fault: NodeFault, *, begins: bool) -> None:
        for drive in self.drives:
            if drive.node_id == fault.node_id:
                self._injector.strike(drive, fault, self.now_ns, begins=begins)
                if self._injector.cuts_off(fault):
                    if begins:
                        self.errors[drive] = BUS_OFF
                    else:
                        self.recover(drive)
