"""An emulated CiA 301/402 drive: frames in, frames out, time is an argument; pure."""

import random
from collections.abc import Sequence
from contextlib import suppress
from typing import final

from legbench.drives.emulated.axis import SYNC_MISSING, Axis
from legbench.drives.emulated.behaviour import Behaviour
from legbench.drives.emulated.dictionary import Dictionary, dictionary_of
from legbench.drives.emulated.heartbeats import HeartbeatConsumer, HeartbeatProducer
from legbench.drives.emulated.oddities import changed
from legbench.drives.emulated.process_data import ProcessData
from legbench.drives.emulated.store import ObjectStore
from legbench.drives.emulated.warmth import HOT, WARM, show_temperature
from legbench.drives.errors import SdoAbortError
from legbench.drives.protocol.cia402 import DriveState
from legbench.drives.protocol.frame import (
    HEARTBEAT_BASE,
    LAST_NODE,
    NMT_ID,
    SDO_REPLY_BASE,
    SDO_REQUEST_BASE,
    SYNC_ID,
    Frame,
)
from legbench.drives.protocol.nmt import NmtCommand, NmtState, decode_nmt, heartbeat_frame
from legbench.drives.protocol.objects import Key
from legbench.drives.protocol.sdo import Abort
from legbench.drives.protocol.sdo_server import SdoServer
from legbench.drives.setup.config import NodeConfig, Parameter

UNDER_VOLTAGE, OVER_TEMPERATURE = 0x3220, 0x4310
HEARTBEAT_LOST, PDO_SHORT, PDO_LONG, SYNC_LENGTH, RPDO_LATE = 0x8130, 0x8210, 0x8220, 0x8240, 0x8250
_ORDERS = {
    NmtCommand.START: NmtState.OPERATIONAL,
    NmtCommand.STOP: NmtState.STOPPED,
    NmtCommand.ENTER_PRE_OPERATIONAL: NmtState.PRE_OPERATIONAL,
}


