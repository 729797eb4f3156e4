"""`legbench drives` and `legbench run --plant can` as a user calls them."""

import json
import os
import re
import shutil
import signal
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any

import can
import pytest
from commands import Done, called

from legbench.drives.emulated.network import Network
from legbench.drives.master.session import Session
from legbench.drives.setup.bus_file import load_bus
from legbench.drives.setup.config import BusConfig
from legbench.drives.transport.lock import ChannelLock
from legbench.drives.transport.realtime import Granted
from legbench.plant import can_open
from legbench.plant.can_open import IDLE_POS
from legbench.recording.reader import load

HARDWARE = Path(__file__).parents[2] / "hardware"
MODELS = Path(__file__).parents[2] / "models"
BUS = HARDWARE / "leg.toml"
EMULATED = ("--interface", "legbench", "--bus", BUS)
DESIGN = ("--design", MODELS / "optimal.toml")

Drives = Callable[..., Done]
"""Calls `legbench drives` on the emulated leg."""


@pytest.fixture
def drives(capfd: pytest.CaptureFixture[str]):
    def call(*arguments: str | Path) -> Done:
        return called(capfd, "drives", *arguments, *EMULATED, *DESIGN)

    return call


def changed(folder: Path, *changes: tuple[str, str]) -> Path:
    """The bench's files with some text replaced."""
    shutil.copy(HARDWARE / "limits.toml", folder / "limits.toml")
    text = BUS.read_text(encoding="utf-8")
    for old, new in changes:
        assert old in text
        text = text.replace(old, new, 1)
    path = folder / "leg.toml"
    path.write_text(text, encoding="utf-8")
    return path


def test_scan_finds_both_drives_with_their_identity(drives: Drives) -> None:
    done = drives("scan", "--last", "5", "--json")
    assert done.status == 0, done.err
    nodes = json.loads(done.out)["nodes"]
    assert [(node["node_id"], node["serial"]) for node in nodes] == [(1, 1001), (2, 1002)]
    assert nodes[0]["verdict"] == "'motor1' of the bus file"


def test_scan_misses_a_drive_that_is_beyond_the_last_id(drives: Drives) -> None:
    done = drives("scan", "--last", "1")
    assert done.status == 1
    assert "not there: 'motor2'" in done.err


def test_status_speaks_in_words(drives: Drives) -> None:
    done = drives("status")
    assert done.status == 0
    assert "motor1 (node 1): 0240h: switch on disabled, remote" in done.out
    assert "error none, 25.0 deg C" in done.out


def test_configure_tells_differences_and_writes_only_when_asked(drives: Drives) -> None:
    done = drives("configure")
    assert done.status == 1
    assert "motor1: 60C2h:02 Interpolation time index holds -2, wanted -3" in done.out
    done = drives("configure", "--write")
    assert done.status == 0, done.err
    assert re.search(r"wrote \d+ objects, read every one back\n0 objects differ", done.out)


