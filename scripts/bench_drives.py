"""What the cyclic link costs, against raw frames and against another stack, in the same run.

The peer is a process of its own behind an AF_UNIX bus. It answers every SYNC with both drives'
process data, those of a motion that was recorded on emulated drives (`bench_motion`): of a leg at
rest, of one that hops, and of one that hops and sways, so that every watch of the limits works.
Raw frames, the link and the other stack take turns, and the ratios are those of neighbours.

Drives do not compute on the master's processor, so the peer has another one. How the same frames
compare where both share one, and nothing is done while the peer answers, is printed without a
bound.
"""

import os
import statistics
import struct
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, final

import can
import canopen
import numpy as np
from bench_motion import (
    ANSWER,
    ANSWERS,
    ROOT,
    SYNC,
    Kind,
    bench_config,
    emulated_bus,
    leader,
    open_link,
    record_motion,
)
from bench_peer import APART, SHARED, play, served

from legbench.drives.emulated.bus import LockstepBus
from legbench.drives.master.link import Link
from legbench.drives.master.session import Session
from legbench.drives.setup.config import BusConfig
from legbench.plant.can import CanPlant
from legbench.recording.writer import RunWriter
from legbench.signals import Observation

WARM_UP, CYCLES = 700, 300
"""Cycles until a hop sways and its momentum is watched, and those whose CPU time is taken apart."""
ROUNDS, BLOCK = 40, 30
"""Blocks of cycles take turns, so that whatever slows the machine down slows all of them."""
OTHER_EVERY = 4
"""Rounds between two of the other stack, whose threads take long to begin and to end."""
COMMANDS = (0x201, 0x202)
COMMAND = struct.Struct("<Hi")
"""Controlword and target."""
PATIENCE = 5.0
"""Longest wait for an answer, so that a machine that is busy elsewhere loses none [s]."""
PARTS = ("controller", "record", "link")
BOUNDS = {"link over raw": 1.3, "link over canopen": 0.8, "cycle cpu p50 [us]": 350.0}


@final
class Switched(can.BusABC):
    """The emulated bus until the drives are enabled, then the peer."""

    def __init__(self, first: LockstepBus) -> None:
        self.inner: can.BusABC = first
        self._first = first
        # No other bench on this machine shares its lock.
        self.channel_info = f"bench of process {os.getpid()}"
        super().__init__(channel="switched")

    def send(self, msg: can.Message, timeout: float | None = None) -> None:
        """Send on the bus behind."""
        self.inner.send(msg, timeout)

    def recv(self, timeout: float | None = None) -> can.Message | None:
        """Receive from the bus behind; a peer that the machine holds up is waited for."""
        return self.inner.recv(PATIENCE if timeout and self.inner is not self._first else timeout)


@final
class Free:
    """A grid without waiting: time is what was waited for."""

    def __init__(self, first: LockstepBus) -> None:
        self.first: LockstepBus | None = first
        self._now_ns = 0

    def now_ns(self) -> int:
        """Return the present time [ns]."""
        return self._now_ns if self.first is None else self.first.timebase.now_ns()

    def wait_until(self, at_ns: int) -> None:
        """Pass the time to `at_ns` without waiting."""
        if self.first is not None:
            self.first.timebase.wait_until(at_ns)
        self._now_ns = max(self._now_ns, at_ns)


def raw_cycle(bus: can.BusABC, targets: tuple[int, int]) -> Callable[[], None]:
    """SYNC, two answers, two commands, with nothing around them."""

    def cycle() -> None:
        bus.send(can.Message(arbitration_id=SYNC, is_extended_id=False))
        missing = 2
        while missing:
            message = bus.recv(PATIENCE)
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
    """Return a raw cycle made of PDO objects of `canopen`, and the network that is to end."""
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
    """Wall time of each cycle of a block [us]."""
    took = []
    for _ in range(BLOCK):
        began = time.perf_counter()
        cycle()
        took.append(1e6 * (time.perf_counter() - began))
    return took


def cpu_parts(plant: CanPlant, kind: Kind, seen: Observation) -> dict[str, list[float]]:
    """CPU time of the parts of a cycle with controller, limits and recording [us]."""
    took: dict[str, list[float]] = {name: [] for name in (*PARTS, "whole")}
    step = leader(kind, seen)
    with (
        tempfile.TemporaryDirectory() as folder,
        RunWriter.create(Path(folder), {"plant": "can"}) as writer,
    ):
        for _ in range(WARM_UP + CYCLES):
            began, at = time.process_time(), [time.thread_time()]
            command = step(seen)
            at.append(time.thread_time())
            writer.append(command, seen, 0.0, 0.0)
            at.append(time.thread_time())
            seen = plant.step(command)
            at.append(time.thread_time())
            for name, seconds in zip(PARTS, np.diff(at), strict=True):
                took[name].append(1e6 * float(seconds))
            took["whole"].append(1e6 * (time.process_time() - began))
    return {name: values[WARM_UP:] for name, values in took.items()}


