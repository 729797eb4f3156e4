"""Stacks that exchange the same five frames in turns: raw ones, the link, PDO objects of `canopen`.

Blocks of cycles take turns, so that whatever slows the machine down slows all of them, and each
ratio is the median of those of neighbouring blocks.
"""

import statistics
import struct
import time
from collections.abc import Callable, Iterable
from enum import StrEnum
from typing import Any

import can
import canopen
from bench_motion import ANSWER, ANSWERS, ROOT, SYNC
from bench_peer import APART, SHARED, play

from legbench.drives.transport.timebase import SystemTime

ROUNDS, BLOCK = 20, 60
UNTIMED = 30
"""Cycles at the beginning of a block that are not timed: its code and data have to come into the
caches again."""
OTHER_EVERY = 2
"""Rounds between two of the other stack, whose threads take long to begin and to end."""
PERIOD_NS = 1_000_000
"""Period of the cycles of a run [ns]."""
COMMANDS = (0x201, 0x202)
COMMAND = struct.Struct("<Hi")
"""Controlword and target."""
PATIENCE = 5.0
"""Longest wait for an answer, so that a machine that is busy elsewhere loses none [s]."""
Cycle = Callable[[], object]
Blocks = list[list[float]]
"""Times of the cycles of each block [us]."""


class Pace(StrEnum):
    """When a cycle begins."""

    GRID = "every ms"
    """At the next millisecond, for which the process sleeps."""
    AT_ONCE = "back to back"
    """When the one before has ended."""


WHO = ("raw", "ours")
CASES = [(where, pace) for where in (SHARED, APART) for pace in (Pace.AT_ONCE, Pace.GRID)]
"""Where the peer computes, and the pace."""
TURNS = len(CASES) * ROUNDS * (UNTIMED + BLOCK)
"""Number of cycles of each of the two that go first."""


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


def timed(cycle: Cycle, pace: Pace) -> list[float]:
    """Wall time of each cycle of a block, without the wait for its beginning [us]."""
    clock, took = SystemTime(), []
    for _ in range(UNTIMED + BLOCK):
        if pace is Pace.GRID:
            clock.wait_until((clock.now_ns() // PERIOD_NS + 1) * PERIOD_NS)
        began = time.perf_counter()
        cycle()
        took.append(1e6 * (time.perf_counter() - began))
    return took[UNTIMED:]


def rounds(
    buses: tuple[can.BusABC, can.BusABC],
    exchange: Cycle,
    targets: tuple[int, int],
    move: Callable[[str], None],
) -> dict[str, Blocks]:
    """Wall time of blocks that take turns, by who, place of the peer and pace [us].

    Args:
        buses: bus of the peer, and the one that the link has, through which raw frames go, too.
        exchange: one cycle of the link, for which the peer's motion goes on.
        targets: what the other stacks command [counts].
        move: moves the peer to a place.
    """
    bus, of_link = buses

    def ours(pace: Pace) -> list[float]:
        play(bus, True)
        try:
            return timed(exchange, pace)
        finally:
            play(bus, False)

    raw = raw_cycle(of_link, targets)
    other, network = canopen_cycle(bus, targets)
    took: dict[str, Blocks] = {named(who, *case): [] for who in WHO for case in CASES}
    took |= {named("canopen", APART, pace): [] for pace in Pace}
    blocks = {"raw": lambda pace: timed(raw, pace), "ours": ours}
    for number in range(ROUNDS):
        for where, pace in CASES:
            move(where)
            # Who goes first takes turns, too.
            for who in WHO if number % 2 else reversed(WHO):
                took[named(who, where, pace)].append(blocks[who](pace))
        if number % OTHER_EVERY == 0:
            network.notifier = can.Notifier(bus, network.listeners, 0.001)
            for pace in Pace:
                took[named("canopen", APART, pace)].append(timed(other, pace))
            network.notifier.stop(1.0)
    return took


def named(who: str, where: str, pace: Pace) -> str:
    """Name of a case."""
    return f"{who} {where} {pace}"


def ratio(ours: Blocks, other: Blocks) -> float:
    """Median of the ratios of neighbouring blocks, of their medians [-]."""
    pairs = zip(ours, other, strict=True)
    return statistics.median(statistics.median(a) / statistics.median(b) for a, b in pairs)


def typical(blocks: Iterable[Iterable[float]]) -> float:
    """Median time of a cycle [us]."""
    return statistics.median(cycle for block in blocks for cycle in block)
