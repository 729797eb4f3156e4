import hashlib
import json
import math
import sys
from pathlib import Path

import mujoco
import pytest
from commands import DESIGN, MODELS, called, started

from legbench import __version__
from legbench.cli import COMMANDS, main
from legbench.cli.output import print_json, write_json
from legbench.errors import ConfigError
from legbench.recording.reader import load

PROMISED = {
    "run",
    "jumps",
    "rating_stance",
    "rating_flight",
    "rating_periods",
    "trunk_excursion",
    "foot_clearance",
    "drift",
    "hop_freq",
    "polar_max",
    "loop_gap_max",
    "energy_residual",
    "duration",
    "real_time_factor",
}
HEAVY = ("numpy", "mujoco", "tyro", "pyarrow", "scipy", "rerun", "matplotlib")


@pytest.fixture(scope="module")
def run_folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("cli")
    assert main(["run", "jump", *DESIGN, "--duration", "2", "--out", str(out)]) == 0
    (run,) = out.iterdir()
    return run


def test_help_loads_nothing_heavy_and_lists_every_command(tmp_path: Path) -> None:
    """It shows at once."""
    code = (
        f"import atexit; atexit.register(lambda: print([m for m in {HEAVY} if m in sys.modules]))"
    )
    done = started("--help", before=code, cwd=tmp_path)
    assert done.status == 0
    assert done.err == ""
    *text, loaded = done.out.splitlines()
    assert loaded == "[]"
    for command, summary in COMMANDS.items():
        assert any(command in line and summary in line for line in text)


def test_no_command_a_wrong_one_and_the_version(capfd: pytest.CaptureFixture[str]) -> None:
    assert called(capfd).status == 2
    wrong = called(capfd, "jump")
    assert wrong.status == 2
    assert wrong.err == f"legbench: no command 'jump'; there are {', '.join(COMMANDS)}\n"
    assert called(capfd, "--version").out == f"legbench {__version__}\n"


@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_explains_itself(command: str, capfd: pytest.CaptureFixture[str]) -> None:
    done = called(capfd, command, "--help")
    assert done.status == 0
    assert f"legbench {command}" in done.out
    assert "--json" in done.out


@pytest.mark.parametrize("controller", ["jump", "bang-bang", "position-jump"])
def test_help_gives_units(controller: str, capfd: pytest.CaptureFixture[str]) -> None:
    text = called(capfd, "run", controller, "--help").out
    assert "[rad]" in text
    assert "[s]" in text
    assert "[rad/s]" in text


@pytest.mark.parametrize(
    ("controller", "setup", "linkage"),
    [("jump", None, "bars"), ("bang-bang", None, "reduced"), ("position-jump", "vfts", "bars")],
)
def test_run_prints_exactly_one_json_object(
    tmp_path: Path,
    capfd: pytest.CaptureFixture[str],
    controller: str,
    setup: str | None,
    linkage: str,
) -> None:
    chosen = ["--setup", setup] if setup else []
    done = called(
        capfd,
        *("run", controller, *DESIGN, *chosen, "--linkage", linkage),
        *("--duration", "0.5", "--out", tmp_path, "--json"),
    )
    assert done.status == 0
    assert done.err == ""
    assert done.out.count("\n") == 1
    summary = json.loads(done.out)
    assert summary.keys() >= PROMISED
    assert summary["controller"] == controller
    assert summary["setup"] == setup or ("jump" if controller == "jump" else "ffs")
    assert summary["duration"] == pytest.approx(0.499)
    assert summary["loop_gap_max"] < 2e-5
    assert load(Path(summary["run"])).complete


