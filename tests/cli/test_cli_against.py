"""`legbench replay RUN --against OTHER`: two runs drawn together and compared in numbers."""

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from commands import DESIGN, called

from legbench.cli import main
from legbench.cli.table import print_comparison
from legbench.metrics import Comparison, compare
from legbench.recording.reader import load

LASTING = ("--duration", "1")


def made(out: Path, *arguments: str) -> Path:
    """The folder of a new run."""
    assert main(["run", *arguments, *DESIGN, *LASTING, "--out", str(out)]) == 0
    (run,) = out.iterdir()
    return run


@pytest.fixture(scope="module")
def runs(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    out = tmp_path_factory.mktemp("against")
    reduced = ("--plant", "sim", "--linkage", "reduced")
    return {
        "analytic": made(out / "analytic", "jump", "--plant", "analytic"),
        "sim": made(out / "sim", "jump", *reduced),
        "fixed": made(out / "fixed", "position-jump", "--setup", "ffs", *reduced),
    }


def replayed(capfd: pytest.CaptureFixture[str], *arguments: str | Path) -> dict[str, Any]:
    done = called(capfd, "replay", *arguments, "--json")
    assert done.status == 0, done.err
    return json.loads(done.out)


def test_two_plants_are_compared_as_json(
    runs: dict[str, Path], capfd: pytest.CaptureFixture[str]
) -> None:
    alone = replayed(capfd, runs["analytic"])
    both = replayed(capfd, runs["analytic"], "--against", runs["sim"])
    (against,) = both.pop("against")
    assert both == alone
    assert against == compare(load(runs["analytic"]), load(runs["sim"])).to_json()
    assert against.keys() == set(Comparison.__dataclass_fields__)
    assert against["unlike"] == []
    assert 0.0 < against["z2_before_touchdown"] < 0.05
    assert abs(against["touchdown"][0]) < 0.005


def test_a_table_follows_that_of_the_run(
    runs: dict[str, Path], capfd: pytest.CaptureFixture[str]
) -> None:
    alone = called(capfd, "replay", runs["analytic"])
    both = called(capfd, "replay", runs["analytic"], "--against", runs["sim"])
    assert (both.status, both.err) == (0, "")
    assert both.out.startswith(alone.out)
    table = both.out.removeprefix(alone.out)
    for words in (
        f"against           {runs['sim']}\n",
        "sim / reduced / prototype minus analytic / prototype\n",
        "rad before the first touchdown at 0.26",
        "rad over 0.999 s\n",
        "\ntouchdown         +",
        "\nP^r flight ",
    ):
        assert words in table
    assert "nan" not in table


def test_everything_is_written_for_several_and_differences_are_said(
    runs: dict[str, Path], tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    figure, rrd = tmp_path / "both.png", tmp_path / "both.rrd"
    others = ("--against", runs["sim"], "--against", runs["fixed"])
    shown = ("--figure", figure, "--rrd", rrd)
    done = called(capfd, "replay", runs["analytic"], *others, *shown, "--json")
    assert done.status == 0
    told = json.loads(done.out)["against"]
    assert [each["other"] for each in told] == [str(runs["sim"]), str(runs["fixed"])]
    assert told[1]["liftoff"] == []
    assert told[1]["rating_stance"] is None
    note, *written = done.err.splitlines()
    assert note.startswith(f"legbench: {runs['fixed']} is another experiment: it differs in ")
    assert "setup.kind" in note
    assert note.endswith(" more entries")
    assert written == [f"wrote {figure}", f"wrote {rrd}"]
    assert figure.stat().st_size > 10_000
    assert rrd.stat().st_size > 10_000


def test_what_two_runs_do_not_show_is_not_printed(
    runs: dict[str, Path], capfd: pytest.CaptureFixture[str]
) -> None:
    fixed = load(runs["fixed"])
    longer = replace(fixed, path=Path("runs/longer"))
    capfd.readouterr()
    print_comparison(compare(fixed, longer))
    table = capfd.readouterr().out
    assert "against           runs/longer\n" in table
    for words in ("touchdown", "lift-off", "apex", "nan", "stance", "flight"):
        assert words not in table


def test_another_run_that_is_not_there_is_one_clear_line(
    runs: dict[str, Path], tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    figure = tmp_path / "a.png"
    nowhere = ("--against", tmp_path / "nowhere", "--figure", figure)
    called(capfd, "replay", runs["sim"], *nowhere).refused("nowhere does not exist")
    called(capfd, "replay", runs["sim"], "--against", runs["sim"].parent).refused(
        "is no run folder", runs["sim"].name
    )
    assert not figure.exists()
