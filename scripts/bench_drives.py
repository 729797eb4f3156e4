"""What the cyclic link costs, against raw frames and against another stack, in the same run.

The peer is a process of its own behind an AF_UNIX bus. It answers every SYNC with both drives'
process data, those of a motion that was recorded on emulated drives (`bench_motion`): of a leg at
rest, of one that hops, and of one that hops and sways, so that every watch of the limits works.
Raw frames, the link and the other stack take turns, all of them with SYNC first, then its answers,
then commands. The bounds hold for cycles one after the other and a peer on a processor of its own,
as drives do not compute on their master's. How the same frames compare every millisecond, where
both sides sleep in between, and with a peer on the link's processor, is printed without a bound.
"""

import os
import statistics
import sys
import tempfile
import time
from pathlib import Path
from typing import final

import can
import numpy as np
from bench_motion import (
    Kind,
    bench_config,
    emulated_bus,
    leader,
    open_link,
    record_motion,
)
from bench_peer import APART, play, served
from bench_turns import (
    CASES,
    OTHER_EVERY,
    PATIENCE,
    TURNS,
    Blocks,
    Pace,
    named,
    ratio,
    rounds,
    typical,
)

from legbench.drives.emulated.bus import LockstepBus
from legbench.drives.master.session import Session
from legbench.drives.setup.config import BusConfig
from legbench.plant.can import CanPlant
from legbench.recording.writer import RunWriter
from legbench.signals import Observation

WARM_UP, CYCLES = 700, 300
"""Cycles until a hop sways and its momentum is watched, and those whose CPU time is taken apart."""
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


def measure(config: BusConfig, kind: Kind) -> tuple[dict[str, list[float]], dict[str, Blocks]]:
    """CPU time of the parts of a cycle and wall time of blocks, for one motion [us]."""
    motion = record_motion(config, WARM_UP + CYCLES + TURNS + 1, kind)
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

            def exchange() -> None:
                link.exchange()
                link.command(next(commands))

            link.command(next(commands))
            first_target, second_target = [axis.target_counts for axis in link.cycle.axes]
            took = rounds((bus, switched), exchange, (first_target, second_target), move)
        finally:
            switched.inner, free.first = first, first
            plant.close()
            first.shutdown()
    return parts, took


def main() -> int:
    """Measure and print; 1 if a bound is missed."""
    config, missed = bench_config(), False
    print(f"load {', '.join(f'{load:.2f}' for load in os.getloadavg())}")
    for kind in Kind:
        parts, took = measure(config, kind)
        ours = took[named("ours", APART, Pace.AT_ONCE)]
        found = {
            "link over raw": ratio(ours, took[named("raw", APART, Pace.AT_ONCE)]),
            "link over canopen": ratio(
                ours[::OTHER_EVERY], took[named("canopen", APART, Pace.AT_ONCE)]
            ),
            "cycle cpu p50 [us]": statistics.median(parts["whole"]),
        }
        print(kind)
        for where, pace in CASES:
            words = "a processor of its own" if where == APART else "the link's processor"
            raw, link = took[named("raw", where, pace)], took[named("ours", where, pace)]
            print(
                f"  {pace}, peer on {words}: raw {typical(raw):.1f}, link {typical(link):.1f} us, "
                f"{ratio(link, raw):.2f}"
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
