"""Everything that a user may get wrong: one clear line, a status, no traceback, no litter."""

import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from commands import DESIGN, MODELS, Done, called, started_together

from legbench.cli import main
from legbench.recording.reader import load

TEXT = (MODELS / "table2.toml").read_text(encoding="utf-8")


@pytest.fixture(scope="module")
def run_folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("whole")
    assert main(["run", "jump", *DESIGN, "--duration", "1.5", "--out", str(out)]) == 0
    (run,) = out.iterdir()
    return run


@pytest.fixture
def no_screen(monkeypatch: pytest.MonkeyPatch) -> None:
    """Surroundings of a machine without a display."""
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("mass = 207", "mass = -207", ("[thigh] mass is -0.207 kg",)),
        ("length = 133", "length = 140", ("0.14 m", "0.133 m", "l2 = l1 + l3")),
        ("[thigh]", "[thigh", ("not valid TOML",)),
        ("mass = 637", "mass = 0.9", ("bars weigh 0.001302 kg", "reduced")),
        ("inertia = 70", "inertia = 1e-14", ("MuJoCo refuses", "'table2'")),
    ],
    ids=["negative mass", "lengths", "malformed", "light trunk", "tiny inertia"],
)
@pytest.mark.parametrize("command", ["run", "model"])
def test_a_design_that_no_leg_can_have(
    tmp_path: Path,
    capfd: pytest.CaptureFixture[str],
    command: str,
    old: str,
    new: str,
    words: tuple[str, ...],
) -> None:
    assert old in TEXT
    path = tmp_path / "leg.toml"
    path.write_text(TEXT.replace(old, new), encoding="utf-8")
    runs = tmp_path / "runs"
    kind = ("run", "jump", "--out", runs) if command == "run" else ("model", "--out", runs)
    called(capfd, *kind, "--design", path).refused(*words)
    assert not runs.exists()


def test_a_reader_that_has_gone(tmp_path: Path) -> None:
    reader, writer = os.pipe()
    os.close(reader)
    try:
        done = subprocess.run(
            [sys.executable, "-m", "legbench", "drives", "budget"],
            stdout=writer,
            stderr=subprocess.PIPE,
            cwd=tmp_path,
            timeout=300,
            check=False,
        )
    finally:
        os.close(writer)
    assert (done.returncode, done.stderr) == (141, b"")


def test_a_design_that_is_not_there(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    done = called(capfd, "run", "jump", "--design", tmp_path / "x.toml", "--out", tmp_path / "r")
    done.refused("x.toml: no such design file", "optimal, prototype, table2")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("jump", "--z2", "2.5"), ("set point z2 + dz2 = 2.65 rad", "0.3 to 2.9 rad")),
        (("jump", "--z2", "nan"), ("nan rad", "finite")),
        (("jump", "--dz2", "-1"), ("dz2 is -1 rad",)),
        (("jump", "--delay", "inf"), ("delay is inf s",)),
        (("jump", "--duration", "0"), ("duration is 0 s", "0.001 s")),
        (("jump", "--duration", "nan"), ("duration is nan s",)),
        (("jump", "--duration", "inf"), ("duration is inf s", "finite")),
        (("jump", "--duration", "-3"), ("duration is -3 s",)),
        (("jump", "--setup", "hfts"), ("jumping needs setup 'jump' or 'ffs'",)),
        (("jump", "--setup", "vfts"), ("jumping needs setup 'jump' or 'ffs'",)),
        (("jump", "--boom-radius", "1"), ("setup jump has no boom",)),
        (("jump", "--tip-radius", "inf"), ("tip_radius is inf m",)),
        (("jump", "--touchdown-load", "0.1"), ("release < touchdown < 1",)),
        (("bang-bang", "--threshold", "0.5"), ("threshold is 0.5 N m", "k dz2 = 0.184 N m")),
        (("bang-bang", "--sign", "2"), ("sign is 2; it must be 1 or -1",)),
        (("position-jump", "--dz2", "1.5"), ("set point z2 + dz2 = 2.5 rad",)),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, tuple) else None,
)
def test_a_setting_that_makes_no_sense(
    tmp_path: Path,
    capfd: pytest.CaptureFixture[str],
    arguments: tuple[str, ...],
    words: tuple[str, ...],
) -> None:
    runs = tmp_path / "runs"
    called(capfd, "run", *arguments, *DESIGN, "--out", runs, "--json").refused(*words)
    assert not runs.exists()


