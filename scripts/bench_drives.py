"""What the cyclic link costs, against raw frames and against another stack, in the same run.

The peer is a process of its own behind an AF_UNIX bus. It answers every SYNC with both drives'
process data, the position being the last target. Time is CPU time and wall time of this process.
"""

import multiprocessing
import socket
import statistics
import struct
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any, final

import can
import canopen
import numpy as np

from legbench.control import JumpConfig
from legbench.design import load_design
from legbench.drives.emulated.behaviour import Behaviour
from legbench.drives.emulated.build import emulate
from legbench.drives.emulated.bus import LockstepBus
from legbench.drives.master.session import Session
from legbench.drives.protocol.frame import Frame
from legbench.drives.setup.bus_file import load_bus, load_limits
from legbench.drives.setup.config import BusConfig
from legbench.drives.transport.unix_bus import UnixBus
from legbench.drives.transport.unix_packet import PACKET, pack_frame, unpack_frame
from legbench.experiment import Experiment, make_controller, start_of, targets_of
from legbench.plant.can import CanPlant
from legbench.plant.emulated_leg import EmulatedLeg
from legbench.recording.writer import RunWriter

ROOT = Path(__file__).parents[1]
CYCLES, WARM_UP = 1000, 200
ROUNDS, BLOCK = 40, 100
"""Blocks of cycles take turns, so that whatever slows the machine down slows all of them."""
BEAT_EVERY = 10
STATUS = 0x1237
"""Operation enabled, remote, follows its command."""
COMMAND, ANSWER = struct.Struct("<Hi"), struct.Struct("<Hih")
SYNC, COMMANDS, ANSWERS = 0x080, (0x201, 0x202), (0x181, 0x182)
SDO_REQUESTS, TEMPERATURE = (0x601, 0x602), bytes.fromhex("4B702000FA000000")
"""The only object that is asked for in the cycle: 2070h, 25.0 deg C."""


def peer(listener: socket.socket, positions: tuple[int, int], links: tuple[int, int]) -> None:
    """Answer every SYNC until the other end is closed."""
    port, _ = listener.accept()
    count, at = 0, list(positions)
    while True:
        try:
            frame = unpack_frame(port.recv(PACKET.size + 1))
        except ConnectionResetError:
            return
        if frame is None:
            return
        if frame.cob_id in COMMANDS:
            at[COMMANDS.index(frame.cob_id)] = COMMAND.unpack(frame.data)[1]
        elif frame.cob_id in SDO_REQUESTS:
            port.send(pack_frame(Frame(frame.cob_id - 0x80, TEMPERATURE)))
        elif frame.cob_id == SYNC:
            count += 1
            for cob_id, position, link in zip(ANSWERS, at, links, strict=True):
                port.send(pack_frame(Frame(cob_id, ANSWER.pack(STATUS, position, link))))
            if count % BEAT_EVERY == 0:
                for node_id in (1, 2):
                    port.send(pack_frame(Frame(0x700 + node_id, b"\x05")))


@final
class Switched(can.BusABC):
    """The emulated bus until the drives are enabled, then the peer."""

    def __init__(self, first: LockstepBus) -> None:
        self.inner: can.BusABC = first
        self.channel_info = "switched"
        super().__init__(channel="switched")

    def send(self, msg: can.Message, timeout: float | None = None) -> None:
        """As the bus behind."""
        self.inner.send(msg, timeout)

    def recv(self, timeout: float | None = None) -> can.Message | None:
        """As the bus behind."""
        return self.inner.recv(timeout)


@final
class Free:
    """A grid without waiting: time is what was waited for."""

    def __init__(self, first: LockstepBus) -> None:
        self.first: LockstepBus | None = first
        self._now_ns = 0

    def now_ns(self) -> int:
        """Now [ns]."""
        return self._now_ns if self.first is None else self.first.timebase.now_ns()

    def wait_until(self, at_ns: int) -> None:
        """Be there."""
        if self.first is not None:
            self.first.timebase.wait_until(at_ns)
        self._now_ns = max(self._now_ns, at_ns)