def test_run_without_json_is_for_people(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    done = called(capfd, "run", "jump", *DESIGN, "--duration", "0.2", "--out", tmp_path)
    assert done.status == 0
    assert "ended             complete" in done.out
    assert "{" not in done.out


def test_settings_reach_the_run(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    done = called(
        capfd,
        *("run", "bang-bang", *DESIGN, "--z2", "0.9", "--three-levels", "--sign", "-1"),
        *("--setup", "ffs", "--boom-radius", "1.5", "--slew-rate", "7", "--delay-cycles", "2"),
        *("--setpoint", "motor", "--z2", "0.6", "--convention", "literal", "--dz2", "0.05"),
        *("--duration", "0.15", "--out", tmp_path, "--json"),
    )
    assert done.status == 0, done.err
    manifest = load(Path(json.loads(done.out)["run"])).description.experiment
    assert manifest["controller"]["settings"]["three_levels"] is True
    assert manifest["controller"]["settings"]["sign"] == -1
    assert manifest["controller"]["settings"]["z2"] == 0.6
    assert manifest["setup"]["boom_radius"] == 1.5
    assert manifest["servo"]["slew_rate"] == 7.0
    assert manifest["servo"]["delay_cycles"] == 2
    assert manifest["conventions"]["setpoint"] == "motor"
    assert manifest["conventions"]["modal"] == "literal"


def test_replay_rates_again_what_run_rated(
    run_folder: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    done = called(capfd, "replay", run_folder, "--json")
    assert done.status == 0
    assert done.err == ""
    summary = json.loads(done.out)
    assert summary.keys() >= PROMISED
    assert summary["rating_stance"]
    assert summary["rating_flight"]
    assert "P^r stance" in called(capfd, "replay", run_folder).out


def test_a_run_whose_numerics_are_unsound_says_so(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    """Loop closures of 5 ms, a habit of other models, dissipate; the run ends all the same."""
    words = (
        "run",
        "position-jump",
        *DESIGN,
        "--setup",
        "ffs",
        "--duration",
        "1",
        "--out",
        tmp_path,
    )
    told = {}
    for kind, settings in (
        ("sound", ()),
        ("unsound", ("--set", "numerics.loop_solref=[0.005, 1.0]")),
    ):
        done = called(capfd, *words, *settings, "--json")
        told[kind] = json.loads(done.out)
        assert (done.status, told[kind]["status"]) == (0, "complete")
        assert told[kind]["numerics"] == kind
        assert ("unsound" in done.err) is (kind == "unsound")
    assert told["sound"]["warnings"] == []
    energy, gap = told["unsound"]["warnings"]
    assert energy.startswith("the numerics made or lost")
    assert "um; up to 20 um" in gap
    table = called(capfd, "replay", told["unsound"]["run"]).out
    assert "complete, but its numerics are unsound" in table
    assert energy in table


def test_a_fixed_setup_is_rated_about_both_references(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    """Gravity's sag hides all else about the motor; about the equilibrium the rating decays."""
    words = ("run", "position-jump", "--design", MODELS / "prototype.toml", "--setup", "ffs")
    done = called(capfd, *words, "--duration", "3", "--out", tmp_path, "--json")
    told = json.loads(done.out)
    assert told["rating_reference"] == "equilibrium"
    assert told["rating_periods"] == told["rating_periods_equilibrium"]
    assert len(told["rating_periods"]) == len(told["rating_periods_motor"]) >= 4
    assert min(told["rating_periods_motor"]) > 0.9999
    assert told["rating_periods"][-1] < 0.995
    lines = called(capfd, "replay", told["run"]).out.splitlines()
    first, second = (line for line in lines if line.startswith("P^r periods"))
    assert first.endswith("about the equilibrium")
    assert second.endswith("about the motor")
    assert "1.0000 " not in second


def test_a_torn_run_is_replayed_as_far_as_it_goes_and_recovered(
    run_folder: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    """What a kill leaves: the stream without its end, the manifest still "running"."""
    torn = tmp_path / "torn"
    torn.mkdir()
    killed = started(
        *("run", "jump", *DESIGN, "--duration", "2", "--out", tmp_path / "runs"),
        before=KILLED,
        cwd=tmp_path,
    )
    assert killed.status == -9
    (run,) = (tmp_path / "runs").iterdir()
    done = called(capfd, "replay", run, "--json")
    assert done.status == 0
    assert done.err.startswith(f"legbench: {run} is torn")
    assert done.err.count("\n") == 1
    summary = json.loads(done.out)
    assert 0.8 < summary["duration"] < 1.0
    mended = called(capfd, "recover", run, "--json")
    assert mended.status == 0
    report = json.loads(mended.out)
    assert report["changed"] is True
    assert report["status"] == "recovered"
    assert report["run"] == str(run)
    again = called(capfd, "recover", run)
    assert again.status == 0
    assert "nothing to recover" in again.out
    after = json.loads(called(capfd, "replay", run, "--json").out)
    assert after["duration"] == summary["duration"]
    assert after["rating_stance"] == summary["rating_stance"]


KILLED = """
import os, signal, time
from pathlib import Path
from legbench.plant.sim import SimPlant
from legbench.recording.stream import WholeBatches
def on_disk():
    (path,) = Path("runs").glob("*/samples.arrows")
    stream = WholeBatches(path)
    return sum(batch.num_rows for batch in stream)
step = SimPlant.step
def dying(plant, command):
    seen = step(plant, command)
    if seen.time >= 1.0:
        # The thread that records has its own time, on a busy machine a long one.
        while on_disk() < 900:
            time.sleep(0.01)
        os.kill(os.getpid(), signal.SIGKILL)
    return seen
SimPlant.step = dying
"""


def test_model_writes_what_runs(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    text = called(capfd, "model", *DESIGN, "--setup", "vfts", "--linkage", "reduced").out
    mujoco.MjModel.from_xml_string(text)
    target = tmp_path / "leg.xml"
    done = called(
        capfd,
        *("model", *DESIGN, "--setup", "vfts", "--linkage", "reduced"),
        *("--out", target, "--json"),
    )
    assert done.status == 0
    assert json.loads(done.out) == {
        "out": str(target),
        "mjcf_sha256": hashlib.sha256(target.read_bytes()).hexdigest(),
    }
    assert target.read_text(encoding="utf-8") == text


def test_model_goes_through_a_pipe_that_closes_early(
    monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(sys, "stdout", None)
    assert "Traceback" not in called(capfd, "model", *DESIGN).err


def test_an_interrupt_outside_of_a_run_is_no_traceback(
    run_folder: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    def interrupted(path: Path) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("legbench.cli.replay_source.load", interrupted)
    done = called(capfd, "replay", run_folder)
    assert (done.status, done.err) == (130, "legbench: interrupted\n")


def test_numbers_that_json_lacks_are_null(capfd: pytest.CaptureFixture[str]) -> None:
    print_json({"a": math.nan, "b": [1.0, math.inf], "c": {"d": (-math.inf, 2)}, "e": "nan"})
    told = json.loads(capfd.readouterr().out)
    assert told == {"a": None, "b": [1.0, None], "c": {"d": [None, 2]}, "e": "nan"}


def test_a_json_file_is_whole_or_what_it_was(tmp_path: Path) -> None:
    target = tmp_path / "deep" / "found.json"
    write_json(target, {"a": math.nan})
    assert json.loads(target.read_text()) == {"a": None}
    with pytest.raises(TypeError):
        write_json(target, {"a": object()})
    assert json.loads(target.read_text()) == {"a": None}
    assert [path.name for path in target.parent.iterdir()] == ["found.json"]
    with pytest.raises(ConfigError, match="cannot write"):
        write_json(target / "below.json", {})