Blocks = list[list[float]]
"""Times of the cycles of each block [us]."""
WHO = ("raw", "ours")


def rounds(
    bus: can.BusABC,
    switched: Switched,
    link: Link,
    commands: Iterator[tuple[float, ...]],
    move: Callable[[str], None],
) -> dict[str, Blocks]:
    """Wall time of blocks that take turns: raw frames, the link, now and then `canopen`."""

    def exchange() -> None:
        link.command(next(commands))
        link.exchange()

    def ours() -> list[float]:
        play(bus, True)
        try:
            return timed(exchange)
        finally:
            play(bus, False)

    targets = [axis.target_counts for axis in link.cycle.axes]
    raw = raw_cycle(switched, (targets[0], targets[1]))
    other, network = canopen_cycle(bus, (targets[0], targets[1]))
    took: dict[str, Blocks] = {f"{who} {where}": [] for who in WHO for where in (APART, SHARED)}
    took["canopen"] = []
    blocks = {"raw": lambda: timed(raw), "ours": ours}
    for number in range(ROUNDS):
        for where in (SHARED, APART):
            move(where)
            # Who goes first takes turns, too.
            for who in WHO if number % 2 else reversed(WHO):
                took[f"{who} {where}"].append(blocks[who]())
        if number % OTHER_EVERY == 0:
            network.notifier = can.Notifier(bus, network.listeners, 0.001)
            took["canopen"].append(timed(other))
            network.notifier.stop(1.0)
    return took


def undisturbed(blocks: Blocks) -> float:
    """Time of a cycle that nothing else on the machine held up: the lowest decile [us]."""
    return statistics.quantiles([cycle for block in blocks for cycle in block], n=10)[0]


def measure(config: BusConfig, kind: Kind) -> tuple[dict[str, list[float]], dict[str, Blocks]]:
    """CPU time of the parts of a cycle and wall time of blocks, for one motion [us]."""
    motion = record_motion(config, WARM_UP + CYCLES + 2 * ROUNDS * BLOCK, kind)
    with served(motion) as (bus, move):
        first = emulated_bus(config, kind)
        switched, free = Switched(first), Free(first)
        plant, link = open_link(Session(switched, config, free))
        try:
            seen = plant.reset()
            free.wait_until(free.now_ns())
            switched.inner, free.first = bus, None
            move(APART)
            play(bus, True)
            parts = cpu_parts(plant, kind, seen)
            play(bus, False)
            commands = iter(motion.commands[WARM_UP + CYCLES :])
            took = rounds(bus, switched, link, commands, move)
        finally:
            switched.inner, free.first = first, first
            plant.close()
            first.shutdown()
    return parts, took


def over(blocks: tuple[list[float], list[float]]) -> float:
    """Ratio of the medians of two blocks [-]."""
    return statistics.median(blocks[0]) / statistics.median(blocks[1])


def main() -> int:
    """Measure and print; 1 if a bound is missed."""
    config, missed = bench_config(), False
    print(f"load {', '.join(f'{load:.2f}' for load in os.getloadavg())}")
    for kind in Kind:
        parts, took = measure(config, kind)
        best = {name: undisturbed(blocks) for name, blocks in took.items()}
        found = {
            "link over raw": best["ours apart"] / best["raw apart"],
            "link over canopen": best["ours apart"] / best["canopen"],
            "cycle cpu p50 [us]": statistics.median(parts["whole"]),
        }
        print(kind)
        for where, words in ((APART, "a processor of its own"), (SHARED, "the link's processor")):
            raw, ours = took[f"raw {where}"], took[f"ours {where}"]
            pairs = zip(ours, raw, strict=True)
            middle = statistics.median(map(over, pairs))
            print(
                f"  peer on {words}: raw {undisturbed(raw):.1f}, link {undisturbed(ours):.1f} us, "
                f"{undisturbed(ours) / undisturbed(raw):.2f}; neighbouring blocks {middle:.2f}"
            )
        cpu = ", ".join(f"{name} {statistics.median(us):.1f}" for name, us in parts.items())
        print(f"  cpu p50 [us]: {cpu}")
        for name, value in found.items():
            words = "ok" if value <= BOUNDS[name] else "MISSED"
            print(f"  {name:<20} {value:7.2f}  bound {BOUNDS[name]:g}  {words}")
            missed = missed or value > BOUNDS[name]
    return int(missed)


if __name__ == "__main__":
    sys.exit(main())