def raw_cycle(bus: can.BusABC, targets: tuple[int, int]) -> Callable[[], None]:
    """SYNC, two answers, two commands, with nothing around them."""

    def cycle() -> None:
        bus.send(can.Message(arbitration_id=SYNC, is_extended_id=False))
        missing = 2
        while missing:
            message = bus.recv(0.1)
            if message is None:
                raise TimeoutError("the peer is gone")
            if message.arbitration_id in ANSWERS:
                ANSWER.unpack(message.data)
                missing -= 1
        for cob_id, target in zip(COMMANDS, targets, strict=True):
            data = COMMAND.pack(0x0F, target)
            bus.send(can.Message(arbitration_id=cob_id, data=data, is_extended_id=False))

    return cycle


def canopen_cycle(bus: can.BusABC, targets: tuple[int, int]) -> tuple[Callable[[], None], Any]:
    """The same by the PDO objects of the `canopen` package, and the network to end."""
    network = canopen.Network()
    network.bus = bus
    nodes = []
    for place in (1, 2):
        node = canopen.RemoteNode(place, str(ROOT / "hardware" / "legbench-drive.eds"))
        network.add_node(node)
        node.rpdo[1].clear()
        node.rpdo[1].add_variable(0x6040)
        node.rpdo[1].add_variable(0x607A)
        node.tpdo[1].clear()
        for index in (0x6041, 0x6064, 0x2064):
            node.tpdo[1].add_variable(index)
        node.rpdo[1].cob_id, node.tpdo[1].cob_id = 0x200 + place, 0x180 + place
        node.rpdo[1].enabled = node.tpdo[1].enabled = True
        node.tpdo[1].subscribe()
        nodes.append(node)

    def cycle() -> None:
        before = [node.tpdo[1].timestamp for node in nodes]
        network.sync.transmit()
        for node, last in zip(nodes, before, strict=True):
            with node.tpdo[1].receive_condition:
                while node.tpdo[1].timestamp == last:
                    node.tpdo[1].receive_condition.wait(0.1)
            [node.tpdo[1][index].raw for index in (0x6041, 0x6064, 0x2064)]
        for node, target in zip(nodes, targets, strict=True):
            node.rpdo[1][0x6040].raw = 0x0F
            node.rpdo[1][0x607A].raw = target
            node.rpdo[1].transmit()

    return cycle, network


def timed(cycle: Callable[[], object]) -> list[float]:
    """Wall time of every cycle [us]."""
    took = []
    for _ in range(BLOCK):
        began = time.perf_counter()
        cycle()
        took.append(1e6 * (time.perf_counter() - began))
    return took


