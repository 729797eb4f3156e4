"""A controller from a file of 25 lines, from the command line to every picture, on every plant."""

import json
from pathlib import Path

import numpy as np
import pytest
import viz_rrd

from legbench.cli import main
from legbench.recording.reader import Recording, load
from legbench.viz.print.figures import phase_figure

ROOT = Path(__file__).parents[2]
OWN = ROOT / "scripts" / "examples" / "own_controller.py"
LEG = ("--design", str(ROOT / "models" / "prototype.toml"))
BUS = str(ROOT / "hardware" / "leg.toml")
EMULATED = ("can", "--interface", "legbench", "--end", "stop", "--bus", BUS)


def ran(
    file: Path, plant: tuple[str, ...], out: Path, capfd: pytest.CaptureFixture[str], seconds: str
) -> tuple[int, dict[str, object], str]:
    """Exit status, the JSON on stdout and the words on stderr of a run of `Pump` in a file."""
    words = ("run", f"{file}:Pump", *LEG, "--plant", *plant, "--duration", seconds)
    status = main([*words, "--out", str(out), "--json"])
    seen = capfd.readouterr()
    return status, json.loads(seen.out), seen.err


@pytest.mark.parametrize(
    "plant",
    [("sim",), *(pytest.param(p, marks=pytest.mark.long) for p in (("analytic",), EMULATED))],
    ids=lambda plant: plant[0],
)
def test_it_runs_is_rated_and_its_signal_is_recorded_and_plotted(
    plant: tuple[str, ...], tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    status, told, errors = ran(OWN, plant, tmp_path, capfd, "1.5")
    assert status == 0, errors
    ratings = told["rating_periods"]
    assert isinstance(ratings, list)
    assert len(ratings) >= 2
    assert min(ratings) > 0.99
    run = load(Path(str(told["run"])))
    np.testing.assert_array_equal(run["fold_rate"], run["joint_vel"] @ [-0.5, 0.5])
    np.testing.assert_array_equal(run["phase"], (run.time >= 0.1).astype(int))
    replayed_and_drawn(run, ratings, capfd)


def replayed_and_drawn(
    run: Recording, ratings: list[float], capfd: pytest.CaptureFixture[str]
) -> None:
    """The run is rated again as before; its figure and its series show what was recorded."""
    figure, rrd = run.path / "phase.svg", run.path / "view.rrd"
    words = ("replay", str(run.path), "--json", "--figure", str(figure), "--rrd", str(rrd))
    assert main(list(words)) == 0
    assert json.loads(capfd.readouterr().out)["rating_periods"] == ratings
    assert figure.read_text(encoding="utf-8").startswith("<?xml")
    drawn = phase_figure(run)
    assert "pump" in drawn.get_suptitle()
    own = drawn.axes[3]
    assert own.get_title(loc="left") == "(d) fold_rate: half the rate at which the knee folds"
    assert own.get_ylabel() == "fold_rate [rad/s]"
    np.testing.assert_array_equal(own.get_lines()[0].get_ydata(), run["fold_rate"])
    shown = viz_rrd.temporal(rrd)
    np.testing.assert_allclose(
        np.ravel(shown["/series/own/fold_rate"]["scalars"]), run["fold_rate"]
    )
    assert {state[0] for state in shown["/states/controller"]["state"]} == {"kick", "pump"}


def test_it_runs_again_to_the_same_rows_and_is_filmed(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    status, told, errors = ran(OWN, ("sim",), tmp_path / "first", capfd, "0.4")
    assert status == 0, errors
    first = Path(str(told["run"]))
    words = ("run", "--again", str(first), "--out", str(tmp_path / "second"), "--json")
    assert main(list(words)) == 0
    again = load(Path(json.loads(capfd.readouterr().out)["run"]))
    run = load(first)
    assert set(run.columns) == set(again.columns)
    for name in set(run.columns) - {"cycle_us", "late_us"}:
        np.testing.assert_array_equal(run.columns[name], again.columns[name], err_msg=name)
    film = tmp_path / "leg.gif"
    assert main(["render", str(first), "--out", str(film)]) == 0
    assert film.read_bytes()[:6] == b"GIF89a"
    still = tmp_path / "leg.png"
    assert main(["render", str(first), "--out", str(still), "--time", "0.2"]) == 0
    assert still.read_bytes()[:4] == b"\x89PNG"


GOOD = "        return Command("
WRONG = {
    "raises": (
        'raise ZeroDivisionError("the swing broke")',
        "ZeroDivisionError: the swing broke\n",
        'in step: raise ZeroDivisionError("the swing broke")',
    ),
    "nan": ("motor_pos = motor_pos * np.nan", "it must be finite [rad]\n", "in step: def step("),
    "shape": ("motor_pos = np.zeros(3)", "has shape (3,); one leg needs (2,)\n", "in step: def st"),
}
"""What goes wrong -> the line that does it, what is said of it, and the source that is shown."""


@pytest.mark.parametrize(
    ("plant", "way"),
    [
        *((("sim",), way) for way in WRONG),
        *((plant, "raises") for plant in (("analytic",), EMULATED)),
        *(
            pytest.param(plant, way, marks=pytest.mark.long)
            for plant in (("analytic",), EMULATED)
            for way in ("nan", "shape")
        ),
    ],
)
def test_one_that_fails_is_the_cause_with_its_own_lines_and_the_recording_is_whole(
    way: str, plant: tuple[str, ...], tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    line, said, source = WRONG[way]
    text = OWN.read_text(encoding="utf-8")
    assert text.count(GOOD) == 1
    broken = f"        if observation.time > 0.0995:\n            {line}\n"
    file = tmp_path / "mine.py"
    file.write_text(text.replace(GOOD, broken + GOOD), encoding="utf-8")
    status, told, errors = ran(file, plant, tmp_path / "runs", capfd, "0.5")
    assert status == 1
    assert (told["status"], told["cause"]) == ("fault", "controller failed")
    assert "the controller failed at t = 0.100 s: " in errors
    assert said in errors
    assert f"{file}:" in errors
    assert source in errors
    assert "Traceback" not in errors
    run = load(Path(str(told["run"])))
    assert run.torn is None
    assert len(run.time) == 100
    assert np.all(np.isfinite(run["command_pos"]))
    assert run["fold_rate"].shape == (100,)
    assert run.events[-1]["message"] in errors
    assert "message" in repr(run)
    # A run of 100 rows is drawn alike, whatever plant it is of and whatever ended it.
    if plant == ("sim",) and way == "raises":
        assert main(["replay", str(run.path), "--figure", str(tmp_path / "phase.png")]) == 0