@pytest.mark.parametrize(
    ("flag", "value", "words"),
    [
        ("--slew-rate", "0", "servo slew_rate is 0 rad/s; it must be positive"),
        ("--bandwidth", "nan", "servo bandwidth is nan Hz; it must be positive"),
        ("--delay-cycles", "9999999999", "servo delay_cycles is 9999999999; it must be 0 to 1000"),
        ("--encoder-counts", "-4", "servo encoder_counts is -4 counts per revolution; it must be"),
    ],
)
def test_a_servo_that_makes_no_sense_is_wrong_usage(
    tmp_path: Path, capfd: pytest.CaptureFixture[str], flag: str, value: str, words: str
) -> None:
    runs = tmp_path / "runs"
    done = called(capfd, "run", "jump", *DESIGN, "--out", runs, flag, value)
    assert (done.status, done.out) == (2, "")
    text = " ".join(re.sub(r"[^\x20-\x7e]", " ", done.err).split())
    assert words in text
    assert "Traceback" not in text
    assert not runs.exists()


@pytest.mark.parametrize(
    "arguments",
    [
        ("run", "jump", "--setup", "moon"),
        ("run", "jump", "--linkage", "string"),
        ("run", "jump", "--duration", "long"),
        ("run", "jump", "--plant", "horse"),
        ("run", "walk"),
        ("run",),
        ("model", "--setup", "moon"),
        ("replay",),
        ("render",),
    ],
    ids=" ".join,
)
def test_flags_that_do_not_exist_are_wrong_usage(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capfd: pytest.CaptureFixture[str],
    arguments: tuple[str, ...],
) -> None:
    monkeypatch.chdir(tmp_path)
    done = called(capfd, *arguments)
    assert done.status == 2
    assert done.out == ""
    assert done.err
    assert "Traceback" not in done.err
    if "--setup" in arguments:
        assert "moon" in done.err
        assert "hfts" in done.err
    assert list(tmp_path.iterdir()) == []