def test_zero_writes_offsets_and_keeps_the_comments(
    capfd: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    path = changed(tmp_path)
    where = ("--interface", "legbench", "--bus", path)
    done = called(capfd, "drives", "zero", "--posture", "-0.4", "0.4", *where)
    assert done.status == 0, done.err
    nodes = load_bus(path).nodes
    before = load_bus(BUS).nodes
    motor = before[0].motor.to_counts(IDLE_POS[0])
    assert abs(nodes[0].motor.to_rad(motor) + 0.4) < nodes[0].motor.resolution
    link = before[1].link_units.to_counts(IDLE_POS[1])
    assert abs(nodes[1].link_units.to_rad(link) - 0.4) < nodes[1].link_units.resolution
    assert path.read_text().count("#") == BUS.read_text().count("#")


def test_home_calls_the_present_position_zero(drives: Drives) -> None:
    done = drives("home", "--node", "motor2", "--json")
    assert done.status == 0, done.err
    told = json.loads(done.out)
    assert (told["after_counts"], told["granted"]) == (0, None)


@pytest.mark.parametrize("method", ["-1", "-4", "1", "17", "23", "34"])
def test_every_kind_of_homing_can_be_tried(
    method: str, capfd: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    quick = changed(tmp_path, ('"6099:01 u32" = 12517', '"6099:01 u32" = 60_000'))
    where = ("--interface", "legbench", "--bus", quick, *DESIGN)
    words = ("home", "--node", "motor1", "--method", method, "--json")
    done = called(capfd, "drives", *words, *where)
    assert done.status == 0, done.err
    told = json.loads(done.out)
    assert (told["method"], told["after_counts"]) == (int(method), 0)


def test_reset_tells_every_drive_and_what_it_was(drives: Drives) -> None:
    done = drives("reset")
    assert done.status == 0, done.err
    line = "was in no fault; now 0240h: switch on disabled, remote"
    assert done.out == f"motor1 {line}\nmotor2 {line}\n"
    nodes = json.loads(drives("reset", "--node", "motor2", "--json").out)["nodes"]
    assert [(node["node"], node["error"], node["in_fault"]) for node in nodes] == [
        ("motor2", "", False)
    ]


def test_reset_fails_while_the_cause_is_there(
    drives: Drives, monkeypatch: pytest.MonkeyPatch
) -> None:
    real = can_open.emulate

    def tripped(*arguments: Any, **named: Any) -> Network:
        network = real(*arguments, **named)
        network.advance(20_000_000)
        network.drives[1].trip(0x3220, network.now_ns)
        return network

    monkeypatch.setattr(can_open, "emulate", tripped)
    done = drives("reset")
    assert done.status == 1
    assert "motor2 was in fault: 3220h under-voltage; now 0208h: fault, remote" in done.out
    assert "motor2 is still in fault" in done.err
    jogged = drives("jog", "--node", "motor1")
    assert jogged.status == 1
    assert "run `legbench drives reset --node motor2`" in jogged.err


def test_store_names_the_drives_that_have_stored(drives: Drives) -> None:
    done = drives("store", "--node", "motor2")
    assert done.status == 0, done.err
    assert done.out == "motor2 has stored its parameters (1010h:01)\n"
    stored = json.loads(drives("store", "--part", "2", "--json").out)["stored"]
    assert [(one["node"], one["part"]) for one in stored] == [("motor1", 2), ("motor2", 2)]


def test_node_id_works_with_one_drive_on_the_bus(
    capfd: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    text = BUS.read_text(encoding="utf-8")
    path = tmp_path / "leg.toml"
    path.write_text(text[: text.rindex("[[node]]")], encoding="utf-8")
    where = ("--interface", "legbench", "--bus", path)
    done = called(capfd, "drives", "node-id", "--to", "9", *where)
    assert done.status == 0, done.err
    assert "serial 1001  revision 0  was node 1, is node 9" in done.out
    told = json.loads(called(capfd, "drives", "node-id", "--to", "9", "--json", *where).out)
    assert (told["before"], told["after"], told["stored"]) == (1, 9, True)


def test_jog_moves_one_motor_and_comes_back(drives: Drives) -> None:
    done = drives("jog", "--node", "motor1", "--by", "0.05", "--json")
    assert done.status == 0, done.err
    jogged = json.loads(done.out)
    moved = [after - before for before, after in zip(*_ends(jogged), strict=True)]
    assert moved == pytest.approx([0.05, 0.0], abs=1e-4)
    assert jogged["granted"] is None


@pytest.mark.parametrize(
    "command", [("home", "--node", "motor1"), ("jog", "--node", "motor1")], ids=lambda it: it[0]
)
def test_what_moves_asks_for_real_time_and_says_what_was_granted(
    command: tuple[str, ...], drives: Drives, monkeypatch: pytest.MonkeyPatch
) -> None:
    granted = Granted(
        fifo="refused (no)", mlockall="granted", affinity="", spin_us=0, kernel="", preemption=""
    )
    monkeypatch.setattr(Session, "request_realtime", lambda _session: granted)
    done = drives(*command)
    assert done.status == 0, done.err
    assert "SCHED_FIFO refused (no); locked memory granted" in done.err
    assert json.loads(drives(*command, "--json").out)["granted"]["fifo"] == "refused (no)"


def _ends(jogged: dict[str, list[float]]) -> tuple[list[float], list[float]]:
    return jogged["before_pos"], jogged["after_pos"]


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("jog", "--node", "motor3"), ("no node 'motor3'", "motor1, motor2")),
        (("jog", "--node", "motor1", "--by", "0.5"), ("0.5 rad", "up to 0.3 rad")),
        (("jog", "--node", "motor1", "--speed", "3"), ("3 rad/s", "up to 1 rad/s")),
        (("home", "--node", "knee"), ("no node 'knee'",)),
        (("home", "--node", "motor1", "--method", "99"), ("method is 99", "1 to 37", "-128")),
        (("home", "--node", "motor1", "--method", "36"), ("homing method 36", "06090030h")),
        (("reset", "--node", "knee"), ("no node 'knee'", "motor1, motor2")),
        (("store", "--node", "knee"), ("no node 'knee'",)),
        (("store", "--part", "0"), ("part is 0", "1 to 127")),
        (("store", "--timeout", "nan"), ("timeout is nan s", "60 s at most")),
        (("node-id", "--to", "0"), ("node id is 0", "1 to 127")),
        (("node-id", "--to", "126"), ("node id is 126", "master's")),
        (("node-id", "--to", "5"), ("nodes 1, 2 answer", "disconnect")),
        (("emulate", "--channel", "x", "--only", "hip"), ("no node 'hip'", "motor1, motor2")),
        (("home", "--node", "motor1", "--timeout", "-1"), ("timeout is -1 s", "positive")),
        (("zero", "--posture", "0", "nan"), ("posture is nan rad", "-pi to pi rad")),
        (("scan", "--last", "0"), ("last is 0", "1 to 127")),
        (("scan", "--last", "128"), ("last is 128", "1 to 127")),
        (("jitter", "--cycles", "0"), ("cycles is 0",)),
        (("emulate",), ("needs --channel",)),
        (("emulate", "--serve", "slcan"), ("--interface legbench", "give one of the two")),
        (("monitor", "--every", "0"), ("every is 0 s",)),
    ],
)
def test_actions_refuse_what_makes_no_sense(
    drives: Drives, arguments: tuple[str, ...], words: tuple[str, ...]
) -> None:
    drives(*arguments).refused(*words)


