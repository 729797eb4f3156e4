"""An emulated CiA 301/402 drive: frames in, frames out, time is an argument; pure."""

import random
from collections.abc import Container, Sequence
from typing import final

from legbench.drives.emulated.axis import Axis
from legbench.drives.emulated.behaviour import Behaviour
from legbench.drives.emulated.connection import Connection
from legbench.drives.emulated.dictionary import Dictionary, dictionary_of
from legbench.drives.emulated.heartbeats import HeartbeatConsumer, HeartbeatProducer
from legbench.drives.emulated.lss import LssSlave, address_of
from legbench.drives.emulated.memory import ALL, Memory
from legbench.drives.emulated.oddities import changed
from legbench.drives.emulated.power import POWERED
from legbench.drives.emulated.process_data import ProcessData
from legbench.drives.emulated.reception import RPDO_LATE, Reception
from legbench.drives.emulated.rules import COMMUNICATION_PROFILE, SET_BACK, objection
from legbench.drives.emulated.store import ObjectStore
from legbench.drives.emulated.warmth import HOT, WARM, show_temperature
from legbench.drives.protocol import lss, nmt
from legbench.drives.protocol.cia402 import DriveState
from legbench.drives.protocol.frame import (
    COB_MASK,
    HEARTBEAT_BASE,
    LAST_NODE,
    NMT_ID,
    SDO_REPLY_BASE,
    SDO_REQUEST_BASE,
    Frame,
)
from legbench.drives.protocol.nmt import NmtCommand, NmtState, decode_nmt, heartbeat_frame
from legbench.drives.protocol.objects import Key
from legbench.drives.protocol.sdo import Abort, abort_error
from legbench.drives.protocol.sdo_server import SdoServer
from legbench.drives.setup.config import NodeConfig, Parameter