def test_a_file_in_the_way_of_the_runs(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    way = tmp_path / "runs"
    way.write_text("here")
    called(capfd, "run", "jump", *DESIGN, "--out", way).refused(f"cannot write a run in {way}")
    called(capfd, "run", "jump", *DESIGN, "--out", way / "deeper").refused("cannot write a run in")
    called(capfd, "model", *DESIGN, "--out", way / "leg.xml").refused(f"cannot write {way}/leg.xml")
    called(capfd, "model", *DESIGN, "--out", tmp_path).refused(f"cannot write {tmp_path}")
    assert way.read_text() == "here"
    assert list(tmp_path.iterdir()) == [way]


def test_a_disk_that_fills_up(small_disk: Path, capfd: pytest.CaptureFixture[str]) -> None:
    done = called(capfd, "run", "jump", *DESIGN, "--out", small_disk, "--json")
    done.refused("No space left on device [ENOSPC]", "rows are safe on disk", "legbench recover")
    (run,) = small_disk.iterdir()
    rows = len(load(run).time)
    assert rows > 100
    again = called(capfd, "replay", run, "--json")
    assert again.status == 0
    assert json.loads(again.out)["duration"] == pytest.approx((rows - 1) / 1000)


def test_a_disk_that_is_full_from_the_start(
    small_disk: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    ballast = small_disk / "ballast"
    ballast.write_bytes(bytes(shutil.disk_usage(small_disk).free))
    done = called(capfd, "run", "jump", *DESIGN, "--out", small_disk / "runs")
    done.refused("No space left on device")
    model = called(capfd, "model", *DESIGN, "--out", small_disk / "leg.xml")
    model.refused("cannot write", "No space left on device")
    runs = small_disk / "runs"
    assert sorted(small_disk.rglob("*")) == [ballast, runs]


def test_a_run_that_is_not_there(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    for command in (("replay",), ("recover",), ("render",), ("export", "--csv")):
        called(capfd, *command, tmp_path / "none").refused(str(tmp_path / "none"))
        called(capfd, *command, tmp_path).refused(str(tmp_path))
    assert list(tmp_path.iterdir()) == []


def test_a_run_of_a_newer_format(
    run_folder: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    run = tmp_path / "newer"
    shutil.copytree(run_folder, run)
    manifest = json.loads((run / "run.json").read_text())
    manifest |= {"format": 99, "legbench": "9.9"}
    (run / "run.json").write_text(json.dumps(manifest))
    before = sorted((path.name, path.read_bytes()) for path in run.iterdir())
    for command in (("replay",), ("recover",), ("render",), ("export", "--csv")):
        called(capfd, *command, run).refused("format 99", "newer legbench (9.9)", "upgrade")
    assert sorted((path.name, path.read_bytes()) for path in run.iterdir()) == before


def test_a_run_whose_manifest_is_damaged(
    run_folder: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    run = tmp_path / "damaged"
    shutil.copytree(run_folder, run)
    (run / "run.json").write_text('{"format": 1, ')
    called(capfd, "replay", run).refused("run.json is damaged", "move it away")
    (run / "run.json").unlink()
    assert called(capfd, "replay", run).status == 0


@pytest.mark.usefixtures("no_screen")
def test_no_display_for_mujocos_viewer(capfd: pytest.CaptureFixture[str]) -> None:
    called(capfd, "model", *DESIGN, "--view").refused("no display", "--out FILE")


def of_a_whole_run(done: Done) -> str:
    """The complaint of a run that went on without its view."""
    assert done.status == 0
    assert done.err.count("\n") == 1
    assert json.loads(done.out)["status"] == "complete"
    return done.err


@pytest.mark.usefixtures("no_screen")
def test_no_display_is_no_reason_to_lose_a_run(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    words = ("run", "jump", *DESIGN, "--duration", "0.1", "--out", tmp_path, "--view", "--json")
    said = of_a_whole_run(called(capfd, *words))
    assert said.startswith("legbench: no display: the run goes on unseen")


def test_extras_that_are_not_installed(run_folder: Path, tmp_path: Path) -> None:
    """A run goes on without rerun; who asks for a file that needs an extra is told its name."""
    view, *files, report = started_together(
        [
            ("run", "jump", *DESIGN, "--duration", "0.1", "--out", "runs", "--view", "--json"),
            ("replay", run_folder, "--rrd", "view.rrd"),
            ("replay", run_folder, "--figure", "phase.png"),
            ("report", "nowhere"),
        ],
        before="sys.modules.update(dict.fromkeys(['rerun', 'matplotlib', 'jinja2']))",
        cwd=tmp_path,
    )
    said = of_a_whole_run(view)
    assert "rerun is not installed" in said
    assert "legbench[viz]" in said
    for done, missing in zip(files, ("rerun", "matplotlib"), strict=True):
        assert done.status == 1
        assert f"legbench: {missing} is not installed" in done.err
        assert "legbench[viz]" in done.err
        assert done.err.count("\n") == 1
    assert report.status == 1
    assert report.err.startswith("legbench: jinja2 is not installed; a report needs it: ")
    assert "pip install 'legbench[report]'" in report.err
    assert report.err.count("\n") == 1
    assert list(tmp_path.iterdir()) == [tmp_path / "runs"]
