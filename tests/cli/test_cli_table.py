"""Tables of figures say what a figure means that is out of its bounds."""

from dataclasses import replace
from pathlib import Path

import pytest

from legbench.cli import output
from legbench.cli.table import print_summary, warned
from legbench.control import JumpConfig
from legbench.design import load_design
from legbench.experiment import Experiment
from legbench.experiment.running import record_in_memory
from legbench.metrics import Summary, summarise
from legbench.metrics.soundness import Soundness

DESIGN = Path(__file__).parents[2] / "models" / "optimal.toml"


@pytest.fixture(scope="module")
def summary() -> Summary:
    return summarise(
        record_in_memory(
            Experiment(design=load_design(DESIGN), controller=JumpConfig(), duration=0.3)
        )
    )


@pytest.mark.parametrize(
    ("residual", "numerics", "said"),
    [
        (2e-5, Soundness.SOUND, "2e-05 of the peak kinetic energy"),
        (
            13.5,
            Soundness.UNSOUND,
            "13.5 times the peak kinetic energy came from or went to nowhere; "
            "up to 0.01 a run is sound",
        ),
        (
            13.5,
            Soundness.UNKNOWN,
            "unknown: between rows that are not those of every cycle energy flows unseen",
        ),
    ],
)
def test_an_energy_residual_is_explained(
    summary: Summary,
    capsys: pytest.CaptureFixture[str],
    residual: float,
    numerics: Soundness,
    said: str,
) -> None:
    print_summary(replace(summary, energy_residual=residual, numerics=numerics))
    assert f"energy residual   {said}\n" in capsys.readouterr().out


def test_emergencies_that_warn_are_told_once_each() -> None:
    code, other = "EMCY FF01h vendor error of node 1", "EMCY 5112h supply low of node 2"
    heard = {"name": "bus", "emergencies": [], "warnings": [code, other, code, code]}
    assert warned([{"name": "rest"}, heard]) == f"{code} (3 times), {other}"
    assert not warned([{"name": "bus", "emergencies": [code], "warnings": []}])
    assert not warned([{"name": "end"}])


def test_the_time_left_follows_the_pace_since_the_first_report(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    told: list[tuple[int, int, float | None]] = []
    now = iter((10.0, 12.0, 13.0))
    monkeypatch.setattr(output.time, "monotonic", lambda: next(now))
    monkeypatch.setattr(output, "progress", lambda *each: told.append(each))
    tell = output.timed_progress()
    for done in (2, 6, 8):
        tell(done, 12)
    assert told == [(2, 12, None), (6, 12, 3.0), (8, 12, 2.0)]


def test_each_of_several_works_has_a_pace_of_its_own(monkeypatch: pytest.MonkeyPatch) -> None:
    """Two families of modes, say, are followed one after the other with one line."""
    now = iter((0.0, 100.0, 101.0, 103.0))
    monkeypatch.setattr(output.time, "monotonic", lambda: next(now))
    left_after = output.pace()
    left = [left_after(done, 10) for done in (1, 9, 1, 5)]
    assert left == [None, 12.5, None, 2.5]