UNDER_VOLTAGE, OVER_TEMPERATURE = 0x3220, 0x4310
HEARTBEAT_LOST = 0x8130
SYNC = (0x1005, 0)
ERROR_COUNT, LATEST_ERROR = (0x1003, 0), (0x1003, 1)
_BOOT_UP, _OPERATIONAL = NmtState.BOOT_UP, NmtState.OPERATIONAL


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
        self._node, self._behaviour = node, behaviour or Behaviour()
        self.node_id, how = node.node_id, self._behaviour
        self._random = random.Random(how.seed * LAST_NODE + node.node_id)
        self._dictionary = shown = changed(dictionary or dictionary_of(node), node, how)
        self._store = ObjectStore(
            shown.entries, self._check, self._written, shown.hidden, lacking=how.lacking
        )
        self._values = self._store.values
        self._memory = Memory(self._store, shown, node.node_id, kept)
        self._memory.recall(self.node_id)
        self._lss = LssSlave(address_of(self._values), node.node_id)
        self.axis = Axis(node, how, self._values, shown.links)
        self._pdos = ProcessData(self._store)
        self._target = node.target_object.key
        self._sdo = SdoServer(self._read, self._store.write, how.sdo_answers)
        self.state = NmtState.BOOT_UP
        self._now_ns = self._tick_ns = 0
        self._boot_ns = 1000 * how.boot_us
        self._beats, self._heartbeats = HeartbeatProducer(), HeartbeatConsumer(self._values)
        self._connection = Connection(self.axis, self._values)
        self._reception = Reception(
            self._values, self.axis, self._pdos, self._connection, self._behaviour.sync_loss_periods
        )
        self._out: list[tuple[int, Frame]] = []
        show_temperature(self._store, self._dictionary, self._node, WARM)
        self._pdos.rebuild()

    # --- what the wire and the body call -----------------------------------------------------

    def take(self) -> list[tuple[int, Frame]]:
        """Frames to send since the last call, each with the time at which it is ready [ns]."""
        outlet = self._connection.outlet
        if not (self._out or outlet.ready):
            return []
        out, self._out = self._out + outlet.take(), []
        return out

    def receive(self, frame: Frame, now_ns: int) -> None:
        """Receive a frame of another node; whatever it says, nothing is raised."""
        self._now_ns = now_ns
        booting = self.state is _BOOT_UP and self.node_id != lss.UNCONFIGURED
        cob_id, data, remote, extended, error, _ = frame
        if error or extended or remote or booting:
            return
        if cob_id == lss.REQUEST_ID:
            self._reply(lss.ANSWER_ID, self._lss.feed(data))
            if self._lss.released:
                self._restart(ALL)
        elif self.node_id == lss.UNCONFIGURED:
            return
        elif cob_id == self._values[SYNC] & COB_MASK:
            if self._reception.is_sync(data, now_ns) and self.state is _OPERATIONAL:
                for sample in self._reception.sync(now_ns):
                    self._send(sample)
        elif cob_id in self._pdos.rpdos:
            if self.state is _OPERATIONAL:
                self._reception.rpdo(cob_id, data, now_ns)
        elif cob_id == SDO_REQUEST_BASE + self.node_id:
            if self.state is not NmtState.STOPPED:
                self._reply(SDO_REPLY_BASE + self.node_id, self._sdo.feed(data))
        elif cob_id == NMT_ID:
            order = decode_nmt(data)
            if order is not None and order[1] in (0, self.node_id):
                self._obey(order[0])
        elif cob_id > HEARTBEAT_BASE and self._heartbeats.take(
            cob_id - HEARTBEAT_BASE, data, now_ns
        ):
            self._connection.over(HEARTBEAT_LOST, now_ns)
        if self.axis.emergencies:
            self._connection.forward(self._now_ns)

    def tick(self, now_ns: int) -> float:
        """Move until now and check the timers; returns the true motor position [rad]."""
        step_ns, self._now_ns, self._tick_ns = now_ns - self._tick_ns, now_ns, now_ns
        if step_ns <= 0:
            return self.axis.motion.angle
        booting = self.state is _BOOT_UP
        running = self.axis.power.state is not DriveState.NOT_READY_TO_SWITCH_ON
        if booting and now_ns >= self._boot_ns and self.node_id != lss.UNCONFIGURED:
            self._boot()
        angle = self.axis.tick(now_ns, step_ns) if running else self.axis.motion.angle
        if not booting:
            self._timers()
        if self.axis.emergencies:
            self._connection.forward(self._now_ns)
        return angle

    def sense(self, link_pos: float, spring_torque: float) -> None:
        """Take over the state of the body in this tick: link angle [rad], spring torque [N m]."""
        self.axis.sense(link_pos, spring_torque)
        self.axis.publish()
        if self.state is _OPERATIONAL:
            for frame in self._pdos.events(self._now_ns):
                self._send(frame)

    # --- faults to inject --------------------------------------------------------------------

    def reset(self, now_ns: int) -> None:
        """Start over, as after a brown-out: what is not stored is lost, a node id, too."""
        self._now_ns = now_ns
        self._connection.outlet.clear()
        self.axis.restart()
        self._restart(ALL, cold=True)
        show_temperature(self._store, self._dictionary, self._node, WARM)

    def _restart(self, indices: Container[int], *, cold: bool = False) -> None:
        """Set objects among some indices back and boot; the node id is that set last over LSS."""
        self.node_id = self._lss.begin(cold=cold)
        self.axis.address(self.node_id)
        self._memory.recall(self.node_id, indices)
        self._pdos.rebuild()
        self._heartbeats.clear()
        self._out.clear()
        self._connection.outlet.mute()
        self._reception.forget()
        self.state = NmtState.BOOT_UP
        self._boot_ns = self._now_ns + 1000 * self._behaviour.boot_us

    def trip(self, code: int, now_ns: int) -> None:
        """Bring on the lasting cause of an error, such as `UNDER_VOLTAGE`."""
        self._now_ns = now_ns
        self.axis.alarms.hold(code)
        if code == OVER_TEMPERATURE:
            show_temperature(self._store, self._dictionary, self._node, HOT)
        self.axis.fault(code)
        self._connection.forward(self._now_ns)

    def clear_trip(self, code: int) -> None:
        """Remove the cause of an error; a fault reset is possible again."""
        self.axis.alarms.release(code)

    def bus_off(self, now_ns: int) -> None:
        """Stop by 6007h, as the drive's own controller is bus-off."""
        self._now_ns = now_ns
        self._out.clear()
        self._connection.leave_bus(now_ns)

    def bus_on(self, now_ns: int) -> None:
        """Report that the drive was off the bus, as it is back."""
        self._now_ns = now_ns
        if self.state is not NmtState.BOOT_UP:
            self._connection.rejoin_bus(now_ns)

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
        if key[0] in COMMUNICATION_PROFILE:
            if Memory.owns(key):
                return Memory.check(key, value, powered=self.axis.power.state in POWERED)
            if ProcessData.owns(key):
                return self._pdos.check(key, value)
        return objection(key, value, self._values) or self.axis.check(key, value)

    def _read(self, index: int, sub: int) -> bytes:
        if (index, sub) == LATEST_ERROR and not self._values[ERROR_COUNT]:
            raise abort_error(Abort.NO_DATA, index, sub)
        return self._store.read(index, sub)

    def _written(self, key: Key) -> None:
        if key[0] >= 0x6000 or key == self._target:
            if key == self._target:
                self._reception.fresh = True
            self.axis.written(key, self._now_ns)
        elif ProcessData.owns(key):
            if key[0] & 0x200 or key[1] in (1, 2, 5):
                self._pdos.rebuild()
        elif Memory.owns(key):
            self._memory.obey(key)
        elif key[0] == 0x1016:
            self._heartbeats.clear()
        elif key == ERROR_COUNT:
            self._values[LATEST_ERROR] = 0

    def _boot(self) -> None:
        self.state = NmtState.PRE_OPERATIONAL
        self._pdos.rebuild()
        if self.axis.power.state is DriveState.NOT_READY_TO_SWITCH_ON:
            self.axis.boot(self._now_ns)
        self._beats.since_ns = self._now_ns
        self._out.append((self._now_ns, heartbeat_frame(self.node_id, NmtState.BOOT_UP)))
        self._connection.outlet.unmute(self._now_ns)

    def _obey(self, command: NmtCommand) -> None:
        if command is NmtCommand.RESET_NODE:
            self.reset(self._now_ns)
        elif command is NmtCommand.RESET_COMMUNICATION:
            self._restart(SET_BACK)
            self._connection.end(self._now_ns)
        else:
            self._enter(nmt.ORDERED[command])

    def _enter(self, state: NmtState) -> None:
        before, self.state = self.state, state
        if before is NmtState.OPERATIONAL and state is not NmtState.OPERATIONAL:
            self._connection.end(self._now_ns)
            self._pdos.forget()
            self._reception.forget()
        elif state is NmtState.OPERATIONAL and before is not state:
            self._heartbeats.start(self._now_ns)

    def _timers(self) -> None:
        now_ns, values = self._now_ns, self._values
        if self._beats.due(1_000_000 * values[0x1017, 0], now_ns):
            self._out.append((now_ns, heartbeat_frame(self.node_id, self.state)))
        if self._heartbeats.lost(now_ns):
            self._heartbeats.clear()
            self._connection_lost(HEARTBEAT_LOST)
        for _ in range(self._reception.late_rpdos(now_ns)):
            self._connection_lost(RPDO_LATE)
        self._reception.watch_sync(now_ns)

    def _connection_lost(self, code: int) -> None:
        """Handle a communication error: emergency, stop by 6007h, NMT state by 1029h."""
        self._connection.lost(code, self._now_ns)
        fallback = {0: NmtState.PRE_OPERATIONAL, 2: NmtState.STOPPED}.get(self._values[0x1029, 1])
        if fallback is not None and self.state is NmtState.OPERATIONAL:
            self._enter(fallback)

    # --- output ------------------------------------------------------------------------------

    def _reply(self, cob_id: int, data: bytes | None) -> None:
        if data is not None:
            self._send(Frame(cob_id, data))

    def _send(self, frame: Frame) -> None:
        low, high = self._behaviour.reply_delay_us
        delay_us = low if low == high else self._random.randint(low, high)
        self._out.append((self._now_ns + 1000 * delay_us, frame))
