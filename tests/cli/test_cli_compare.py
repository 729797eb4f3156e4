"""`legbench compare`: what it prints of runs of one leg, and of runs of two."""

import json
from pathlib import Path

import pytest

from legbench.cli import main
from legbench.control import BangBangConfig
from legbench.design import LegDesign
from legbench.design.setup import Setup, SetupKind
from legbench.experiment import Experiment
from legbench.experiment.running import record

Runs = tuple[Path, Path, Path]


@pytest.fixture(scope="module")
def runs(
    prototype: LegDesign, optimal: LegDesign, tmp_path_factory: pytest.TempPathFactory
) -> Runs:
    """A swing of one leg, the same with another set point, and one of another leg."""
    folder, setup = tmp_path_factory.mktemp("runs"), Setup(kind=SetupKind.VFTS)
    first, second, third = (
        record(
            Experiment(design=design, controller=controller, setup=setup, duration=0.8), folder
        ).path
        for design, controller in (
            (prototype, BangBangConfig()),
            (prototype, BangBangConfig(z2=1.1)),
            (optimal, BangBangConfig()),
        )
    )
    return first, second, third


def called(*arguments: object) -> int:
    return main(["compare", *map(str, arguments)])


def test_runs_stand_side_by_side(runs: Runs, capsys: pytest.CaptureFixture[str]) -> None:
    assert called(*runs) == 0
    told = capsys.readouterr()
    table = {line[:24].strip(): line[24:].split() for line in told.out.splitlines()}
    assert table["run"] == [run.name for run in runs]
    assert table["leg"] == ["prototype", "prototype", "optimal"]
    assert table["z2 [rad]"][1] == "1.1"
    assert len(table["switch [s]"]) == 3
    assert all(float(value) > 0.0 for value in table["|dz2|, max [rad]"])
    assert "foot clearance [mm]" not in table
    assert told.err.splitlines() == [
        f"legbench: {runs[1]} is another experiment: it differs in controller.settings.z2",
        f"legbench: {runs[2]} is a different leg, optimal and not prototype: it differs in "
        "design.foot.com, design.foot.inertia, design.foot.length, design.foot.mass and "
        "11 more entries",
    ]


def test_json_and_figure(runs: Runs, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    figure = tmp_path / "both.svg"
    aligning = ("--align", "action", "--span", "0.3", "--figure", figure, "--json")
    assert called(*runs[:2], *aligning) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["event"] == "action"
    (apart,) = told["apart"]
    assert apart["duration"] == pytest.approx(0.3, abs=0.051)
    assert apart["otherwise_unlike"] == ["controller.settings.z2"]
    assert told["runs"][0]["rating_periods"]
    text = figure.read_text(encoding="utf-8")
    assert "time since the first control action [s]" in text
    assert runs[1].name in text


@pytest.mark.parametrize(
    ("flags", "status", "message"),
    [
        (["--align", "touchdown"], 1, "has 0 events of kind touchdown"),
        (["--span", "0"], 2, "--span is 0 s; it must be more than 0 s"),
        (["--figure", "both.bmp"], 2, "a figure cannot be written as 'both.bmp'"),
    ],
)
def test_what_cannot_be_compared(
    runs: Runs, flags: list[str], status: int, message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert called(*runs[:2], *flags) == status
    told = capsys.readouterr()
    assert message in told.err
    assert told.out == ""


def test_one_run_is_not_enough(runs: Runs, capsys: pytest.CaptureFixture[str]) -> None:
    assert called(runs[0]) == 2
    assert "one run has nothing to be compared with" in capsys.readouterr().err
