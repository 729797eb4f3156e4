"""Master and drives in processes of their own, over AF_UNIX and over a terminal; bounded in time,
none measured.
"""

import json
import os
import re
import signal
import time
from collections.abc import Iterator
from pathlib import Path
from subprocess import Popen

import pytest
from can_rig import ROOT
from served_drives import (
    LOOSE,
    PATIENCE,
    Served,
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


@pytest.mark.long
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


SLOW = 0.05
"""Time that each step of a guest takes [s]."""


@pytest.mark.long
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


@pytest.fixture(scope="module")
def led(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[Served, Popen[str], Path]]:
    """Drives that a master leads: tests look at them and disturb nothing until one ends it."""
    folder = tmp_path_factory.mktemp("led")
    with served(folder, deadline_ms=2000) as drives:
        drives.await_state("switch on disabled")
        with leading(folder, drives) as run:
            yield drives, run, folder


def rows_go_on(folder: Path) -> bool:
    """Whether the master still records."""
    stream = run_folder(folder) / "samples.arrows"
    size, until = stream.stat().st_size, time.monotonic() + PATIENCE
    while stream.stat().st_size == size and time.monotonic() < until:
        time.sleep(0.02)
    return stream.stat().st_size > size


@pytest.mark.long
def test_looking_beside_a_master_changes_nothing_for_it(
    led: tuple[Served, Popen[str], Path],
) -> None:
    _, run, folder = led
    look = started(
        folder,
        *("run", "position-jump", "--plant", "can", "--bus", "leg.toml", "--read-only"),
        *("--interface", "legbench_unix", "--channel", "leg.sock", "--out", "looks"),
        *("--duration", "0.3", "--design", str(ROOT / "models" / "optimal.toml")),
    )
    _, complaint = look.communicate(timeout=PATIENCE)
    assert look.returncode == 0, complaint
    assert run.poll() is None
    assert rows_go_on(folder)


def test_nobody_acts_beside_a_master_of_another_computer(
    led: tuple[Served, Popen[str], Path],
) -> None:
    """The lock keeps others of this computer away; those of another one have only the wire."""
    _, run, folder = led
    config = load_bus(folder / "leg.toml")
    limits = limits_for(folder / "limits.toml", load_design(ROOT / "models" / "optimal.toml"))
    for act in (
        configure.write,
        lambda it: home(it, config.nodes[0], 37),
        lambda it: jog(it, limits, (4.0, 5.0), "motor1", by=0.01, speed=0.1, back=True),
        lambda it: jitter.measure(it, (4.0, 5.0), 10),
        lambda it: zero.measure(it, (0.0, 0.0)),
        lambda it: it.link(limits, (4.0, 5.0)).start(),
    ):
        bus = UnixBus(str(folder / "leg.sock"))
        with (
            Session(bus, config, lock=ChannelLock.private("another computer")) as session,
            pytest.raises(PlantFault, match="somebody else sends") as caught,
        ):
            act(session)
        assert caught.value.cause == "second master"
    assert run.poll() is None
    assert rows_go_on(folder)


def test_interrupting_the_master_stops_both_drives_and_keeps_the_run(
    led: tuple[Served, Popen[str], Path],
) -> None:
    drives, run, folder = led
    trouble = interrupted(drives, run)
    manifest = json.loads((run_folder(folder) / "run.json").read_text())
    assert manifest["status"] == "interrupted"
    assert manifest["plant"]["realtime"]["kernel"]
    assert (run_folder(folder) / "bus.log").stat().st_size > 0
    # The drives stayed enabled from the master's start to its ^C, whoever looked and tried to act.
    assert [state for _, state in drives.seen].count("operation enabled") == 2
    # What the files waive is said before the run, in its manifest and in its events.
    assert "the bus file waives the master watch: drives may go on for 2004 ms" in trouble
    assert manifest["plant"]["bus"]["waived"] == ["master watch", "drive heartbeat"]
    assert manifest["plant"]["limits"]["waive"] == list(LOOSE)
    (told,) = [event for event in read_events(run_folder(folder))[0] if event["name"] == "waived"]
    assert len(told["protections"]) == 2 + len(LOOSE)


@pytest.mark.parametrize("name", ["SIGKILL", pytest.param("SIGSTOP", marks=pytest.mark.long)])
def test_drives_stop_by_themselves_when_the_master_is_gone(
    name: str, led: tuple[Served, Popen[str], Path]
) -> None:
    """The drives of the tests above, led by another master."""
    drives, run, folder = led
    if run.poll() is None:
        interrupted(drives, run)
    with leading(folder, drives, name) as other:
        os.kill(other.pid, getattr(signal, name))
        drives.await_state("switch on disabled")
    assert [state for _, state in drives.seen[-4:]].count("quick stop active") >= 1
    assert recover(run_folder(folder, name)).rows_kept > 0
