"""Master and drives in processes of their own, over AF_UNIX and over a terminal; bounded in time,
none measured.
"""

import json
import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path

import pytest
from can_rig import BUS, LIMITS, ROOT

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

PATIENCE = 30.0
"""Longest that anything may take on a busy machine [s]."""
LOOSE = {
    "lost_frames": 5000,
    "overrun_cycles": 5000,
    "following_cycles": 5000,
    "joint_speed": 1000.0,
    "standing": 6.0,
    "sway": 6.0,
}
"""Limits that act while a machine is busy. Drives that were kept waiting make up for it by 3 ms at
once: between two SYNCs their leg then moves three times as fast as it is."""
CALL = "import sys\nfrom legbench.cli import main\nsys.exit(main(sys.argv[1:]))"


@dataclass
class Served:
    """Emulated drives that other processes can reach."""

    folder: Path
    process: subprocess.Popen[str]
    seen: list[tuple[str, str]] = field(default_factory=list)

    def await_state(self, state: str, count: int = 2) -> None:
        """Read on until so many drives have come to a state."""
        assert self.process.stdout is not None
        found = 0
        while found < count:
            line = self.process.stdout.readline()
            assert line, f"the drives ended; seen: {self.seen}"
            told = json.loads(line)
            self.seen.append((told["node"], told["state"]))
            found += told["state"] == state


def calm(folder: Path, deadline_ms: int = 4000) -> Path:
    """The bench's files, patient enough for a machine that stands still for seconds."""
    text = BUS.read_text(encoding="utf-8")
    waived = 'waive = ["master watch", "drive heartbeat"]'
    text = text.replace("master_heartbeat_ms = 10", f"master_heartbeat_ms = 2000\n{waived}")
    text = text.replace("heartbeat_ms = 20\n", "heartbeat_ms = 2000\n", 1)
    rpdo = '\n[[node.rpdo]]\nnumber = 1\nobjects = ["6040:00 u16", "607A:00 i32"]\n'
    text = text.replace(
        "\n[node.parameters]", rpdo + f"deadline_ms = {deadline_ms}\n\n[node.parameters]"
    )
    (folder / "leg.toml").write_text(text, encoding="utf-8")
    shutil.copy(LIMITS, folder / "limits.toml")
    loose = (folder / "limits.toml").read_text(encoding="utf-8")
    for name, value in LOOSE.items():
        loose = "\n".join(
            f"{name} = {value:g}" if line.startswith(name) else line for line in loose.splitlines()
        )
    waive = f"waive = {json.dumps(list(LOOSE))}\n"
    (folder / "limits.toml").write_text(loose + "\n" + waive, encoding="utf-8")
    return folder / "leg.toml"


def started(folder: Path, *arguments: str) -> subprocess.Popen[str]:
    return subprocess.Popen(
        [sys.executable, "-c", CALL, *arguments],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        cwd=folder,
    )


def end(process: subprocess.Popen[str]) -> None:
    with suppress(ProcessLookupError):
        os.kill(process.pid, signal.SIGKILL)
    process.communicate()


@contextmanager
def served(
    folder: Path, *how: str, seconds: float = 3 * PATIENCE, deadline_ms: int = 4000
) -> Iterator[Served]:
    """Drives over AF_UNIX that end by themselves after a while [s]."""
    calm(folder, deadline_ms)
    process = started(
        folder,
        *("drives", "emulate", "--bus", "leg.toml", "--channel", "leg.sock", "--bare", "--json"),
        *how,
        *("--patience", "5000", "--seconds", str(seconds)),
        *("--design", str(ROOT / "models" / "optimal.toml")),
    )
    try:
        yield Served(folder, process)
    finally:
        end(process)


def master(folder: Path) -> subprocess.Popen[str]:
    return started(
        folder,
        *("run", "position-jump", "--plant", "can", "--bus", "leg.toml", "--duration", "25"),
        *("--interface", "legbench_unix", "--channel", "leg.sock", "--out", "runs"),
        *("--design", str(ROOT / "models" / "optimal.toml")),
    )


def run_folder(folder: Path) -> Path:
    return next((folder / "runs").iterdir())


