"""The master against slaves of the `durand` package: everything of CiA 301 there is theirs."""

from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from drives_rig import START, STIFFNESS, config

from legbench.drives.emulated.bus import LockstepBus
from legbench.drives.emulated.network import Network
from legbench.drives.emulated.power import PowerStage
from legbench.drives.master.link import Link
from legbench.drives.protocol.cia402 import DriveState
from legbench.drives.protocol.frame import Frame
from legbench.drives.protocol.objects import OBJECTS, Access
from legbench.drives.setup.config import RPDO, NodeConfig
from legbench.drives.transport.lock import ChannelLock
from legbench.limits.safety import SafetyLimits

durand = pytest.importorskip("durand")
scheduling = pytest.importorskip("durand.scheduler")
OURS = (0x1000, 0x1005, 0x1008, 0x1014, 0x1017, 0x1018)
"""Objects that `durand` brings along, besides the PDOs'."""


BUS = config(
    nodes=tuple(replace(node, rpdos=(replace(RPDO, deadline_ms=0),)) for node in config().nodes)
)
"""`durand` has no 140xh:05."""


class Wire:
    """What `durand` takes for its network and the emulated bus for a participant."""

    def __init__(self) -> None:
        self.subscriptions: dict[int, Callable[[int, bytes], None]] = {}
        self.out: list[tuple[int, Frame]] = []
        self.now_ns = 0
        self.slave: Any = None

    def add_subscription(self, cob_id: int, callback: Callable[[int, bytes], None]) -> None:
        self.subscriptions[cob_id] = callback

    def remove_subscription(self, cob_id: int, callback: object = None) -> None:
        self.subscriptions.pop(cob_id)

    def send(self, cob_id: int, msg: bytes) -> None:
        self.out.append((self.now_ns + 60_000, Frame(cob_id, bytes(msg))))

    def receive(self, frame: Frame, now_ns: int) -> None:
        self.now_ns = now_ns
        callback = self.subscriptions.get(frame.cob_id)
        if callback is not None:
            callback(frame.cob_id, frame.data)

    def take(self) -> list[tuple[int, Frame]]:
        out, self.out = self.out, []
        return out

    def tick(self, now_ns: int) -> float:
        step = 1e-9 * (now_ns - self.now_ns)
        self.now_ns = now_ns
        if self.slave.timed:
            scheduling.get_scheduler().run(step)
        return 0.0


class Slave:
    """A perfect drive on top of a `durand` node: the target is the position after SYNC."""

    def __init__(self, wire: Wire, node: NodeConfig, start: float, *, timed: bool) -> None:
        wire.slave, self.timed = self, timed
        self.node = durand.MinimalNode(wire, node.node_id)
        self.stage = PowerStage({(0x605A, 0): 2, (0x605B, 0): 0, (0x605C, 0): 0, (0x605E, 0): 0})
        self.stage.boot()
        self.targets: list[int] = []
        self.config = node
        self._fill(node, start)
        self.node.sync.callbacks.add(self.sync)

    def _fill(self, node: NodeConfig, start: float) -> None:
        od, types = self.node.object_dictionary, durand.DatatypeEnum
        for index in sorted({index for index, _ in OBJECTS}):
            if index in OURS or 0x1400 <= index < 0x1C00:
                continue
            subs = [entry for entry in OBJECTS.values() if entry.index == index]
            variables = {
                entry.sub: durand.Variable(
                    types(int(entry.kind)),
                    "rw" if entry.access is Access.RW else "ro",
                    entry.default,
                    name=entry.name,
                )
                for entry in subs
            }
            if len(subs) == 1 and subs[0].sub == 0:
                od[index] = variables[0]
            else:
                record = durand.Record(name=subs[0].name)
                for sub, variable in variables.items():
                    if sub:
                        record[sub] = variable
                od[index] = record
        od.write(0x1000, 0, 0x00020192)
        for sub, value in enumerate(
            (node.identity.vendor, node.identity.product, 0, node.identity.serial), start=1
        ):
            od.write(0x1018, sub, value)
        od.write(0x6064, 0, node.motor.to_counts(start))
        od.write(0x2064, 0, node.link_units.to_counts(start))
        od.update_callbacks[(0x6060, 0)].add(lambda mode: od.write(0x6061, 0, mode))
        self.sync()

    def sync(self) -> None:
        od = self.node.object_dictionary
        self.stage.command(od.read(0x6040, 0), cause_gone=True)
        if self.stage.stopping is not None:
            self.stage.stopped()
        word = self.stage.low_byte | 0x200
        if self.stage.state is DriveState.OPERATION_ENABLED:
            word |= 0x1000
            target = od.read(0x607A, 0)
            self.targets.append(target)
            od.write(0x6064, 0, target)
            od.write(0x2064, 0, self.config.link_units.to_counts(self.config.motor.to_rad(target)))
        od.write(0x6041, 0, word)


