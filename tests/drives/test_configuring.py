"""Comparing and writing a configuration: what comes first, and what is never reached."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from can_rig import LIMITS
from service_rig import BENCH, MS, alone, on, opened, serial, written

from legbench.commissioning import configure
from legbench.commissioning.home import home
from legbench.commissioning.jog import jog
from legbench.commissioning.node_id import set_node_id
from legbench.commissioning.reset import reset
from legbench.commissioning.store import store
from legbench.commissioning.zero import measure
from legbench.drives.emulated.build import emulate, on_bench
from legbench.drives.emulated.bus import LockstepBus
from legbench.drives.emulated.network import Network
from legbench.drives.errors import BusError, DriveError
from legbench.drives.master.bring_up import BringUp
from legbench.drives.master.session import Session
from legbench.drives.protocol.frame import Frame
from legbench.drives.setup.bus_file import load_limits
from legbench.drives.transport.lock import ChannelLock
from legbench.errors import PlantFault


def lacking(*objects: Any) -> tuple[Session, Network]:
    """The bench, whose second drive lacks some objects."""
    ways = [{}, {"lacks": frozenset(objects)}]
    behaviours = [on_bench(node, 0.0, **way) for node, way in zip(BENCH.nodes, ways, strict=True)]
    network = emulate(BENCH, behaviours, keep_log=True)
    return on(network), network


def test_drives_are_pre_operational_before_the_first_object_is_written() -> None:
    session, network = opened()
    with session:
        before = configure.differences(session)
        assert written(network) == []
        done = configure.write(session)
        assert configure.differences(session) == []
    frames = written(network)
    assert frames[:2] == [Frame(0, b"\x80\x01"), Frame(0, b"\x80\x02")]
    assert all(0x600 < frame.cob_id < 0x680 for frame in frames[2:])
    # Every node is compared, and what differed was written.
    assert {one.node for one in before} == {"motor1", "motor2"}
    assert all(one.holds != one.wanted for one in before)
    assert done.objects > len(before)
    assert done.held == frozenset()


LEG = load_limits(LIMITS)
WRITING: dict[str, Callable[[Session], object]] = {
    "configure": configure.write,
    "home": lambda session: home(session, session.config.nodes[0], 37),
    "reset": lambda session: reset(session, session.config.nodes),
    "store": lambda session: store(session, session.config.nodes),
    "node-id": lambda session: set_node_id(session, 42),
    "jog": lambda session: jog(session, LEG, (4.0, 5.0), "motor1", by=-0.1, speed=0.5, back=False),
}
"""Commands that write to drives."""
ASKING = WRITING | {
    "compare": configure.differences,
    "zero": lambda session: measure(session, (0.0, 0.0)),
}


@pytest.mark.parametrize("name", [name for name in ASKING if name != "node-id"])
@pytest.mark.parametrize("place", [0, 1])
def test_another_drive_than_the_bus_file_means_is_told_nothing(name: str, place: int) -> None:
    nodes = list(BENCH.nodes)
    nodes[place] = serial(nodes[place], 77)
    session, network = alone(*nodes)
    with session, pytest.raises(DriveError, match="serial"):
        ASKING[name](session)
    assert written(network) == []


@pytest.mark.parametrize("name", WRITING)
def test_drives_on_a_channel_that_has_a_master_are_told_nothing(name: str, tmp_path: Path) -> None:
    nodes = BENCH.nodes[:1] if name == "node-id" else BENCH.nodes
    bus = replace(BENCH, nodes=nodes)
    network = emulate(bus, [on_bench(node, 0.2 * node.node_id) for node in nodes], keep_log=True)
    network.advance(20 * MS)
    channel = str(tmp_path / "channel")
    other = ChannelLock(channel)
    other.acquire()
    session = Session(LockstepBus("leg", network=network), bus, lock=ChannelLock(channel))
    with session, pytest.raises(BusError, match="already has a master"):
        WRITING[name](session)
    assert written(network) == []
    other.release()


def test_frames_that_wait_are_looked_at_before_the_first_order(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    session, network = opened()

    def heard(_self: BringUp) -> None:
        raise PlantFault("second master", "somebody else leads these drives")

    monkeypatch.setattr(BringUp, "poll_frames", heard)
    with session, pytest.raises(PlantFault, match="somebody else"):
        configure.write(session)
    assert written(network) == []


def test_a_drive_that_nothing_would_stop_is_refused_by_its_name() -> None:
    session, _ = lacking(0x6085)
    with session, pytest.raises(DriveError, match="'motor2' does not take its quick-stop ramp"):
        configure.write(session)


def test_what_a_drive_lacks_without_danger_is_told_and_does_not_count_as_written() -> None:
    whole, _ = opened()
    with whole:
        most = configure.write(whole).objects
    session, _ = lacking(0x1006)
    with session:
        done = configure.write(session)
    (held,) = done.held
    assert held[0] == "motor2"
    assert held[1].startswith("1006h")
    assert done.objects == most - 1
    assert [line for line in done.lines if "1006h" in line and "'motor2'" in line]


def test_a_bus_of_other_nodes_is_compared_with_its_own() -> None:
    session, _ = opened(replace(BENCH, nodes=BENCH.nodes[1:]))
    with session:
        assert {one.node for one in configure.differences(session)} == {"motor2"}
