"""Random and mutated frames to the master and to the emulated drives: nothing may be raised.

python scripts/fuzz_drives.py --frames 1000000
"""

import argparse
import random
import tempfile
import time
from collections import Counter
from collections.abc import Sequence
from pathlib import Path

from legbench.drives.emulated.behaviour import Behaviour
from legbench.drives.emulated.build import emulate
from legbench.drives.emulated.bus import LockstepBus
from legbench.drives.emulated.drive import EmulatedDrive
from legbench.drives.emulated.network import Network
from legbench.drives.master.link import Link
from legbench.drives.protocol.frame import Frame
from legbench.drives.setup.config import BusConfig, Identity, NodeConfig
from legbench.drives.setup.units import AxisUnits
from legbench.drives.transport.lock import ChannelLock
from legbench.errors import LegbenchError, PlantFault
from legbench.limits.safety import SafetyLimits

START = (-0.5, 1.9)
RANGES = ((-2.0, 1.0), (0.0, 3.0))
LIMITS = SafetyLimits(motor_range=RANGES, command_speed=20.0)
MS = 1_000_000
BURSTS = (0, 0, 1, 3, 40)
"""Frames a cycle, by chance."""
EPISODE = 1500
"""Frames until a drive starts again from operation enabled, or a master goes on after a fault."""
MASTERS_OWN = (0x000, 0x080, 0x201, 0x202, 0x77E)
RARELY = 0.002
LIVELY = (0x000, 0x080, 0x081, 0x082, 0x181, 0x182, 0x201, 0x202, 0x581, 0x582, 0x601, 0x602, 0x701)
"""Identifiers that mean something to somebody."""


def bus_config() -> BusConfig:
    """Two drives as on the bench."""
    nodes = [
        NodeConfig(
            name=name,
            node_id=place,
            identity=Identity(vendor=1, product=2, serial=place),
            motor=AxisUnits(counts_per_rev=1 << 20),
            link=AxisUnits(counts_per_rev=1 << 16, bits=16),
        )
        for place, name in enumerate(("hip", "knee"), start=1)
    ]
    return BusConfig(nodes=tuple(nodes))


class Source:
    """Frames: pure noise, noise on lively identifiers, and real traffic with flipped bits."""

    def __init__(self, seed: int, traffic: Sequence[Frame]) -> None:
        self._random, self._traffic = random.Random(seed), traffic

    def frame(self) -> Frame:
        """One more."""
        chance = self._random
        kind = chance.random()
        if kind < 0.25:
            data = chance.randbytes(chance.randrange(9))
            return Frame(
                chance.randrange(0x800), data, chance.random() < 0.05, chance.random() < 0.05
            )
        if kind < 0.5:
            return Frame(chance.choice(LIVELY), chance.randbytes(chance.choice((0, 1, 2, 6, 8))))
        frame = chance.choice(self._traffic)
        data = bytearray(frame.data)
        for _ in range(chance.randrange(3)):
            if data:
                data[chance.randrange(len(data))] ^= 1 << chance.randrange(8)
        if chance.random() < 0.1:
            data = data[: chance.randrange(len(data) + 1)]
        if chance.random() < 0.1:
            data = (data + chance.randbytes(2))[:8]
        return Frame(frame.cob_id, bytes(data))

    def heard(self) -> Frame:
        """One more for a master; rarely one that only a master sends, which ends its run."""
        while True:
            frame = self.frame()
            if frame.cob_id not in MASTERS_OWN or self._random.random() < RARELY:
                return frame


def rig(folder: Path) -> tuple[Network, LockstepBus, Link, ChannelLock]:
    """A fresh bus with a link and its lock."""
    config = bus_config()
    behaviours = [
        Behaviour(start_pos=pos, hard_stop=stop) for pos, stop in zip(START, RANGES, strict=True)
    ]
    network = emulate(config, behaviours, keep_log=True)
    bus = LockstepBus("fuzz", network=network)
    lock = ChannelLock("fuzz", folder)
    return network, bus, Link(bus, config, LIMITS, stiffness=(4.0, 5.0), lock=lock), lock


