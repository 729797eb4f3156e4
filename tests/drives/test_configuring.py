"""Comparing and writing a configuration: what comes first, and what is never reached."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from service_rig import BENCH, MS, alone, on, opened, serial, written

from legbench.commissioning import configure
from legbench.drives.emulated.build import emulate, on_bench
from legbench.drives.emulated.bus import LockstepBus
from legbench.drives.emulated.network import Network
from legbench.drives.errors import BusError, DriveError
from legbench.drives.master.bring_up import BringUp
from legbench.drives.master.session import Session
from legbench.drives.protocol.frame import Frame
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


@pytest.mark.parametrize("act", [configure.write, configure.differences])
@pytest.mark.parametrize("place", [0, 1])
def test_another_drive_is_neither_compared_nor_written(
    act: Callable[[Session], object], place: int
) -> None:
    nodes = list(BENCH.nodes)
    nodes[place] = serial(nodes[place], 77)
    session, network = alone(*nodes)
    with session, pytest.raises(DriveError, match="serial"):
        act(session)
    assert written(network) == []


def test_a_channel_that_has_a_master_is_not_configured(tmp_path: Path) -> None:
    network = emulate(BENCH, keep_log=True)
    network.advance(20 * MS)
    name = str(tmp_path / "channel")
    other = ChannelLock(name)
    other.acquire()
    session = Session(LockstepBus("leg", network=network), BENCH, lock=ChannelLock(name))
    with session, pytest.raises(BusError, match="master"):
        configure.write(session)
    other.release()
    assert written(network) == []


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