@final
class EmulatedDrive:
    """Emulated drive with one node id on the bus.

    Attributes:
        node_id: its address.
        state: NMT state; `BOOT_UP` until the boot-up message is out.
        axis: the CiA 402 half.
    """

    def __init__(
        self,
        node: NodeConfig,
        behaviour: Behaviour | None = None,
        kept: Sequence[Parameter] = (),
        dictionary: Dictionary | None = None,
    ) -> None:
        """Switch it on; `kept` is what its memory holds instead of the defaults (1010h)."""
        self._node, self._behaviour, self._kept = node, behaviour or Behaviour(), kept
        self.node_id = node.node_id
        self._random = random.Random(self._behaviour.seed * LAST_NODE + node.node_id)
        how = self._behaviour
        self._dictionary = shown = changed(dictionary or dictionary_of(node), node, how)
        self._store = ObjectStore(
            shown.entries, self._check, self._written, shown.hidden, lacking=how.lacking
        )
        self._values = self._store.values
        self.axis = Axis(node, how, self._values, shown.links)
        self._pdos = ProcessData(self._store)
        self._target = node.target_object.key
        self._sdo = SdoServer(self._store.read, self._store.write, how.sdo_answers)
        self.state = NmtState.BOOT_UP
        self._now_ns = 0
        self._tick_ns = 0
        self._boot_ns = 1000 * how.boot_us
        self._beats = HeartbeatProducer()
        self._sync_ns: int | None = None
        self._fresh = False
        self._heartbeats = HeartbeatConsumer(self._values)
        self._out: list[tuple[int, Frame]] = []
        self._recall()

    def _recall(self) -> None:
        show_temperature(self._store, self._dictionary, self._node, WARM)
        for parameter in self._kept:
            with suppress(SdoAbortError):
                self._store.recall(parameter.key, parameter.value)

    # --- what the wire and the body call -----------------------------------------------------

    def take(self) -> list[tuple[int, Frame]]:
        """Frames to send since the last call, each with the time at which it is ready [ns]."""
        out, self._out = self._out, []
        return out

    def receive(self, frame: Frame, now_ns: int) -> None:
        """Receive a frame of another node; whatever it says, nothing is raised."""
        self._now_ns = now_ns
        if frame.error or frame.extended or frame.remote or self.state is NmtState.BOOT_UP:
            return
        cob_id, data = frame.cob_id, frame.data
        if cob_id == SYNC_ID:
            self._sync(data)
        elif cob_id in self._pdos.rpdos:
            self._rpdo(cob_id, data)
        elif cob_id == SDO_REQUEST_BASE + self.node_id:
            if self.state is not NmtState.STOPPED:
                reply = self._sdo.feed(data)
                if reply is not None:
                    self._send(Frame(SDO_REPLY_BASE + self.node_id, reply))
        elif cob_id == NMT_ID:
            order = decode_nmt(data)
            if order is not None and order[1] in (0, self.node_id):
                self._obey(order[0])
        elif HEARTBEAT_BASE < cob_id <= HEARTBEAT_BASE + LAST_NODE:
            self._heard(cob_id - HEARTBEAT_BASE, data)
        self._forward()

    def tick(self, now_ns: int) -> float:
        """Move until now and check the timers; returns the true motor position [rad]."""
        step_ns, self._now_ns, self._tick_ns = now_ns - self._tick_ns, now_ns, now_ns
        if step_ns <= 0:
            return self.axis.motion.angle
        if self.state is NmtState.BOOT_UP:
            if now_ns >= self._boot_ns:
                self._boot()
            return self.axis.motion.angle
        angle = self.axis.tick(now_ns, step_ns)
        self._timers()
        self._forward()
        return angle

    def sense(self, link_pos: float, spring_torque: float) -> None:
        """Take over the state of the body in this tick: link angle [rad], spring torque [N m]."""
        self.axis.sense(link_pos, spring_torque)
        self.axis.publish()
        if self.state is NmtState.OPERATIONAL:
            for frame in self._pdos.events(self._now_ns):
                self._send(frame)

    # --- faults to inject --------------------------------------------------------------------

    def reset(self, now_ns: int) -> None:
        """Start over, as after a brown-out: configuration and state are lost."""
        self._now_ns = now_ns
        self._store.load_defaults()
        self.axis.restart()
        self._pdos.rebuild()
        self._recall()
        self._heartbeats.clear()
        self._out.clear()
        self.state, self._sync_ns, self._fresh = NmtState.BOOT_UP, None, False
        self._boot_ns = now_ns + 1000 * self._behaviour.boot_us

    def trip(self, code: int, now_ns: int) -> None:
        """Bring on the lasting cause of an error, such as `UNDER_VOLTAGE`."""
        self._now_ns = now_ns
        self.axis.alarms.hold(code)
        if code == OVER_TEMPERATURE:
            show_temperature(self._store, self._dictionary, self._node, HOT)
        self.axis.fault(code)
        self._forward()

    def untrip(self, code: int) -> None:
        """Remove the cause of an error; a fault reset is possible again."""
        self.axis.alarms.release(code)

    def bus_off(self, now_ns: int) -> None:
        """Stop by 6007h, as the drive's own controller is bus-off."""
        self._now_ns = now_ns
        self.axis.power.connection_lost()
        self._out.clear()

    def repeat_process_data(self, repeat: bool) -> None:
        """Repeat the last process data to the bit, while everything else goes on."""
        self._pdos.repeats = repeat

    def mute_heartbeat(self, mute: bool = True) -> None:
        """Stop producing heartbeats, while everything else goes on."""
        self._beats.mute = mute

    # --- CiA 301 -----------------------------------------------------------------------------

    def _check(self, key: Key, value: int) -> Abort | None:
        if (refusal := self._dictionary.refusal(key, value)) is not None:
            return refusal
        if ProcessData.owns(key):
            return self._pdos.check(key, value)
        if key == (0x1019, 0) and self._values[0x1006, 0]:
            return Abort.DEVICE_STATE
        return self.axis.check(key, value)

    def _written(self, key: Key) -> None:
        if ProcessData.owns(key):
            if key[0] & 0x200 or key[1] in (1, 2, 5):
                self._pdos.rebuild()
        elif key[0] == 0x1016:
            self._heartbeats.clear()
        elif key[0] >= 0x6000 or key == self._target:
            if key == self._target:
                self._fresh = True
            self.axis.written(key, self._now_ns)

    def _boot(self) -> None:
        self.state = NmtState.PRE_OPERATIONAL
        self._pdos.rebuild()
        self.axis.power.boot()
        self._beats.since_ns = self._now_ns
        self._out.append((self._now_ns, heartbeat_frame(self.node_id, NmtState.BOOT_UP)))

    def _obey(self, command: NmtCommand) -> None:
        if command in (NmtCommand.RESET_NODE, NmtCommand.RESET_COMMUNICATION):
            self.reset(self._now_ns)
            return
        self._enter(_ORDERS[command])

    def _enter(self, state: NmtState) -> None:
        before, self.state = self.state, state
        if before is NmtState.OPERATIONAL and state is not NmtState.OPERATIONAL:
            self.axis.power.connection_lost()
            self._pdos.forget()
            self._sync_ns, self._fresh = None, False
        elif state is NmtState.OPERATIONAL and before is not state:
            self._heartbeats.start(self._now_ns)

    def _heard(self, node_id: int, data: bytes) -> None:
        if self._heartbeats.hear(node_id, data, self._now_ns):
            self._send_now(self.axis.alarms.clear(HEARTBEAT_LOST))

    def _sync(self, data: bytes) -> None:
        overflow = self._values[0x1019, 0]
        if len(data) != (1 if overflow else 0):
            self._send_now(self.axis.alarms.raise_(SYNC_LENGTH))
            return
        if self.state is not NmtState.OPERATIONAL:
            return
        for frame in self._pdos.at_sync():
            self._send(frame)
        self._pdos.latch()
        self.axis.sync(self._fresh, self._now_ns)
        self._fresh, self._sync_ns = False, self._now_ns

    def _rpdo(self, cob_id: int, data: bytes) -> None:
        if self.state is not NmtState.OPERATIONAL:
            return
        size = self._pdos.rpdos[cob_id].layout.size
        if len(data) < size:
            self._send_now(self.axis.alarms.raise_(PDO_SHORT))
            return
        if len(data) > size:
            self._send_now(self.axis.alarms.raise_(PDO_LONG))
        self._send_now(self.axis.alarms.clear(RPDO_LATE))
        window_ns = 1000 * self._values[0x1007, 0]
        late = bool(window_ns and self._sync_ns and self._now_ns - self._sync_ns > window_ns)
        self._pdos.receive(cob_id, data[:size], self._now_ns, late=late)

    def _timers(self) -> None:
        now_ns, values = self._now_ns, self._values
        if self._beats.due(1_000_000 * values[0x1017, 0], now_ns):
            self._out.append((now_ns, heartbeat_frame(self.node_id, self.state)))
        if self._heartbeats.lost(now_ns):
            self._heartbeats.clear()
            self._connection_lost(HEARTBEAT_LOST)
        for pdo in self._pdos.rpdos.values():
            late = pdo.seen_ns is not None and now_ns - pdo.seen_ns > pdo.timer_ns
            if pdo.timer_ns and late:
                pdo.seen_ns = None
                self._connection_lost(RPDO_LATE)
        cycle_ns = 1000 * values[0x1006, 0] * self._behaviour.sync_loss_periods
        if cycle_ns and self._sync_ns is not None and now_ns - self._sync_ns > cycle_ns:
            self._sync_ns = None
            if self.axis.power.state is DriveState.OPERATION_ENABLED:
                self.axis.fault(SYNC_MISSING)

    def _connection_lost(self, code: int) -> None:
        """Handle a communication error: emergency, stop by 6007h, NMT state by 1029h."""
        self._send_now(self.axis.alarms.raise_(code))
        self.axis.power.connection_lost()
        fallback = {0: NmtState.PRE_OPERATIONAL, 2: NmtState.STOPPED}.get(self._values[0x1029, 1])
        if fallback is not None and self.state is NmtState.OPERATIONAL:
            self._enter(fallback)

    # --- output ------------------------------------------------------------------------------

    def _send(self, frame: Frame) -> None:
        low, high = self._behaviour.reply_delay_us
        delay_us = low if low == high else self._random.randint(low, high)
        self._out.append((self._now_ns + 1000 * delay_us, frame))

    def _send_now(self, frame: Frame | None) -> None:
        if frame is not None:
            self._out.append((self._now_ns, frame))

    def _forward(self) -> None:
        self._out += [(self._now_ns, frame) for frame in self.axis.take()]
