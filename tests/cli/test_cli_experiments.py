"""`legbench run` with an experiment file, `--set`, `--again` and classes of one's own."""

import json
import re
import shutil
from pathlib import Path

import pytest
from commands import DESIGN, MODELS, Done, called

from legbench.recording.reader import load

GUESTS = Path(__file__).parents[1] / "control" / "guests"
OLD = Path(__file__).parents[1] / "recording" / "format_1" / "bang-bang"
"""A run of the first format."""
SINE = f"{GUESTS / 'sine.py'}:Sine"
FILE = """
format = 1
design = "leg.toml"
duration = 0.2

[controller]
kind = "bang-bang"

[controller.settings]
z2 = 0.9
dz2 = 0.06

[setup]
kind = "ffs"
boom_radius = 1.5

[servo]
slew_rate = 30.0
"""


@pytest.fixture
def file(tmp_path: Path) -> Path:
    (tmp_path / "leg.toml").write_bytes((MODELS / "table2.toml").read_bytes())
    path = tmp_path / "swing.toml"
    path.write_text(FILE, encoding="utf-8")
    return path


def ran(done: Done) -> dict[str, object]:
    assert done.status == 0, done.err
    return load(Path(json.loads(done.out)["run"])).manifest["experiment"]


def entry(tables: object, key: str) -> object:
    for name in key.split("."):
        assert isinstance(tables, dict)
        tables = tables.get(name)
    return tables


