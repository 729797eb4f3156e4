"""The leg over a real SocketCAN interface; `make test-socketcan` runs this in its guest."""

import errno
import json
import os
import shutil
import signal
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

import can
import pytest
from processes import BUS, CHANNEL, SECOND, Child, Drives, drives_on, forked, ip, legbench

from legbench.design import load_design
from legbench.drives.errors import StopError
from legbench.drives.master.session import Session
from legbench.drives.setup.bus_file import load_bus, load_limits
from legbench.errors import PlantFault
from legbench.plant.can_choice import CanChoice
from legbench.plant.can_open import open_session

ROOT = Path(__file__).parents[2]
FULL = f"replace dev {CHANNEL} root netem limit 1 delay 3ms"
FREE = f"del dev {CHANNEL} root"
LONG_BEGUN = 100_000
"""Telemetry of some 400 cycles [bytes]."""


@pytest.fixture(autouse=True)
def channel_is_up() -> None:
    ip("link", "set", CHANNEL, "up")


@pytest.fixture
def drives(tmp_path: Path) -> Iterator[Drives]:
    with drives_on(tmp_path) as them:
        yield them


def run(folder: Path, duration: float) -> Child:
    return legbench(
        folder / "run.txt",
        *("run", "jump", "--plant", "can", *BUS, "--duration", str(duration)),
        *("--out", str(folder / "runs"), "--json"),
    )


def recorded(folder: Path) -> int:
    """Bytes of telemetry so far."""
    return sum(path.stat().st_size for path in folder.glob("runs/*/samples.arrows"))


@pytest.fixture
def running(tmp_path: Path, drives: Drives) -> Iterator[Child]:
    """A run in full swing, far from its end."""
    child = run(tmp_path, 60.0)
    try:
        drives.wait_for("operation enabled")
        child.wait_for(lambda: recorded(tmp_path) > LONG_BEGUN)
        yield child
    finally:
        child.end()


def run_folder(folder: Path) -> Path:
    (found,) = (folder / "runs").iterdir()
    return found


def manifest(folder: Path) -> dict[str, Any]:
    return json.loads((run_folder(folder) / "run.json").read_text(encoding="utf-8"))


def bus_event(folder: Path) -> dict[str, Any]:
    lines = (run_folder(folder) / "events.jsonl").read_text(encoding="utf-8").splitlines()
    return next(event for event in map(json.loads, lines) if event["name"] == "bus")


def call(folder: Path, *arguments: str) -> tuple[int, str]:
    """A command that ends by itself: exit status and what it prints."""
    child = legbench(folder / "call.txt", *arguments)
    return child.wait(), child.text


# --- before anything moves -----------------------------------------------------------------------


def test_an_interface_that_is_not_there_is_named(tmp_path: Path) -> None:
    status, text = call(tmp_path, "drives", "status", *BUS[:-1], "vcan7")
    assert status == 1
    assert "vcan7" in text
    assert "No such device" in text


def test_an_interface_that_is_down_is_named(tmp_path: Path) -> None:
    ip("link", "set", CHANNEL, "down")
    status, text = call(
        tmp_path, "run", "jump", "--plant", "can", *BUS, "--out", str(tmp_path / "runs")
    )
    assert status == 1
    assert f"{CHANNEL} is down; bring it up: `ip link set {CHANNEL} up" in text
    assert "Traceback" not in text
    assert not (tmp_path / "runs").exists()


def test_a_bus_without_drives_is_told_so(tmp_path: Path) -> None:
    status, text = call(tmp_path, "drives", "status", *BUS)
    assert status == 1
    assert "node 1" in text
    assert "does not answer" in text


def test_scan_configure_and_status(tmp_path: Path, drives: Drives) -> None:
    status, text = call(tmp_path, "drives", "scan", *BUS, "--last", "4", "--json")
    assert status == 0
    found = json.loads(text)["nodes"]
    assert [(node["node_id"], node["serial"]) for node in found] == [(1, 1001), (2, 1002)]
    assert call(tmp_path, "drives", "configure", *BUS)[0] == 1
    status, text = call(tmp_path, "drives", "configure", *BUS, "--write", "--json")
    assert status == 0
    assert json.loads(text)["written"] > 40
    assert json.loads(text)["differences"] == []
    assert (
        "motor2 (node 2): 0240h: switch on disabled" in call(tmp_path, "drives", "status", *BUS)[1]
    )


# --- a run and its traces ------------------------------------------------------------------------