def rows_on_disk(folder: Path) -> None:
    """Wait until the recording has begun."""
    until = time.monotonic() + PATIENCE
    while time.monotonic() < until:
        found = list((folder / "runs").glob("*/samples.arrows"))
        if found and found[0].stat().st_size > 20_000:
            return
        time.sleep(0.02)
    pytest.fail("no rows")


@pytest.mark.parametrize("name", ["SIGKILL", "SIGSTOP"])
def test_drives_stop_by_themselves_when_the_master_is_gone(name: str, tmp_path: Path) -> None:
    with served(tmp_path, deadline_ms=1000) as drives:
        drives.await_state("switch on disabled")
        run = master(tmp_path)
        try:
            drives.await_state("operation enabled")
            rows_on_disk(tmp_path)
            os.kill(run.pid, getattr(signal, name))
            drives.await_state("switch on disabled")
            assert [state for _, state in drives.seen[-4:]].count("quick stop active") >= 1
        finally:
            end(run)
    report = recover(run_folder(tmp_path))
    assert report.rows_kept > 0


def test_interrupting_the_master_stops_both_drives_and_keeps_the_run(tmp_path: Path) -> None:
    with served(tmp_path) as drives:
        drives.await_state("switch on disabled")
        run = master(tmp_path)
        try:
            drives.await_state("operation enabled")
            rows_on_disk(tmp_path)
            os.kill(run.pid, signal.SIGINT)
            drives.await_state("switch on disabled")
            _, complaint = run.communicate(timeout=PATIENCE)
        finally:
            end(run)
    assert run.returncode == 0, complaint
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
    with served(tmp_path) as drives:
        drives.await_state("switch on disabled")
        run = master(tmp_path)
        try:
            drives.await_state("operation enabled")
            rows_on_disk(tmp_path)
            look = started(
                tmp_path,
                *("run", "position-jump", "--plant", "can", "--bus", "leg.toml", "--read-only"),
                *("--interface", "legbench_unix", "--channel", "leg.sock", "--out", "looks"),
                *("--duration", "0.3", "--design", str(ROOT / "models" / "optimal.toml")),
            )
            _, complaint = look.communicate(timeout=PATIENCE)
            assert look.returncode == 0, complaint
            if run.poll() is not None:
                pytest.fail(f"the master ended beside a looker: {run.communicate()[1]}")
            os.kill(run.pid, signal.SIGINT)
            drives.await_state("switch on disabled")
            _, trouble = run.communicate(timeout=PATIENCE)
        finally:
            end(run)
    assert run.returncode == 0, trouble
    kept = run_folder(tmp_path)
    assert json.loads((kept / "run.json").read_text())["status"] == "interrupted"
    # The drives stayed enabled from the master's start to its ^C.
    assert [state for _, state in drives.seen].count("operation enabled") == 2


def test_nobody_acts_beside_a_master_of_another_computer(tmp_path: Path) -> None:
    """The lock keeps others of this computer away; those of another one have only the wire."""
    with served(tmp_path) as drives:
        drives.await_state("switch on disabled")
        run = master(tmp_path)
        try:
            drives.await_state("operation enabled")
            rows_on_disk(tmp_path)
            config = load_bus(tmp_path / "leg.toml")
            limits = limits_for(
                tmp_path / "limits.toml", load_design(ROOT / "models" / "optimal.toml")
            )
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
            if run.poll() is not None:
                pytest.fail(f"the master ended beside a looker: {run.communicate()[1]}")
            os.kill(run.pid, signal.SIGINT)
            drives.await_state("switch on disabled")
            _, trouble = run.communicate(timeout=PATIENCE)
        finally:
            end(run)
    assert run.returncode == 0, trouble
    manifest = json.loads((run_folder(tmp_path) / "run.json").read_text())
    assert manifest["status"] == "interrupted"
    assert [state for _, state in drives.seen].count("operation enabled") == 2
    # What the files waive is said before the run, in its manifest and in its events.
    assert "the bus file waives the master watch: drives may go on for 4001 ms" in trouble
    assert manifest["plant"]["bus"]["waived"] == ["master watch", "drive heartbeat"]
    assert manifest["plant"]["limits"]["waive"] == list(LOOSE)
    (told,) = [event for event in read_events(run_folder(tmp_path))[0] if event["name"] == "waived"]
    assert len(told["protections"]) == 2 + len(LOOSE)