def test_a_file_decides_a_run(
    file: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    tables = ran(called(capfd, "run", file, "--out", tmp_path / "runs", "--json"))
    assert entry(tables, "design.name") == "table2"
    assert entry(tables, "design.thigh.mass") == 0.207
    assert entry(tables, "controller.settings.dz2") == 0.06
    assert entry(tables, "setup") == {"kind": "ffs", "boom_radius": 1.5}
    assert entry(tables, "servo.slew_rate") == 30.0
    assert entry(tables, "duration") == 0.2


def test_flags_come_after_settings_and_settings_after_the_file(
    file: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    tables = ran(
        called(
            capfd,
            *("run", file, "--out", tmp_path / "runs", "--json", "--dz2", "0.07", "--seed", "3"),
            *("--set", "controller.settings.dz2=0.05", "--set=controller.settings.z2 = 0.95"),
            *(
                "--set",
                "design.springs.stiffness=[2.5, 2.3]",
                "--set",
                "design.thigh.mass=210",
                "--set",
                "setup.kind=vfts",
            ),
            *("--set", "conventions.rating_reference=equilibrium"),
        )
    )
    assert entry(tables, "controller.settings.dz2") == 0.07
    assert entry(tables, "controller.settings.z2") == 0.95
    assert entry(tables, "design.springs.stiffness") == [2.5, 2.3]
    assert entry(tables, "design.thigh.mass") == 0.21  # in the file's unit, which is g
    assert entry(tables, "setup") == {"kind": "vfts"}
    assert entry(tables, "conventions.rating_reference") == "equilibrium"
    assert entry(tables, "seed") == 3


def test_a_new_kind_takes_no_settings_of_the_old_one(
    file: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    out = ("--out", tmp_path / "runs", "--json")
    tables = ran(called(capfd, "run", file, *out, "--set", "controller.kind=position-jump"))
    assert entry(tables, "controller") == {
        "kind": "position-jump",
        "settings": {"z2": 1.0, "dz2": 0.3, "delay": 0.1},
    }
    tables = ran(called(capfd, "run", file, *out, "--setup", "hfts"))
    assert entry(tables, "setup") == {"kind": "hfts"}


def test_a_run_is_run_again(file: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    out = ("--out", tmp_path / "runs", "--json")
    first = json.loads(called(capfd, "run", file, *out).out)["run"]
    file.unlink()
    second = json.loads(called(capfd, "run", "--again", first, *out).out)["run"]
    one, two = load(Path(first)), load(Path(second))
    assert one.manifest["experiment"] == two.manifest["experiment"]
    for column, values in one.columns.items():
        if column not in ("cycle_us", "late_us"):
            assert values.tobytes() == two.columns[column].tobytes(), column
    other = ran(called(capfd, "run", "--again", first, *out, "--duration", "0.1"))
    assert entry(other, "duration") == 0.1


def test_a_class_of_ones_own_has_flags_and_help(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    text = " ".join(re.sub(r"[^\x20-\x7e]", " ", called(capfd, "run", SINE, "--help").out).split())
    assert "--freq FLOAT Frequency of the swing [Hz]. (default: 2.0)" in text
    out = ("--out", tmp_path / "runs", "--json", "--duration", "0.2")
    done = called(capfd, "run", SINE, *DESIGN, "--freq", "3", *out)
    assert entry(ran(done), "controller") == {
        "kind": "controller_sine.py:Sine",
        "settings": {"freq": 3.0},
    }
    again = called(capfd, "run", "--again", json.loads(done.out)["run"], *out, "--freq", "4")
    assert entry(ran(again), "controller.settings") == {"freq": 4.0}


def test_a_guests_flag_that_is_taken_keeps_its_prefix(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    wrong = f"{GUESTS / 'wrong.py'}:Wrong"
    out = ("--out", tmp_path / "runs", "--json", "--duration", "0.01")
    tables = ran(called(capfd, "run", wrong, *DESIGN, *out, "--controller.duration", "7"))
    assert entry(tables, "controller.settings.duration") == 7.0
    assert entry(tables, "duration") == 0.01


# --- what may be wrong -----------------------------------------------------------------------


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("dz2 = 0.06", "dz = 0.06", ("controller.settings.dz: unknown key; did you mean 'dz2'?",)),
        ("duration =", "duraton =", ("duraton: unknown key; did you mean 'duration'?",)),
        (
            "dz2 = 0.06",
            'dz2 = "0.06"',
            ("settings.dz2: is '0.06'; it must be a number",),
        ),
        ("dz2 = 0.06", "dz2 = true", ("controller.settings.dz2: is True; it must be a number",)),
        (
            "slew_rate = 30.0",
            "delay_cycles = 1.0",
            ("servo.delay_cycles: is 1.0; it must be a",),
        ),
        ("slew_rate = 30.0", "slew_rate = 0", ("servo: servo slew_rate is 0 rad/s; it must be",)),
        ('kind = "ffs"', 'kind = "moon"', ("setup.kind: is 'moon'; known are hfts, vfts, ffs",)),
        ("bang-bang", "bang", ("no controller 'bang'; there are jump, bang-bang",)),
        ("format = 1", "format = 3", ("format 3 was written by a newer legbench", "upgrade")),
        ("leg.toml", "log.toml", ("design: ", "log.toml: no such design file")),
        ("[setup]", "[setup", ("not valid TOML",)),
    ],
    ids=lambda value: value if isinstance(value, str) else None,
)
def test_a_file_that_makes_no_sense_is_refused(
    file: Path,
    tmp_path: Path,
    capfd: pytest.CaptureFixture[str],
    old: str,
    new: str,
    words: tuple[str, ...],
) -> None:
    assert old in FILE
    file.write_text(FILE.replace(old, new), encoding="utf-8")
    done = called(capfd, "run", file, "--out", tmp_path / "runs", "--json")
    assert (done.status, done.out, done.err.count("\n")) == (2, "", 1)
    for word in words:
        assert word in done.err
    assert not (tmp_path / "runs").exists()


def test_everything_that_is_wrong_is_told_at_once(
    file: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    text = FILE.replace("z2 = 0.9\ndz2", "z2 = false\ndz").replace("1.5", '"far"')
    file.write_text(text.replace("duration = 0.2", "duration = [1]"), encoding="utf-8")
    called(capfd, "run", file).refused(
        "duration: is [1]; it must be a number",
        "controller.settings.z2: is False",
        "controller.settings.dz: unknown key",
        "setup.boom_radius: is 'far'",
    )


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('mass = "g"', 'mass = "lb"', ("[units] mass is 'lb'; known are 'kg', 'g'",)),
        ("stiffness =", "stifness =", ("design.springs.stifness: unknown key; did you mean 'sti",)),
        ("[springs]", "[sprung]", ("design.sprung: unknown key; did you mean 'springs'?",)),
    ],
)
def test_a_design_inside_an_experiment_is_as_strict(
    file: Path, capfd: pytest.CaptureFixture[str], old: str, new: str, words: tuple[str, ...]
) -> None:
    design = (MODELS / "table2.toml").read_text(encoding="utf-8")
    assert old in design
    lines = re.sub(r"^\[", "[design.", design.replace(old, new), flags=re.MULTILINE)
    inline = re.sub(r'^name = "', 'design.name = "', lines, flags=re.MULTILINE)
    file.write_text(inline.split("[design.")[0] + FILE.replace('design = "leg.toml"', ""))
    with file.open("a", encoding="utf-8") as end:
        end.write("\n[design." + inline.split("[design.", 1)[1])
    called(capfd, "run", file).refused(*words)


@pytest.mark.parametrize(
    ("arguments", "status", "words"),
    [
        ((), 2, "run what? jump, bang-bang, position-jump, chirp, path/to/mine.py:Class"),
        (
            ("walk",),
            2,
            "no controller 'walk'; there are jump, bang-bang, position-jump, chirp, or a class",
        ),
        (("jump", "--plant", "horse"), 2, "no plant 'horse'; there are sim, analytic, can"),
        (("nowhere.toml",), 2, "nowhere.toml: no such experiment file"),
        (("--again", "nowhere"), 1, "nowhere is no run folder: it has no run.json"),
        (("jump", "--again", "nowhere"), 2, "--again runs its own experiment; leave 'jump' out"),
        (("jump", "--set", "seed"), 2, "--set seed: write dotted.key=value"),
        (("jump", "--set", "seed=[1"), 2, "--set seed: '[1' is no value"),
        (("jump", "--set", "seed.x.y=1"), 2, "seed: is {'x': {'y': 1}}; it must be a whole number"),
        (("jump", "--set", "seed=-1"), 2, "seed is -1; it must be 0 to"),
        (("jump", "--channel", "can0"), 2, "channel: settings of plant can; plant sim has none"),
        ((f"{GUESTS / 'impostors.py'}:NoBuild",), 2, "is no controller: it lacks build(targets)"),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, tuple) else None,
)
def test_a_command_line_that_makes_no_sense_is_refused(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capfd: pytest.CaptureFixture[str],
    arguments: tuple[str, ...],
    status: int,
    words: str,
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "models").symlink_to(MODELS)
    done = called(capfd, "run", *arguments)
    assert (done.status, done.out) == (status, "")
    assert done.err.startswith("legbench: ")
    assert done.err.count("\n") == 1
    assert words in done.err
    assert [path.name for path in tmp_path.iterdir()] == ["models"]


def test_a_file_that_does_not_import_shows_its_own_lines(
    capfd: pytest.CaptureFixture[str],
) -> None:
    done = called(capfd, "run", f"{GUESTS / 'broken.py'}:Mine")
    assert done.status == 2
    assert "broken.py does not import:" in done.err
    assert "LENGTH = half()" in done.err
    assert "no_such_name" in done.err.splitlines()[-1]
    assert "legbench/guests.py" not in done.err


def test_a_run_from_before_experiments_were_recorded_whole(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    run = tmp_path / "old"
    shutil.copytree(OLD, run)
    called(capfd, "run", "--again", run).refused("before runs held their whole experiment")
    assert called(capfd, "replay", run).status == 0


def test_imperfections_by_file_set_and_flag(
    file: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    file.write_text(FILE + "\n[imperfections]\nlink_zero = [0.01, -0.02]\n", encoding="utf-8")
    words = ["run", str(file), "--json", "--out", str(tmp_path / "runs"), "--duration", "0.02"]
    setting = "imperfections.stiffness_error=[0.04, 0]"
    flags = ["--motor-zero", "0.02", "-0.01", "--backlash", "0", "0.01"]
    tables = ran(called(capfd, *words, "--set", setting, *flags))
    assert entry(tables, "imperfections") == {
        "stiffness_error": [0.04, 0.0],
        "backlash": [0.0, 0.01],
        "link_zero": [0.01, -0.02],
        "motor_zero": [0.02, -0.01],
    }


def test_an_imperfection_that_is_none_is_wrong_usage(
    file: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    done = called(capfd, "run", str(file), "--out", str(tmp_path), "--backlash", "-1", "0")
    assert (done.status, done.out) == (2, "")
    assert done.err == "legbench: backlash is (-1.0, 0.0) rad; it must be 0 or more\n"
    done = called(capfd, "run", str(file), "--out", str(tmp_path), "--set", "imperfections.zero=1")
    assert done.status == 2
    assert "imperfections.zero: unknown key; did you mean 'link_zero'? known are" in done.err
