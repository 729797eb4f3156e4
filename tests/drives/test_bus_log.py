"""The raw frames of a run: the disk neither holds up a cycle nor ends one."""

import os
import threading
from dataclasses import replace
from pathlib import Path

import can
import pytest
from can_rig import BUS, experiment, stage

from legbench.commissioning.jitter import measure
from legbench.control import JumpConfig
from legbench.drives.emulated.build import emulate
from legbench.drives.emulated.bus import LockstepBus
from legbench.drives.master.session import Session
from legbench.drives.setup.bus_file import load_bus
from legbench.experiment import record
from legbench.loop import run
from legbench.plant.landing import End
from legbench.plants import BUS_LOG, CanChoice
from legbench.recording import writer as writing
from legbench.recording.files import Appender, append_to
from legbench.recording.reader import load
from legbench.recording.writer import RunWriter

CYCLES = 600
SYNC = 0x080
PIPE_BYTES = 1 << 16
"""What a pipe takes before it stalls."""


def test_a_disk_that_stalls_holds_up_no_cycle_and_loses_no_frame(tmp_path: Path) -> None:
    drain, stuck = os.pipe()
    content = bytearray()

    def read() -> None:
        while part := os.read(drain, 1 << 20):
            content.extend(part)

    reader = threading.Thread(target=read)
    with RunWriter.create(tmp_path, {}, realtime=True) as writer:
        with stage(experiment(JumpConfig()), lands=False) as it:
            it.session.log_to(writer._disk.log(Appender(stuck)))
            # Nobody reads: a loop that waited for its log would wait for ever.
            outcome = run(it.plant, it.controller, CYCLES, sink=writer)
            assert (outcome.status, outcome.cycles) == ("complete", CYCLES)
            reader.start()
        assert it.session.log is not None
        assert it.session.log.error is None
    reader.join()
    os.close(drain)
    path = tmp_path / "whole.log"
    path.write_bytes(content)
    assert len(content) > 1.5 * PIPE_BYTES
    logged = list(can.CanutilsLogReader(path))
    # From the NMT start on, all that was on the wire.
    wire = [frame for _, frame in it.network.log or []]
    first = next(n for n, frame in enumerate(wire) if (frame.cob_id, frame.data[:1]) == (0, b"\1"))
    for cob_id in (0x000, SYNC, 0x201, 0x202, 0x181, 0x182):
        kept = [bytes(frame.data) for frame in logged if frame.arbitration_id == cob_id]
        assert kept == [frame.data for frame in wire[first:] if frame.cob_id == cob_id], cob_id
    assert load(writer.path).complete


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no /dev/full")
def test_a_disk_that_is_full_is_an_event_of_the_run(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def opened(path: Path) -> Appender:
        full = path.name == BUS_LOG
        return Appender(os.open("/dev/full", os.O_WRONLY)) if full else append_to(path)

    monkeypatch.setattr(writing, "append_to", opened)
    choice = CanChoice(bus=BUS, interface="legbench", end=End.STOP)
    chosen = experiment(JumpConfig(), 0.3)
    finished = record(replace(chosen, plant=choice), tmp_path)
    assert finished.outcome.status == "complete"
    found = load(finished.path)
    assert len(found.time) == 300
    (event,) = [event for event in found.events if event["name"] == "bus log not written"]
    assert event["error"] == "No space left on device"


def test_a_measurement_with_a_recording_logs_its_frames_one_without_none(tmp_path: Path) -> None:
    bus = load_bus(BUS)
    network = emulate(bus, configured=True)
    with (
        Session(LockstepBus("leg", network=network), bus) as session,
        RunWriter.create(tmp_path, {}) as writer,
    ):
        measure(session, (4.0, 5.0), 100, writer)
        frames = list(can.CanutilsLogReader(writer.path / BUS_LOG))
        assert sum(frame.arbitration_id == SYNC for frame in frames) >= 100
        assert frames[-1].arbitration_id == 0  # NMT pre-operational: the log ends with the link.
        size = (writer.path / BUS_LOG).stat().st_size
        measure(session, (4.0, 5.0), 50)
        assert (writer.path / BUS_LOG).stat().st_size == size