def whole(config: BusConfig, bus: can.BusABC, folder: Path) -> dict[str, list[float]]:
    """CPU time of the parts of a cycle with controller, limits and recording [us]."""
    chosen = Experiment(
        design=load_design(ROOT / "models" / "optimal.toml"), controller=JumpConfig()
    )
    start = start_of(chosen)
    drives = emulate(
        config,
        [Behaviour(start_pos=float(pos)) for pos in start.motor_pos],
        body=EmulatedLeg(chosen.design, chosen.options, start),
    )
    first = LockstepBus("bench", network=drives)
    switched, free = Switched(first), Free(first)
    session = Session(switched, config, free)
    # A machine that is busy elsewhere is not the link's fault.
    limits = replace(
        load_limits(ROOT / "hardware" / "limits.toml"),
        lost_frames=CYCLES,
        waive=("lost_frames",),
    )
    link = session.link(limits, chosen.design.stiffness)
    plant = CanPlant(session, link, start)
    controller = make_controller(chosen.controller, targets_of(chosen))
    seen = plant.reset()
    free.wait_until(free.now_ns())
    switched.inner, free.first = bus, None
    targets = [
        node.motor.to_counts(float(pos))
        for node, pos in zip(config.nodes, start.motor_pos, strict=True)
    ]
    applied = start.motor_pos.tolist()

    def exchange() -> None:
        link.exchange()
        link.command(applied)

    raw = raw_cycle(switched, (targets[0], targets[1]))
    rounds: dict[str, list[float]] = {"raw": [], "ours": [], "canopen": []}
    other, network = canopen_cycle(bus, (targets[0], targets[1]))
    for _ in range(ROUNDS):
        rounds["raw"].append(statistics.median(timed(raw)))
        rounds["ours"].append(statistics.median(timed(exchange)))
        network.notifier = can.Notifier(bus, network.listeners, 0.001)
        rounds["canopen"].append(statistics.median(timed(other)))
        network.notifier.stop(1.0)
    parts: dict[str, list[float]] = {"controller": [], "record": [], "link": [], "whole": []}
    controller.reset(seen)
    with RunWriter.create(folder, {"plant": "can"}) as writer:
        for _ in range(CYCLES + WARM_UP):
            began, at = time.process_time(), [time.thread_time()]
            command = controller.step(seen)
            at.append(time.thread_time())
            writer.append(command, seen, 0.0, 0.0)
            at.append(time.thread_time())
            seen = plant.step(command)
            at.append(time.thread_time())
            for name, took in zip(("controller", "record", "link"), np.diff(at), strict=True):
                parts[name].append(1e6 * float(took))
            parts["whole"].append(1e6 * (time.process_time() - began))
    switched.inner, free.first = first, first
    plant.close()
    first.shutdown()
    kept = {name: values[WARM_UP:] for name, values in parts.items()}
    return {**rounds, **kept}


def main() -> int:
    """Measure and print; 1 if a bound is missed."""
    # Time is what was waited for: a peer that is late makes it run ahead of its heartbeats.
    config = replace(
        load_bus(ROOT / "hardware" / "leg.toml"), heartbeat_ms=1000, waive=("drive heartbeat",)
    )
    chosen = Experiment(
        design=load_design(ROOT / "models" / "optimal.toml"), controller=JumpConfig()
    )
    start = start_of(chosen)
    pairs = list(zip(config.nodes, start.motor_pos, start.joint_pos, strict=True))
    motors = [node.motor.to_counts(float(motor)) for node, motor, _ in pairs]
    links = [node.link_units.to_counts(float(link)) for node, _, link in pairs]
    with (
        tempfile.TemporaryDirectory() as folder,
        socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET) as listener,
    ):
        path = f"{folder}/bus"
        listener.bind(path)
        listener.listen()
        process = multiprocessing.get_context("fork").Process(
            target=peer, args=(listener, (motors[0], motors[1]), (links[0], links[1])), daemon=True
        )
        process.start()
        bus = UnixBus(path)
        found = whole(config, bus, Path(folder))
    ratios = [
        statistics.median(a / b for a, b in zip(found["ours"], found[name], strict=True))
        for name in ("raw", "canopen")
    ]
    bus.shutdown()
    whole_us = statistics.median(found["whole"])
    print(f"{'raw five frames':<28} {statistics.median(found['raw']):8.1f} us")
    print(f"{'canopen, PDO objects':<28} {statistics.median(found['canopen']):8.1f} us")
    print(f"{'our link':<28} {statistics.median(found['ours']):8.1f} us")
    for part in ("link", "controller", "record", "whole"):
        print(f"{'cpu p50, ' + part:<28} {statistics.median(found[part]):8.1f} us")
    results = (
        ("link over raw", ratios[0], 1.6),
        ("link over canopen", ratios[1], 0.8),
        ("cycle cpu p50 [us]", whole_us, 350.0),
    )
    for name, value, bound in results:
        words = "ok" if value <= bound else "MISSED"
        print(f"{name:<28} {value:8.2f}  bound {bound:g}  {words}")
    process.join(2.0)
    return 0 if all(value <= bound for _, value, bound in results) else 1


if __name__ == "__main__":
    sys.exit(main())