def test_a_run_is_whole_and_its_bus_log_too(tmp_path: Path, drives: Drives) -> None:
    child = run(tmp_path, 0.5)
    assert child.wait() == 0, child.text
    told = manifest(tmp_path)
    assert (told["status"], told["rows"]) == ("complete", 500)
    assert told["plant"]["realtime"]["fifo"].startswith("priority")
    assert told["plant"]["realtime"]["mlockall"] == "granted"
    bus = bus_event(tmp_path)
    assert bus["skipped_cycles"] == bus["late_frames"] == bus["error_frames"] == 0
    assert bus["lost_cycles"] == [0, 0]
    drives.wait_for("switch on disabled")

    with can.CanutilsLogReader(run_folder(tmp_path) / "bus.log") as log:
        frames = list(log)
    stamps = [frame.timestamp for frame in frames]
    assert stamps == sorted(stamps)
    syncs = [frame.timestamp for frame in frames if frame.arbitration_id == 0x080]
    assert len(syncs) > 500
    first = next(place for place, stamp in enumerate(syncs) if stamp >= bus["began"] - 1e-5)
    grid = [stamp - syncs[first] for stamp in syncs[first : first + 501]]
    assert grid == pytest.approx([1e-3 * tick for tick in range(501)], abs=2e-4)
    for cob_id in (0x181, 0x182, 0x201, 0x202):
        assert sum(frame.arbitration_id == cob_id for frame in frames) >= 500


@contextmanager
def heard(channel: str, *wanted: tuple[int, int]) -> Iterator[set[int]]:
    """Identifiers that a listener with these filters (identifier, mask) hears meanwhile."""
    found: set[int] = set()
    filters: Any = [{"can_id": cob_id, "can_mask": mask} for cob_id, mask in wanted]
    with can.Bus(interface="socketcan", channel=channel, can_filters=filters) as bus:
        yield found
        while (message := bus.recv(0.1)) is not None:
            found.add(message.arbitration_id)


def test_two_channels_carry_the_frames_of_one_drive_each(tmp_path: Path) -> None:
    text = (ROOT / "hardware" / "leg.toml").read_text(encoding="utf-8")
    (tmp_path / "leg.toml").write_text(
        text.replace('name = "motor2"', f'channel = "{SECOND}"\nname = "motor2"'), encoding="utf-8"
    )
    shutil.copy(ROOT / "hardware" / "limits.toml", tmp_path)
    where = ("--bus", str(tmp_path / "leg.toml"), *BUS[:-1], f"{CHANNEL},{SECOND}")
    node = 0x7F
    with (
        heard(CHANNEL, (0x701, 0x7FF), (2, node)) as first,
        heard(SECOND, (0x702, 0x7FF), (1, node)) as second,
        drives_on(tmp_path, bus=where) as both,
    ):
        child = legbench(
            tmp_path / "run.txt",
            *("run", "jump", "--plant", "can", *where, "--duration", "0.3"),
            *("--out", str(tmp_path / "runs"), "--json"),
        )
        assert child.wait() == 0, child.text
        both.wait_for("switch on disabled")
    assert (first, second) == ({0x701}, {0x702})
    assert (manifest(tmp_path)["status"], manifest(tmp_path)["rows"]) == ("complete", 300)
    assert bus_event(tmp_path)["lost_cycles"] == [0, 0]


# --- another master ------------------------------------------------------------------------------


def test_the_channel_has_one_master_and_ctrl_c_ends_it_well(
    tmp_path: Path, drives: Drives, running: Child
) -> None:
    status, text = call(tmp_path, "drives", "configure", *BUS, "--write")
    assert status == 1
    assert f"already has a master, process {running.pid}" in text
    # Asking is acting, too: whoever asks drives that another master leads sends SDO requests.
    status, text = call(tmp_path, "drives", "status", *BUS)
    assert status == 1
    assert "somebody else sends" in text
    running.signal(signal.SIGINT)
    assert running.wait() == 0, running.text
    assert manifest(tmp_path)["status"] == "interrupted"
    assert bus_event(tmp_path)["lost_cycles"] == [0, 0]
    drives.wait_for("switch on disabled")
    assert all("quick stop active" in seen for seen in drives.states.values())


def test_a_stranger_on_the_wire_ends_the_run(
    tmp_path: Path, drives: Drives, running: Child
) -> None:
    with can.Bus(interface="socketcan", channel=CHANNEL) as stranger:
        stranger.send(can.Message(arbitration_id=0x202, data=bytes(6), is_extended_id=False))
    assert running.wait() == 1
    assert manifest(tmp_path)["cause"] == "second master"
    drives.wait_for("switch on disabled")


# --- the master goes, the interface goes ---------------------------------------------------------


