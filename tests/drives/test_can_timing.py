"""What a row says of time when SYNC is late, ticks are missed, or a drive falls silent."""

import itertools
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace

import numpy as np
import pytest
from can_rig import BUS, MS, LateTime, experiment, fine_bus, stage, staged

from legbench.control import BangBangConfig
from legbench.drives.emulated.behaviour import Behaviour
from legbench.drives.emulated.build import emulate
from legbench.drives.emulated.bus import LockstepBus
from legbench.drives.emulated.faults import FrameFault, FrameFaultKind
from legbench.drives.emulated.network import Network
from legbench.drives.master.session import Session
from legbench.drives.setup.bus_file import load_bus
from legbench.limits.safety import SafetyLimits
from legbench.limits.upper_ends import DRIVE_HEARTBEAT
from legbench.plant.can import VELOCITY_BANDWIDTH, CanPlant
from legbench.signals import Command, Observation

SPEED = 2.0
"""Both links turn at it [rad/s]."""
FINE_NS = 10_000
"""The links turn on in steps of 10 us: a step is a hundredth of what a cycle shows."""
SETTLED = 20
"""Cycles after which a low-pass of 200 Hz has forgotten its start."""


@dataclass
class Turning:
    """A plant that only looks at links which begin to turn when `turns` is set."""

    plant: CanPlant
    time: LateTime
    network: Network
    turns: bool = False
    angle: float = 0.0

    def watch(self, cycles: int) -> list[Observation]:
        return [self.plant.step(Command.holding(np.zeros(2))) for _ in range(cycles)]


@contextmanager
def turning() -> Iterator[Turning]:
    # A heartbeat that is on the wire holds SYNC up by 0.1 ms, which no master can know.
    bus = replace(fine_bus(), heartbeat_ms=2000, waive=(DRIVE_HEARTBEAT,))
    chosen = experiment(BangBangConfig())
    _, start = staged(chosen)

    def body(_motors: tuple[float, ...]) -> tuple[Sequence[float], Sequence[float]]:
        it.angle += SPEED * 1e-9 * FINE_NS if it.turns else 0.0
        return (it.angle, it.angle), (0.0, 0.0)

    network = emulate(bus, [Behaviour.ideal(0.0)] * 2, body=body, configured=True)
    time = LateTime(network)
    session = Session(LockstepBus("leg", network=network), bus, time)
    link = session.link(SafetyLimits(), chosen.design.stiffness, read_only=True)
    with CanPlant(session, link, start, read_only=True) as plant:
        it = Turning(plant, time, network)
        plant.reset()
        # Before the links turn, the usual steps of 1 ms do.
        network._body_period_ns = FINE_NS
        it.turns = True
        it.watch(SETTLED)
        yield it


def growing(most_ns: int) -> Callable[[int], int]:
    """Lateness that grows from cycle to cycle and begins anew."""
    return lambda cycle: (cycle % 5) * most_ns // 4


@pytest.mark.parametrize(
    "late_of",
    [
        growing(450_000),
        lambda cycle: 400_000 * (cycle % 2),
        lambda cycle: 2_400_000 if cycle % 9 == 4 else 0,
        lambda cycle: 1_700_000 if cycle % 9 == 4 else 300_000 * (cycle % 2),
    ],
    ids=["growing", "every second", "missed ticks", "missed and late"],
)
def test_joint_vel_is_right_however_late_sync_is(late_of: Callable[[int], int]) -> None:
    with turning() as it:
        it.time.late_ns = map(late_of, itertools.count())
        seen = it.watch(60)
    rates = np.array([each.joint_vel for each in seen])
    np.testing.assert_allclose(rates, SPEED, rtol=0.01)


def test_time_is_that_of_the_sync() -> None:
    with turning() as it:
        it.time.late_ns = map(growing(450_000), itertools.count())
        rows = []
        for _ in range(40):
            (seen,) = it.watch(1)
            sample = it.plant.sample
            assert sample is not None
            rows.append((seen.time, 1e-9 * sample.time_ns - it.plant.began, it.plant.late))
    time, sync, late = np.array(rows).T
    np.testing.assert_allclose(time, sync, rtol=0, atol=1e-9)
    assert np.all(np.diff(time) > 0.0)
    grid = time - late
    np.testing.assert_allclose(np.diff(grid), 1e-3, rtol=0, atol=1e-9)
    assert np.ptp(np.diff(time)) > 0.4e-3


def test_an_answer_that_is_missing_leaves_no_kink_in_joint_vel() -> None:
    with turning() as it:
        now_ns = it.network.now_ns
        it.network.inject(
            FrameFault(
                kind=FrameFaultKind.DROP,
                cob_id=0x181,
                start_ns=now_ns + 5 * MS,
                end_ns=now_ns + 6 * MS,
            )
        )
        seen, fresh = [], []
        for _ in range(20):
            seen += it.watch(1)
            assert it.plant.sample is not None
            fresh.append(it.plant.sample.fresh)
    assert (False, True) in fresh
    np.testing.assert_allclose([each.joint_vel for each in seen], SPEED, rtol=0.01)


def test_on_the_grid_nothing_has_changed() -> None:
    """The low-pass over even periods, computed here as its formula says."""
    bench = load_bus(BUS)
    # The answer to a request of a temperature may hold up a SYNC and cost an answer of the next
    # cycle, which the estimate then bridges; here every reading is to be fresh.
    nodes = tuple(replace(node, temperature_object=None) for node in bench.nodes)
    gain = 1.0 - np.exp(-2.0 * np.pi * VELOCITY_BANDWIDTH * bench.period)
    with stage(experiment(BangBangConfig(), 0.4), config=replace(bench, nodes=nodes)) as it:
        seen = it.plant.reset()
        it.controller.reset(seen)
        velocity, links = seen.joint_vel, seen.joint_pos
        for cycle in range(1, 401):
            seen = it.plant.step(it.controller.step(seen))
            velocity = velocity + gain * ((seen.joint_pos - links) / 1e-3 - velocity)
            links = seen.joint_pos
            assert seen.time == cycle * it.plant.period
            assert seen.joint_vel.tolist() == velocity.tolist()
    assert np.max(np.abs(velocity)) > 0.0