def healthy(folder: Path) -> tuple[list[Frame], EmulatedDrive, int]:
    """Everything that a start and some motion say, and an enabled drive with its time [ns]."""
    network, bus, link, lock = rig(folder)
    link.start()
    for cycle in range(100):
        link.command((START[0] + 1e-3 * cycle, START[1]))
        link.exchange()
    # The master falls silent here; what the drive hears from now on is noise.
    lock.release()
    bus.shutdown()
    frames = [frame for _, frame in network.log or []]
    return frames, network.drives[0], network.now_ns // MS * MS


def check_targets(network: Network) -> None:
    """Every target that was ever sent lies within the range.

    Raises:
        AssertionError: one does not.
    """
    nodes = bus_config().nodes
    for _, frame in network.log or []:
        if frame.cob_id in (0x201, 0x202) and len(frame.data) == 6 and frame.data[0] == 0x0F:
            place = frame.cob_id - 0x201
            angle = nodes[place].motor.to_rad(int.from_bytes(frame.data[2:], "little", signed=True))
            low, high = RANGES[place]
            if not low - 1e-4 <= angle <= high + 1e-4:
                raise AssertionError(f"target {angle:.3f} rad of motor {place + 1} is out of range")


def fuzz_drive(count: int, seed: int, folder: Path) -> Counter[str]:
    """Frames to one drive, again and again from operation enabled.

    Raises:
        AssertionError: it sent a frame that cannot be, or left its mechanical range.
    """
    traffic, drive, now_ns = healthy(folder)
    source, seen = Source(seed, traffic), Counter[str]()
    low, high = RANGES[0]
    for number in range(count):
        if number % EPISODE == 0:
            _, drive, now_ns = healthy(folder)
        if number % 7 == 0:
            now_ns += MS
            angle = drive.tick(now_ns)
            drive.sense(angle, 0.0)
            if not low <= angle <= high:
                raise AssertionError(f"the motor is at {angle:.3f} rad")
        drive.receive(source.frame(), now_ns + 1000 * (number % 7))
        for ready_ns, frame in drive.take():
            if ready_ns < 0 or len(frame.data) > 8 or not 0 < frame.cob_id < 0x800:
                raise AssertionError(f"the drive sent {frame}")
        seen[drive.axis.power.state.value] += 1
    return seen


def fuzz_master(count: int, seed: int, folder: Path) -> Counter[str]:
    """Frames to a master that moves two drives; a fault that it finds is what it should do.

    Raises:
        AssertionError: a target was out of range.
    """
    source, ends, sent = Source(seed, healthy(folder)[0]), Counter[str](), 0
    chance = random.Random(seed)
    while sent < count:
        network, bus, link, _ = rig(folder)
        try:
            link.start()
            while sent < count:
                for _ in range(min(chance.choice(BURSTS), count - sent)):
                    bus.inject(source.heard())
                    sent += 1
                link.command([chance.uniform(-4.0, 4.0) for _ in START])
                link.exchange()
        except PlantFault as error:
            ends[error.cause] += 1
            # What follows a fault is parsed too, while nothing is commanded any more.
            for _ in range(min(EPISODE, count - sent)):
                bus.inject(source.heard())
                sent += 1
            while bus.pending:
                link.cycle.tick()
        except LegbenchError as error:
            ends[type(error).__name__] += 1
        link.close()
        bus.shutdown()
        check_targets(network)
    return ends


def main() -> None:
    """Fuzz both sides and tell what happened."""
    parser = argparse.ArgumentParser(description=__doc__, allow_abbrev=False)
    parser.add_argument("--frames", type=int, default=1_000_000, help="to each side")
    parser.add_argument("--seed", type=int, default=0)
    chosen = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        began = time.perf_counter()
        seen = fuzz_drive(chosen.frames, chosen.seed, folder)
        print(f"drive: {chosen.frames} frames, {time.perf_counter() - began:.0f} s, no exception")
        print("  frames by state:", ", ".join(f"{k} {v}" for k, v in seen.most_common()))
        began = time.perf_counter()
        ends = fuzz_master(chosen.frames, chosen.seed, folder)
        print(f"master: {chosen.frames} frames, {time.perf_counter() - began:.0f} s, no exception")
        print("  faults found:", ", ".join(f"{k} {v}" for k, v in ends.most_common()))


if __name__ == "__main__":
    main()
