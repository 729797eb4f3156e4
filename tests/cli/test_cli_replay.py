"""`legbench replay` lets a run happen again, plays parts of it, and reads logs of a bus."""

import json
import shutil
from pathlib import Path

import pytest
from commands import DESIGN, called

from legbench.cli import main
from legbench.recording.layout import RUN

BUS = Path(__file__).parents[2] / "hardware" / "leg.toml"
OTHER = DESIGN[1].replace("prototype", "optimal")


@pytest.fixture(scope="module")
def jump(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A jump of 0.4 s in the simulation."""
    return _recorded(tmp_path_factory.mktemp("runs"), "--duration", "0.4")


@pytest.fixture(scope="module")
def drives(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A leg on emulated drives for 0.3 s."""
    bench = ("--plant", "can", "--bus", str(BUS), "--interface", "legbench", "--end", "stop")
    return _recorded(tmp_path_factory.mktemp("runs"), "--duration", "0.3", *bench)


def _recorded(folder: Path, *flags: str) -> Path:
    assert main(["run", "jump", *DESIGN, "--out", str(folder), "--json", *flags]) == 0
    (run,) = folder.iterdir()
    return run


def replayed(capfd: pytest.CaptureFixture[str], *arguments: str | Path) -> dict[str, object]:
    done = called(capfd, "replay", *arguments, "--json")
    assert done.status == 0, done.err
    return json.loads(done.out)["replay"]


def test_a_controller_is_replayed_to_the_bit(
    jump: Path, drives: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    for run, rows in ((jump, 400), (drives, 300)):
        found = replayed(capfd, run, "--controller")
        assert (found["identical"], found["rows"], found["first"]) == (True, rows, None)
    done = called(capfd, "replay", jump, "--controller")
    assert "identical         in all 400 rows, to the bit" in done.out


def test_a_recorded_controller_that_differs_is_status_1(
    jump: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    """As a version does whose law has changed."""
    run = tmp_path / "run"
    shutil.copytree(jump, run)
    manifest = json.loads((run / RUN).read_text())
    manifest["experiment"]["controller"]["settings"]["delay"] = 0.15
    (run / RUN).write_text(json.dumps(manifest))
    done = called(capfd, "replay", run, "--controller")
    assert done.status == 1
    assert "first in cycle 100, t = 0.1 s: command_pos_1 was -0.1" in done.out


def test_an_edited_controller_is_drawn_over_the_recorded_one(
    jump: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    figure = tmp_path / "edited.png"
    edit = ("--set", "controller.settings.dz2=0.07")
    done = called(capfd, "replay", jump, "--controller", *edit, "--figure", figure)
    assert done.status == 0
    assert "controller jump, with controller.settings.dz2 = 0.07" in done.out
    assert "differs           first in cycle 0" in done.out
    assert figure.stat().st_size > 10_000


def test_a_leg_is_resimulated(
    jump: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    for source in ("commands", "motors"):
        assert replayed(capfd, jump, "--resimulate", source)["identical"] is True
    found = replayed(
        capfd,
        *(jump, "--resimulate", "commands", "--design", OTHER, "--beyond", "0.02"),
        *("--figure", tmp_path / "both.svg", "--rrd", tmp_path / "both.rrd"),
    )
    assert (found["edited"], found["what"]) == (True, "commands into sim / optimal")
    assert found["signals"]["joint_pos_1"]["first_cycle"] == 0  # type: ignore[index]
    assert {each.name for each in tmp_path.iterdir()} == {"both.svg", "both.rrd"}


def test_a_log_is_rated_drawn_and_resimulated(
    drives: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    log = tmp_path / "can0.log"
    shutil.copy(drives / "bus.log", log)
    bus = ("--bus", BUS, *DESIGN, "--setup", "jump")
    done = called(capfd, "replay", log, *bus, "--figure", tmp_path / "log.png", "--json")
    assert done.status == 0, done.err
    assert "the log begins after motor1 and motor2 had been configured" in done.err
    assert json.loads(done.out)["controller"] == "unknown"
    assert (tmp_path / "log.png").is_file()
    part = ("--from", "0.1", "--to", "0.3", "--rrd", tmp_path / "part.rrd")
    done = called(capfd, "replay", log, *bus, *part)
    assert done.status == 0, done.err
    assert "duration          0.2 s" in done.out
    found = replayed(capfd, log, *bus, "--resimulate", "motors")
    assert found["what"] == "motors into sim / prototype"
    # In its own run folder it knows leg and setup.
    assert json.loads(called(capfd, "replay", drives / "bus.log", "--bus", BUS, "--json").out)


@pytest.mark.parametrize(
    ("flags", "words"),
    [
        (["--set", "a=1"], ["--set changes what is replayed"]),
        (["--plant", "sim"], ["--plant is what moves the leg"]),
        (["--design", OTHER], ["--design is another leg to move"]),
        (["--setup", "ffs"], ["--setup belongs to a log"]),
        (["--bus", str(BUS)], ["--bus describes the drives of a log", "is a folder"]),
        (["--controller", "--resimulate", "motors"], ["two replays; ask for one"]),
        (["--speed", "0.5"], ["say how a run is played; add --view"]),
        (["--rrd", "x.rrd", "--from", "9"], ["nothing lies from 9", "lasts from 0 to 0.399 s"]),
        (["--rrd", "x.rrd", "--speed", "0"], ["speed is 0; it must be 0.001"]),
        (["--controller", "--figure", "x.bmp"], ["cannot be written as 'x.bmp'", ".svg"]),
        (["--resimulate", "motors", "--beyond", "-1"], ["beyond is -1; it must be 0 or more"]),
        (["--controller", "--set", "servo.bandwidth=9"], ["this replay has controller, conv"]),
    ],
    ids=lambda each: " ".join(each) if isinstance(each, list) else None,
)
def test_flags_that_mean_nothing_together_are_refused(
    flags: list[str], words: list[str], jump: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    done = called(capfd, "replay", jump, *flags, "--json")
    assert done.status == 2
    assert done.err.count("\n") == 1, done.err
    assert all(word in done.err for word in words), done.err
    assert not Path("x.rrd").exists()


def test_a_log_needs_a_bus_file(
    drives: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    called(capfd, "replay", drives / "bus.log").refused("is a log of raw frames; add --bus FILE")
    called(capfd, "replay", drives / "leg.xml").refused("is a file, no run folder")
    called(capfd, "replay", tmp_path / "gone.log", "--bus", BUS).refused("gone.log does not exist")
    called(capfd, "replay", tmp_path / "gone.log").refused("does not exist")
    called(capfd, "replay", drives / "bus.log", "--bus", "no.toml").refused("no.toml", "no such")
