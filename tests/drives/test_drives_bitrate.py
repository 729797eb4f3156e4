"""A master at another bitrate than the bus: no frame passes, and the bitrate is named."""

import itertools
from pathlib import Path

import can
import pytest
from can_rig import BUS, MS
from drives_rig import STIFFNESS, config

from legbench.drives.emulated.build import emulate
from legbench.drives.emulated.bus import LockstepBus
from legbench.drives.emulated.faults import NodeFault, NodeFaultKind
from legbench.drives.emulated.network import BUS_OFF, BUS_OFF_FRAME, ERROR_FRAME, PASSIVE
from legbench.drives.emulated.unix_server import UnixServer
from legbench.drives.errors import BusError
from legbench.drives.master.link import Link
from legbench.drives.protocol.cia402 import DriveState
from legbench.drives.protocol.frame import Frame
from legbench.drives.protocol.nmt import NmtCommand, nmt_frame
from legbench.drives.setup.bus_file import bus_from_mapping, load_bus
from legbench.drives.transport.lock import ChannelLock
from legbench.drives.transport.unix_bus import UnixBus
from legbench.errors import ConfigError

BEAT = bytes.fromhex("2B17100014000000")
"""SDO: heartbeat every 20 ms."""


def test_a_frame_at_another_bitrate_is_destroyed_until_its_sender_is_off_the_bus() -> None:
    network = emulate(config(), keep_log=True)
    network.advance(10 * MS)
    master = network.attach(bitrate=750_000)
    network.send(master, nmt_frame(NmtCommand.START))
    network.advance(50 * MS)
    heard = [frame for _, frame, _ in master.received]
    assert heard == [ERROR_FRAME] * (BUS_OFF // 8) + [BUS_OFF_FRAME]
    with pytest.raises(BusError, match="the controller is bus-off"):
        network.send(master, Frame(0x080))
    assert all(drive.state.name == "PRE_OPERATIONAL" for drive in network.drives)


@pytest.mark.parametrize("listen_only", [False, True])
def test_a_listener_at_another_bitrate_destroys_frames_until_it_is_error_passive(
    listen_only: bool,
) -> None:
    network = emulate(config())
    network.advance(10 * MS)
    master = network.attach()
    for node_id in (1, 2):
        network.send(master, Frame(0x600 + node_id, BEAT))
    network.advance(15 * MS)
    master.received.clear()
    stranger = network.attach(bitrate=500_000, listen_only=listen_only)
    network.advance(500 * MS)
    assert stranger.received
    assert {frame for _, frame, _ in stranger.received} == {ERROR_FRAME}
    broken = [frame for _, frame, _ in master.received if frame.error]
    assert len(broken) == (0 if listen_only else PASSIVE // 8 - 1)
    whole = [frame.cob_id for _, frame, _ in master.received if not frame.error]
    assert whole.count(0x701) == whole.count(0x702) >= 24


@pytest.mark.parametrize("bitrate", [900_000, 1_000_000])
def test_a_link_at_a_wrong_bitrate_says_so_before_anything_is_enabled(
    bitrate: int, tmp_path: Path
) -> None:
    drives = config(period_us=2000)
    network = emulate(drives, keep_log=True)
    with LockstepBus("rig", network=network, bitrate=bitrate) as bus:
        lock = ChannelLock("rig", tmp_path)
        link = Link(bus, drives.at(bitrate), stiffness=STIFFNESS, lock=lock)
        if bitrate == network.bitrate:
            link.start()
            link.close()
            return
        words = (
            r"\d+ error frames and no answer, the controller has gone bus-off; .*900000 bit/s is "
            r"asked for, but the bus file says 1000000 bit/s: leave --bitrate out"
        )
        with pytest.raises(BusError, match=words):
            link.start()
        assert bus.state is can.BusState.ERROR
    assert not any(0x200 < frame.cob_id < 0x280 for _, frame in network.log or [])
    assert {drive.axis.power.state for drive in network.drives} == {DriveState.SWITCH_ON_DISABLED}


def test_an_error_frame_does_not_hide_who_keeps_silent(tmp_path: Path) -> None:
    network = emulate(config())
    network.inject(NodeFault(kind=NodeFaultKind.SILENT, node_id=2, start_ns=0))
    with LockstepBus("rig", network=network) as bus:
        link = Link(bus, config(), stiffness=STIFFNESS, lock=ChannelLock("rig", tmp_path))
        bus.inject(ERROR_FRAME)
        with pytest.raises(BusError, match=r"node 2 on .* does not answer .*1 error frames"):
            link.start()


def test_a_bitrate_of_drives_that_the_bus_file_does_not_know_is_suspected(tmp_path: Path) -> None:
    # The file is right in all but the bitrate.
    network = emulate(config(bitrate=500_000))
    with LockstepBus("rig", network=network, bitrate=1_000_000) as bus:
        link = Link(bus, config(), stiffness=STIFFNESS, lock=ChannelLock("rig", tmp_path))
        with pytest.raises(BusError, match=r"another bitrate .*the bus file says 1000000 bit/s"):
            link.start()


def test_the_bus_between_processes_has_a_bitrate_too(tmp_path: Path) -> None:
    network = emulate(load_bus(BUS))
    clock = itertools.count(0, MS // 10)
    with UnixServer(network, tmp_path / "leg.sock", lambda: next(clock)) as server:
        heard: dict[int, set[bool]] = {}
        for bitrate in (1_000_000, 500_000):
            with UnixBus(str(server.path), bitrate=bitrate) as bus:
                server.poll()
                server.poll()
                network.send(network.attach(), Frame(0x123))
                for _ in range(40):
                    server.poll()
                heard[bitrate] = {
                    message.is_error_frame for message in iter(lambda: bus.recv(0.0), None)
                }
            server.poll()
        assert heard == {1_000_000: {False}, 500_000: {True}}


def test_what_was_asked_for_is_no_key_of_a_bus_file() -> None:
    with pytest.raises(ConfigError, match="unknown keys: stated_bitrate"):
        bus_from_mapping({"stated_bitrate": 5})