@pytest.mark.parametrize("names", ["leg.sock", "leg.sock,leg.sock"])
def test_emulate_wants_a_socket_file_for_each_channel(
    names: str, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    bus = changed(tmp_path, ('name = "motor2"', 'channel = "can1"\nname = "motor2"'))
    ask = ("drives", "emulate", "--bus", bus, "--bare", "--seconds", "0.05")
    at = ",".join(str(tmp_path / name) for name in names.split(","))
    done = called(capfd, *ask, "--channel", at)
    done.refused("2 channels, can0, can1", "--channel can0.sock,can1.sock")
    assert list(tmp_path.glob("*.sock")) == []
    one = ("--channel", at.split(",")[0])
    assert called(capfd, *ask, *one, "--only", "motor2").status == 0


def test_emulate_gives_each_channel_a_terminal_of_its_own(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    bus = changed(tmp_path, ('name = "motor2"', 'channel = "can1"\nname = "motor2"'))
    ask = ("drives", "emulate", "--bus", bus, "--serve", "slcan", "--bare", "--seconds", "0.05")
    done = called(capfd, *ask)
    assert done.status == 0
    assert re.search(r"--interface slcan --channel /dev/pts/\d+,/dev/pts/\d+ ", done.err)
    links = tmp_path / "a.tty", tmp_path / "b.tty"
    done = called(capfd, *ask, "--channel", ",".join(map(str, links)))
    assert done.status == 0
    done = called(capfd, *ask, "--channel", "a.tty")
    done.refused("2 channels, can0, can1", "a link for each", "--channel can0.tty,can1.tty")
    assert list(tmp_path.glob("*.tty")) == []
    assert called(capfd, *ask, "--only", "motor2").status == 0


def test_emulate_lets_each_drive_speak_on_its_own_bus_alone(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    bus = changed(tmp_path, ('name = "motor2"', 'channel = "can1"\nname = "motor2"'))
    names = ("emulated a", "emulated b")
    heard = [can.Bus(interface="virtual", channel=name) for name in names]
    seen: list[set[int]] = []

    def listen_then_stop() -> None:
        first = [one.recv(20.0) for one in heard]
        seen.extend({frame.arbitration_id} for frame in first if frame is not None)
        if len(seen) == 2:
            os.kill(os.getpid(), signal.SIGINT)

    listener = threading.Thread(target=listen_then_stop)
    listener.start()
    ask = ("drives", "emulate", "--bus", bus, "--bare", "--seconds", "60")
    done = called(capfd, *ask, "--interface", "virtual", "--channel", ",".join(names))
    listener.join()
    assert done.status == 0, done.err
    for one, ids in zip(heard, seen, strict=True):
        while (frame := one.recv(0.0)) is not None:
            ids.add(frame.arbitration_id)
        one.shutdown()
    assert seen == [{0x701}, {0x702}]


def test_emulate_serves_two_channels_and_leaves_no_socket_file(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    bus = changed(tmp_path, ('name = "motor2"', 'channel = "can1"\nname = "motor2"'))
    ask = ("drives", "emulate", "--bus", bus, "--bare", "--seconds", "0.05")
    first, second = tmp_path / "a.sock", tmp_path / "b.sock"
    done = called(capfd, *ask, "--channel", f"{first},{second}")
    assert done.status == 0
    assert f"--interface legbench_unix --channel {first},{second}" in done.err
    assert list(tmp_path.glob("*.sock")) == []
    # A file that is there is not overwritten, and the socket file made before it is gone, too.
    second.write_text("mine")
    called(capfd, *ask, "--channel", f"{first},{second}").refused("cannot serve a bus", "b.sock")
    assert (first.exists(), second.read_text()) == (False, "mine")


def test_jitter_in_virtual_time_is_punctual(drives: Drives, tmp_path: Path) -> None:
    plot = tmp_path / "timing.svg"
    done = drives("jitter", "--cycles", "200", "--plot", plot, "--json")
    assert done.status == 0, done.err
    told = json.loads(done.out)
    assert told["late_us"]["max"] == 0.0
    assert told["skipped"] == 0
    assert told["granted"] is None
    assert plot.stat().st_size > 1000


def test_a_plot_of_no_kind_is_refused_before_anything_is_measured(
    drives: Drives, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("legbench.commissioning.jitter.measure", None)
    drives("jitter", "--plot", "x.bmp").refused("a figure cannot be written as 'x.bmp'")


def test_jitter_measures_with_a_recording_and_without(drives: Drives, tmp_path: Path) -> None:
    done = drives(
        "jitter", "--cycles", "120", "--recording", "both", "--out", tmp_path / "kept", "--json"
    )
    assert done.status == 0, done.err
    tables = json.loads(done.out)["recording"]
    assert {name: table["lost"] for name, table in tables.items()} == {"with": 0, "without": 0}
    (run,) = (tmp_path / "kept").iterdir()
    assert len(load(run).time) == 120
    assert f"wrote {run}" in done.err
    done = drives("jitter", "--cycles", "60", "--recording", "without")
    assert "without a recording" in done.out
    assert "with a recording" not in done.out


def test_budget_is_the_worst_case_and_refuses_too_much(
    drives: Drives, capfd: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    done = drives("budget", "--json")
    assert done.status == 0
    assert json.loads(done.out)["load"] == pytest.approx(0.568, abs=0.001)
    slow = changed(tmp_path, ("1_000_000", "500_000"))
    done = called(capfd, "drives", "budget", "--bus", slow)
    assert done.status == 2
    assert "114 % of 500000 bit/s at worst, the limit is 80 %" in done.err


def test_a_budget_of_two_channels_says_which_frame_is_on_which(
    capfd: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    two = changed(tmp_path, ('name = "motor2"', 'channel = "can1"\nname = "motor2"'))
    done = called(capfd, "drives", "budget", "--bus", two)
    ends = {line.split(" ")[0]: line.partition(" % ")[2] for line in done.out.splitlines()[:10]}
    assert (ends["RPDO1"], ends["SYNC"]) == ("of can1", "of can1")
    assert sum(line.endswith(" % of can0") for line in done.out.splitlines()) == 5
    frames = json.loads(called(capfd, "drives", "budget", "--json", "--bus", two).out)["frames"]
    assert [frame["channel"] for frame in frames] == ["can0"] * 5 + ["can1"] * 5


def test_monitor_sends_nothing_and_ends_by_itself(drives: Drives) -> None:
    done = drives("monitor", "--seconds", "0.1", "--every", "0.05")
    assert done.status == 0
    assert done.out.count("no process data") == 4


# --- bad input: named before anything is enabled ---------------------------------------------

JUMP = ("run", "jump", "--plant", "can", "--duration", "0.05", *DESIGN)


@pytest.mark.parametrize(
    ("flags", "words"),
    [
        (("--interface", "teleport"), ("cannot open teleport", "Unknown interface")),
        (("--interface", "socketcand"), ("cannot open socketcand", "'host'", "can.conf")),
        (("--interface", "socketcan", "--channel", "none0"), ("cannot open socketcan none0",)),
        (("--interface", "legbench_unix", "--channel", "none.sock"), ("none.sock", "emulate")),
        (("--bus", "nowhere.toml"), ("nowhere.toml: no such file",)),
        (("--interface", "legbench", "--slew-rate", "5"), ("the drives decide",)),
        (("--interface", "legbench", "--limits", "none.toml"), ("none.toml: no such file",)),
    ],
)
def test_a_bus_that_is_not_there_is_named(
    flags: tuple[str, ...],
    words: tuple[str, ...],
    capfd: pytest.CaptureFixture[str],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.chdir(tmp_path)
    bus = () if "--bus" in flags else ("--bus", BUS)
    called(capfd, *JUMP, *bus, *flags, "--out", tmp_path / "runs").refused(*words)
    assert not (tmp_path / "runs").exists()


@pytest.mark.parametrize(
    ("wanted", "words"),
    [
        ((("serial = 1002", "serial = 1009"),), ("motor2", "serial", "expected")),
        ((("vendor = 0x0000_0123", "vendor = 0x99"),), ("motor1", "vendor", "0x99")),
        ((("id = 2", "id = 5"),), ("node 5", "does not answer", "bitrate")),
        (
            (("serial = 1001", "serial = 7"), ("1002", "1001"), ("serial = 7", "serial = 1002")),
            ("swapped",),
        ),
        ((("bitrate = 1_000_000", "bitrate = 250_000"),), ("250000 bit/s", "80 %")),
        ((('name = "motor1"', "nome = 1"),), ("unknown keys", "nome")),
        ((("id = 2", "id = 1"),), ("must differ",)),
    ],
)
def test_a_bus_file_that_does_not_fit_is_named(
    wanted: tuple[tuple[str, str], ...],
    words: tuple[str, ...],
    capfd: pytest.CaptureFixture[str],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    truth, real = load_bus(BUS), can_open.emulate

    def the_bench(_config: BusConfig, *rest: Any, **more: Any) -> Network:
        """The drives are those of the bench, whatever the file says."""
        return real(truth, *rest, **more)

    monkeypatch.setattr(can_open, "emulate", the_bench)
    where = ("--bus", changed(tmp_path, *wanted), "--interface", "legbench")
    called(capfd, *JUMP, *where, "--out", tmp_path / "runs").refused(*words)
    assert not (tmp_path / "runs").exists()


def test_limits_looser_than_the_design_are_refused(
    capfd: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    path = changed(tmp_path)
    (tmp_path / "limits.toml").write_text("motor_range = [[-3.0, 0.9], [-0.9, 1.1]]\n")
    done = called(capfd, *JUMP, "--bus", path, "--interface", "legbench", "--out", tmp_path / "r")
    done.refused("motor_range of axis 1", "looser", "[-2.2, 0.9] rad")


@pytest.mark.parametrize(
    "command",
    [
        JUMP[:-2],
        ("drives", "configure", "--write"),
        ("drives", "zero", "--posture", "0", "0"),
        ("drives", "home", "--node", "motor1"),
        ("drives", "jog", "--node", "motor1"),
        ("drives", "jitter"),
    ],
    ids=lambda command: command[1],
)
def test_a_second_master_is_refused_before_it_opens_anything(
    command: tuple[str, ...], capfd: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    # Nobody serves there: whoever opened it would say so.
    where = ("--interface", "legbench_unix", "--channel", str(tmp_path / "leg.sock"))
    first = ChannelLock.of_channel(where[1], where[3])
    first.acquire()
    done = called(capfd, *command, "--bus", BUS, *where, *DESIGN)
    first.release()
    done.refused("already has a master, process", "end that one first")


@pytest.mark.parametrize("command", ["scan", "status", "configure", "monitor"])
@pytest.mark.parametrize("interface", ["legbench_unix", "slcan"])
def test_a_reader_shares_a_channel_but_not_a_serial_adapter(
    interface: str, command: str, capfd: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    where = ("--interface", interface, "--channel", str(tmp_path / "leg"))
    first = ChannelLock.of_channel(interface, where[3])
    first.acquire()
    done = called(capfd, "drives", command, "--bus", BUS, *where, *DESIGN)
    first.release()
    done.refused("already has a master" if interface == "slcan" else "cannot open legbench_unix")


@pytest.mark.parametrize(
    "command",
    [
        ("run", "jump", "--plant", "can", "--duration", "0.05"),
        ("drives", "scan"),
        ("drives", "status"),
        ("drives", "configure"),
        ("drives", "jog", "--node", "motor1"),
    ],
    ids=lambda command: command[1],
)
def test_a_wrong_bitrate_is_named(
    command: tuple[str, ...],
    capfd: pytest.CaptureFixture[str],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.chdir(tmp_path)
    done = called(capfd, *command, *EMULATED, *DESIGN, "--bitrate", "900000")
    # The budget of a run finds out before the wire does.
    found = "the last answer may come 756 us after SYNC" if command[0] == "run" else "error frames"
    done.refused("900000 bit/s is asked for", "the bus file says 1000000 bit/s", found)
    assert list(tmp_path.iterdir()) == []


def test_a_bitrate_that_is_too_slow_is_refused_before_a_bus_is_opened(
    capfd: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    for command in (JUMP[:-2], ("drives", "budget")):
        done = called(capfd, *command, "--bus", BUS, *DESIGN, "--bitrate", "500000")
        assert done.status == 2
        assert "114 % of 500000 bit/s" in done.err
        assert "the bus file says 1000000 bit/s" in done.err
