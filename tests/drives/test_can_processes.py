"""Master and drives in processes of their own, over AF_UNIX and over a terminal; bounded in time,
none measured.
"""

import json
import os
import re
import signal
from pathlib import Path

import pytest
from can_rig import ROOT
from served_drives import (
    LOOSE,
    PATIENCE,
    end,
    interrupted,
    leading,
    run_folder,
    served,
    started,
)

from legbench.commissioning import configure, jitter, zero
from legbench.commissioning.home import home
from legbench.commissioning.jog import jog
from legbench.design import load_design
from legbench.drives.master.session import Session
from legbench.drives.setup.bus_file import load_bus
from legbench.drives.transport.lock import ChannelLock
from legbench.drives.transport.unix_bus import UnixBus
from legbench.errors import PlantFault
from legbench.plants import limits_for
from legbench.recording.events import read_events
from legbench.recording.repair import recover


@pytest.mark.parametrize("name", ["SIGKILL", "SIGSTOP"])
def test_drives_stop_by_themselves_when_the_master_is_gone(name: str, tmp_path: Path) -> None:
    with served(tmp_path, deadline_ms=1000) as drives, leading(tmp_path, drives) as run:
        os.kill(run.pid, getattr(signal, name))
        drives.await_state("switch on disabled")
        assert [state for _, state in drives.seen[-4:]].count("quick stop active") >= 1
    report = recover(run_folder(tmp_path))
    assert report.rows_kept > 0


def test_interrupting_the_master_stops_both_drives_and_keeps_the_run(tmp_path: Path) -> None:
    with served(tmp_path) as drives, leading(tmp_path, drives) as run:
        interrupted(drives, run)
    manifest = json.loads((run_folder(tmp_path) / "run.json").read_text())
    assert manifest["status"] == "interrupted"
    assert manifest["plant"]["realtime"]["kernel"]
    assert (run_folder(tmp_path) / "bus.log").stat().st_size > 0


def test_a_run_over_the_slcan_of_python_can(tmp_path: Path) -> None:
    with served(tmp_path, "--serve", "slcan") as drives:
        drives.await_state("switch on disabled")
        run = started(
            tmp_path,
            *("run", "position-jump", "--plant", "can", "--bus", "leg.toml", "--duration", "0.3"),
            *("--interface", "slcan", "--channel", "leg.sock", "--bitrate", "1000000"),
            *("--design", str(ROOT / "models" / "optimal.toml"), "--out", "runs"),
        )
        try:
            drives.await_state("operation enabled")
            drives.await_state("switch on disabled")
            _, complaint = run.communicate(timeout=PATIENCE)
        finally:
            end(run)
    assert run.returncode == 0, complaint
    manifest = json.loads((run_folder(tmp_path) / "run.json").read_text())
    assert (manifest["status"], manifest["plant"]["bus"]["interface"]) == ("complete", "slcan")
    log = (run_folder(tmp_path) / "bus.log").read_text(encoding="ascii")
    assert all(f" {cob_id}#" in log for cob_id in ("080", "181", "182", "201", "202"))


def test_looking_beside_a_master_changes_nothing_for_it(tmp_path: Path) -> None:
    with served(tmp_path) as drives, leading(tmp_path, drives) as run:
        look = started(
            tmp_path,
            *("run", "position-jump", "--plant", "can", "--bus", "leg.toml", "--read-only"),
            *("--interface", "legbench_unix", "--channel", "leg.sock", "--out", "looks"),
            *("--duration", "0.3", "--design", str(ROOT / "models" / "optimal.toml")),
        )
        _, complaint = look.communicate(timeout=PATIENCE)
        assert look.returncode == 0, complaint
        interrupted(drives, run)
    kept = run_folder(tmp_path)
    assert json.loads((kept / "run.json").read_text())["status"] == "interrupted"
    # The drives stayed enabled from the master's start to its ^C.
    assert [state for _, state in drives.seen].count("operation enabled") == 2


def test_nobody_acts_beside_a_master_of_another_computer(tmp_path: Path) -> None:
    """The lock keeps others of this computer away; those of another one have only the wire."""
    with served(tmp_path) as drives, leading(tmp_path, drives) as run:
        config = load_bus(tmp_path / "leg.toml")
        limits = limits_for(tmp_path / "limits.toml", load_design(ROOT / "models" / "optimal.toml"))
        for act in (
            configure.write,
            lambda it: home(it, config.nodes[0], 37),
            lambda it: jog(it, limits, (4.0, 5.0), "motor1", by=0.01, speed=0.1, back=True),
            lambda it: jitter.measure(it, (4.0, 5.0), 10),
            lambda it: zero.measure(it, (0.0, 0.0)),
            lambda it: it.link(limits, (4.0, 5.0)).start(),
        ):
            bus = UnixBus(str(tmp_path / "leg.sock"))
            with (
                Session(bus, config, lock=ChannelLock.private("another computer")) as session,
                pytest.raises(PlantFault, match="somebody else sends") as caught,
            ):
                act(session)
            assert caught.value.cause == "second master"
        trouble = interrupted(drives, run)
    manifest = json.loads((run_folder(tmp_path) / "run.json").read_text())
    assert manifest["status"] == "interrupted"
    assert [state for _, state in drives.seen].count("operation enabled") == 2
    # What the files waive is said before the run, in its manifest and in its events.
    assert "the bus file waives the master watch: drives may go on for 4001 ms" in trouble
    assert manifest["plant"]["bus"]["waived"] == ["master watch", "drive heartbeat"]
    assert manifest["plant"]["limits"]["waive"] == list(LOOSE)
    (told,) = [event for event in read_events(run_folder(tmp_path))[0] if event["name"] == "waived"]
    assert len(told["protections"]) == 2 + len(LOOSE)


SLOW = 0.05
"""Time that each step of a guest takes [s]."""


def test_a_guest_that_takes_too_long_is_the_fault_with_its_own_lines(tmp_path: Path) -> None:
    own = (ROOT / "scripts" / "examples" / "own_controller.py").read_text(encoding="utf-8")
    step = "    def step(self, observation):\n"
    sleeping = f"        __import__('time').sleep({SLOW})\n"
    (tmp_path / "mine.py").write_text(own.replace(step, step + sleeping), encoding="utf-8")
    with served(tmp_path) as drives:
        limits = (tmp_path / "limits.toml").read_text(encoding="utf-8")
        fewer = limits.replace("overrun_cycles = 5000", "overrun_cycles = 1000")
        (tmp_path / "limits.toml").write_text(fewer, encoding="utf-8")
        drives.await_state("switch on disabled")
        run = started(
            tmp_path,
            *("run", "mine.py:Pump", "--plant", "can", "--bus", "leg.toml", "--duration", "10"),
            *("--interface", "legbench_unix", "--channel", "leg.sock", "--out", "runs"),
            *("--design", str(ROOT / "models" / "optimal.toml")),
        )
        try:
            drives.await_state("operation enabled")
            drives.await_state("switch on disabled")
            _, complaint = run.communicate(timeout=PATIENCE)
        finally:
            end(run)
    assert run.returncode == 1, complaint
    assert "Traceback" not in complaint
    number = own[: own.index(step)].count("\n") + 1
    assert f"mine.py:{number} in step: def step(self, observation):" in complaint
    assert re.search(r"the controller's step took [0-9.]+ periods", complaint)
    manifest = json.loads((run_folder(tmp_path) / "run.json").read_text())
    assert (manifest["status"], manifest["cause"]) == ("fault", "cycle overruns")
    assert manifest["rows"] >= 10