@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGSTOP])
def test_drives_stop_by_themselves_when_the_master_is_gone(
    number: signal.Signals, tmp_path: Path, drives: Drives, running: Child
) -> None:
    running.signal(number)
    drives.wait_for("fault")
    drives_seen = [seen[-3:] for seen in drives.states.values()]
    running.end()
    assert all("operation enabled" in seen for seen in drives_seen)
    status, text = call(tmp_path, "recover", str(run_folder(tmp_path)), "--json")
    assert status == 0, text
    assert json.loads(text)["rows_kept"] >= 200


def test_an_interface_that_is_taken_down_ends_the_run(tmp_path: Path, running: Child) -> None:
    ip("link", "set", CHANNEL, "down")
    assert running.wait() == 1
    told = manifest(tmp_path)
    assert told["status"] == "fault"
    assert told["rows"] > 200, (told, running.text)
    assert "Network is down" in running.text


# --- a queue that is full ------------------------------------------------------------------------


@contextmanager
def cramped_queue() -> Iterator[subprocess.Popen[str]]:
    """A queue discipline in waiting: `tc` that reads its orders, on time, from a pipe."""
    shaper = subprocess.Popen(
        ["tc", "-batch", "-"], stdin=subprocess.PIPE, text=True, start_new_session=True
    )
    os.sched_setscheduler(shaper.pid, os.SCHED_FIFO, os.sched_param(90))
    try:
        yield shaper
    finally:
        assert shaper.stdin is not None
        shaper.stdin.close()
        shaper.wait()
        subprocess.run(
            ["tc", "qdisc", "del", "dev", CHANNEL, "root"], check=False, capture_output=True
        )


def order(shaper: subprocess.Popen[str], words: str) -> None:
    assert shaper.stdin is not None
    shaper.stdin.write(f"qdisc {words}\n")
    shaper.stdin.flush()


def session() -> Session:
    choice = CanChoice(bus=ROOT / "hardware" / "leg.toml", interface="socketcan", channel=CHANNEL)
    made = open_session(load_bus(choice.bus), choice)
    made.request_realtime()
    return made


def full_queue(*, lost_frames: int, cycles: int) -> dict[str, Any]:
    """A link that meets a full queue; what it saw. In a process of its own."""
    limits = replace(load_limits(ROOT / "hardware" / "limits.toml"), lost_frames=lost_frames)
    seen: dict[str, Any] = {"errors": [], "fault": None}
    stiffness = load_design(ROOT / "models" / "optimal.toml").stiffness
    # A stop that no frame of can get out is no verified stop, and says so when the link is closed.
    with (
        suppress(StopError),
        cramped_queue() as shaper,
        session() as bus,
        bus.link(limits, stiffness) as link,
    ):
        sample = link.start()
        hold = sample.applied_pos
        try:
            for cycle in range(300):
                if cycle == 100:
                    order(shaper, FULL)
                if cycle == 100 + cycles:
                    order(shaper, FREE)
                link.command(hold)
                if link.cycle.bus_error is not None:
                    seen["errors"].append(str(link.cycle.bus_error))
                link.exchange()
                if link.cycle.bus_error is not None:
                    seen["errors"].append(str(link.cycle.bus_error))
            seen["last"] = link.exchange().fresh
        except PlantFault as error:
            seen["fault"] = (error.cause, str(error))
        seen["skipped"] = link.skipped_total
        seen["lost"] = [watch.lost_total for watch in link.cycle.watches]
    return seen


def in_fork(folder: Path, **chosen: int) -> dict[str, Any]:
    """Call `full_queue` where real-time scheduling and locked memory end with the process."""
    output = folder / "seen.json"

    def work() -> int:
        output.write_text(json.dumps(full_queue(**chosen)), encoding="utf-8")
        return 0

    child = forked(folder / "link.txt", work)
    assert child.wait() == 0, child.text
    return json.loads(output.read_text(encoding="utf-8"))


def test_a_queue_that_is_full_for_a_moment_loses_cycles_and_no_more(tmp_path: Path) -> None:
    with drives_on(tmp_path, "--bare", "--patience", "50") as drives:
        seen = in_fork(tmp_path, lost_frames=50, cycles=5)
        drives.wait_for("switch on disabled")
    assert seen["fault"] is None
    assert any(os.strerror(errno.ENOBUFS) in text for text in seen["errors"])
    assert max(seen["lost"]) >= 1
    assert seen["last"] == [True, True]


def test_a_queue_that_stays_full_ends_the_run_and_is_named(tmp_path: Path) -> None:
    with drives_on(tmp_path, "--bare"):
        seen = in_fork(tmp_path, lost_frames=3, cycles=200)
    cause, text = seen["fault"]
    assert cause in ("process data lost", "command not sent")
    assert os.strerror(errno.ENOBUFS) in text
    assert "txqueuelen" in text