@pytest.fixture
def slaves() -> Iterator[tuple[Network, list[Slave]]]:
    before = scheduling.get_scheduler()
    scheduling.set_scheduler(scheduling.VirtualScheduler())
    wires = [Wire(), Wire()]
    pairs = zip(wires, BUS.nodes, START, strict=True)
    made = [Slave(wire, node, start, timed=node.node_id == 1) for wire, node, start in pairs]
    yield Network((), others=wires), made
    scheduling.set_scheduler(before)


def test_bring_up_remap_and_motion(slaves: tuple[Network, list[Slave]], tmp_path: Path) -> None:
    network, made = slaves
    bus = LockstepBus("durand", network=network)
    limits = SafetyLimits(command_speed=20.0)
    lock = ChannelLock("durand", tmp_path)
    with Link(bus, BUS, limits, stiffness=STIFFNESS, lock=lock) as link:
        sample = link.start()
        assert sample.motor_pos == pytest.approx(START, abs=1e-5)
        for slave in made:
            assert slave.stage.state is DriveState.OPERATION_ENABLED
            od = slave.node.object_dictionary
            assert od.read(0x1600, 1) == 0x60400010
            assert od.read(0x1A00, 3) == 0x20640010
            assert od.read(0x60C2, 2) == -3
            # No jump: the first target is where the motor was.
            first = slave.config.motor.to_rad(slave.targets[0])
            assert first == pytest.approx(START[made.index(slave)], abs=1e-5)
        for cycle in range(1, 201):
            link.command([START[0] + 1e-3 * cycle, START[1] - 1e-3 * cycle])
            sample = link.exchange()
        link.command(sample.applied_pos)
        link.exchange()
        sample = link.exchange()
        assert sample.motor_pos == pytest.approx((START[0] + 0.2, START[1] - 0.2), abs=1e-5)
        assert all(sample.fresh)
    assert [slave.stage.state for slave in made] == [DriveState.SWITCH_ON_DISABLED] * 2
    bus.shutdown()


def test_segmented_objects_are_read_from_the_other_implementation(
    slaves: tuple[Network, list[Slave]], tmp_path: Path
) -> None:
    network, made = slaves
    od = made[0].node.object_dictionary
    text = bytes(range(256)) * 3
    od[0x2F00] = durand.Variable(durand.DatatypeEnum.OCTET_STRING, "rw", b"", name="Notes")
    bus = LockstepBus("durand", network=network)
    link = Link(bus, BUS, stiffness=STIFFNESS, lock=ChannelLock("durand", tmp_path))
    sdo = link.bring_up.sdo(BUS.nodes[0])
    for length in (1, 4, 5, 7, 8, 14, 15, len(text)):
        sdo.write(0x2F00, 0, text[:length])
        assert od.read(0x2F00, 0) == text[:length]
        assert sdo.read(0x2F00, 0) == text[:length]
    bus.shutdown()
