"""The log of a run, played back at the drives that it was recorded from, moves nothing."""

from collections.abc import Iterator
from pathlib import Path

import can
import pytest
from can_rig import Stage, experiment, stage
from drives_rig import MS, rig
from file_log import FileLog

from legbench.control import JumpConfig
from legbench.drives.emulated.bus import LockstepBus
from legbench.drives.emulated.faults import NodeFault, NodeFaultKind
from legbench.drives.master.parking import park
from legbench.drives.master.port import Port
from legbench.drives.protocol.cia402 import POWERED, DriveState
from legbench.drives.protocol.frame import COB_INVALID
from legbench.drives.transport.lock import ChannelLock
from legbench.loop import run

RPDO_1, SYNC, NMT_START = (0x1400, 1), 0x080, b"\x01"
LEAST = {0x000: 4, SYNC: 400, 0x201: 400, 0x202: 400, 0x77E: 40}
"""Frames of a master that a log must hold for its playback to show anything."""


def recorded(it: Stage, log: Path) -> list[can.Message]:
    """A run, its log from the NMT start to the last frame of `close`."""
    # Before the drives are configured, which no log may hold: it would undo what `close` does.
    it.session.log_to(FileLog(log))
    it.plant._lands = False
    assert run(it.plant, it.controller, 270).status == "complete"
    it.plant.close()
    return list(can.CanutilsLogReader(log))


def played(it: Stage, frames: list[can.Message]) -> Iterator[list[DriveState]]:
    """Put every frame on the wire at its time, as canplayer does; the drives' states after it."""
    with LockstepBus("player", network=it.network, tx_queue=1000) as bus:
        began, first = it.network.now_ns, frames[0].timestamp
        for frame in frames:
            it.network.advance(began + round(1e9 * (frame.timestamp - first)))
            bus.send(frame)
            yield [drive.axis.power.state for drive in it.network.drives]
        it.network.advance(it.network.now_ns + 100 * MS)
        yield [drive.axis.power.state for drive in it.network.drives]


def angles(it: Stage) -> list[float]:
    return [drive.axis.motion.angle for drive in it.network.drives]


def test_a_log_moves_nothing_in_the_drives_it_came_from(tmp_path: Path) -> None:
    with stage(experiment(JumpConfig())) as it:
        frames = recorded(it, tmp_path / "bus.log")
        for cob_id, least in LEAST.items():
            assert sum(frame.arbitration_id == cob_id for frame in frames) >= least
        assert any(f.arbitration_id == 0 and f.data[:1] == NMT_START for f in frames)
        words = {bytes(f.data[:2]) for f in frames if f.arbitration_id == 0x201}
        assert b"\x0f\x00" in words
        stood = angles(it)
        for states in played(it, frames):
            assert not any(state in POWERED for state in states)
        assert angles(it) == stood


def test_without_parking_the_log_does_move_them(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What the test above would show if the drives were left as they are."""
    monkeypatch.setattr("legbench.drives.master.link_end.park", lambda *_arguments: [])
    with stage(experiment(JumpConfig())) as it:
        frames = recorded(it, tmp_path / "bus.log")
        stood, furthest = angles(it), 0.0
        enabled = False
        for states in played(it, frames):
            enabled = enabled or DriveState.OPERATION_ENABLED in states
            furthest = max(furthest, abs(angles(it)[0] - stood[0]))
        assert enabled
        assert furthest > 0.05


def test_parked_drives_are_configured_by_the_next_run(tmp_path: Path) -> None:
    with rig(tmp_path) as it:
        it.link.start()
        it.link.close()
        assert it.link.not_parked == []
        for drive in it.network.drives:
            assert drive._values[RPDO_1] == COB_INVALID | (0x200 + drive.node_id)
            assert drive._pdos.rpdos == {}
        lock = ChannelLock("rig", tmp_path)
        again = type(it.link)(it.bus, it.config, stiffness=(1.0, 1.0), lock=lock)
        again.start()
        assert it.states == [DriveState.OPERATION_ENABLED] * 2
        again.close()


def test_parking_comes_after_the_power_has_gone_and_delays_no_stop(tmp_path: Path) -> None:
    with rig(tmp_path) as it:
        it.link.start()
        it.run(10)
        began = it.network.now_ns
        it.link.close()
        log = [(at, frame) for at, frame in it.network.log or [] if at > began]
        parking = [at for at, frame in log if frame.cob_id in (0x601, 0x602)]
        orders = [at for at, frame in log if frame.cob_id == 0x000]
        last_word = max(at for at, node_id, _ in it.words() if node_id in (1, 2))
        assert min(parking) > max(orders) > last_word
        assert len(orders) == 2
        assert max(parking) - min(parking) < 20 * MS


def test_a_drive_that_cannot_be_parked_is_told_and_the_other_one_is(tmp_path: Path) -> None:
    with rig(tmp_path) as it:
        it.link.start()
        it.network.inject(
            NodeFault(kind=NodeFaultKind.SILENT, node_id=1, start_ns=it.network.now_ns)
        )
        it.link.close()
        (told,) = it.link.not_parked
        assert told.startswith(
            "drive 'hip' (node 1) is not parked: node 1 on emulated bus rig does"
        )
        assert it.network.drives[1]._values[RPDO_1] & COB_INVALID


def test_a_drive_that_keeps_its_command_frame_is_told(tmp_path: Path) -> None:
    with rig(tmp_path) as it:
        it.link.start()
        drive = it.network.drives[0]
        write = drive._sdo._write
        drive._sdo._write = lambda index, sub, data: (
            None if index == 0x1400 else write(index, sub, data)
        )
        it.link.close()
        assert it.link.not_parked == [
            "drive 'hip' (node 1) keeps its commands switched on: 1400h:01 is 00000201h"
        ]


def test_those_who_look_park_nothing_and_may_look_at_parked_drives(tmp_path: Path) -> None:
    with rig(tmp_path, read_only=True, configured=True) as it:
        it.network.advance(500 * MS)
        port = Port(it.bus, it.bus.timebase)
        assert park(port, it.config, lambda _message: None) == []
        for drive in it.network.drives:
            # Only a parked drive passes for configured, no other difference does.
            assert drive._values[RPDO_1] & COB_INVALID
        before = [dict(drive._values) for drive in it.network.drives]
        it.link.start()
        it.link.exchange()
        it.link.close()
        for drive, values in zip(it.network.drives, before, strict=True):
            assert drive._values[RPDO_1] == values[RPDO_1]


def test_those_who_look_leave_command_frames_switched_on(tmp_path: Path) -> None:
    with rig(tmp_path, read_only=True, configured=True) as it:
        it.link.start()
        it.link.close()
        assert all(not drive._values[RPDO_1] & COB_INVALID for drive in it.network.drives)


def test_nobody_parks_the_drives_of_another_master(tmp_path: Path) -> None:
    with rig(tmp_path) as it:
        it.link.start()
        with LockstepBus("other", network=it.network) as other:
            other.send(can.Message(arbitration_id=SYNC, is_extended_id=False))
            it.network.advance(it.network.now_ns + MS // 2)
            it.link.close()
        assert all(not drive._values[RPDO_1] & COB_INVALID for drive in it.network.drives)
        assert it.states == [DriveState.SWITCH_ON_DISABLED] * 2
