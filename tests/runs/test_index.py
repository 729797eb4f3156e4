"""The index of runs: what it knows it does not measure again, and it notices every change."""

import json
import os
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pyarrow.parquet as pq
import pytest

from legbench.cli import main
from legbench.control import BangBangConfig
from legbench.design import LegDesign
from legbench.design.setup import Setup, SetupKind
from legbench.errors import RecordingError
from legbench.experiment import Experiment
from legbench.experiment.running import record
from legbench.metrics import summarise
from legbench.recording.reader import load
from legbench.runs import entry, index
from legbench.runs.index import INDEX, rows_of


@pytest.fixture(scope="module")
def recorded(prototype: LegDesign, tmp_path_factory: pytest.TempPathFactory) -> Path:
    experiment = Experiment(
        design=prototype,
        controller=BangBangConfig(),
        setup=Setup(kind=SetupKind.VFTS),
        duration=1.0,
    )
    return record(experiment, tmp_path_factory.mktemp("recorded")).path


@pytest.fixture
def runs(recorded: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with three runs, one of them in a folder of its own, and an empty cache."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    for name in ("a", "b", "deep/er/c"):
        shutil.copytree(recorded, tmp_path / "runs" / name)
    return tmp_path / "runs"


@pytest.fixture
def measured(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Names of the runs that are measured from now on."""
    told: list[str] = []
    real = entry.measure

    def measure(run: Path) -> dict[str, Any]:
        told.append(run.name)
        return real(run)

    monkeypatch.setattr(entry, "measure", measure)
    return told


def names(rows: list[dict[str, Any]]) -> list[str]:
    return [row["run"] for row in rows]


def test_a_row_has_the_figures_and_the_settings(runs: Path) -> None:
    row, summary = rows_of(runs)[0], summarise(load(runs / "a"))
    ratings = summary.rating_periods
    assert len(ratings) > 1
    assert row["rating_periods"] == pytest.approx(sum(ratings) / len(ratings), rel=1e-15)
    assert row["rating"] == row["rating_periods"]
    assert (row["rating_stance"], row["foot_clearance"]) == (None, None)
    assert (row["controller"], row["setup"], row["status"]) == ("bang-bang", "vfts", "complete")
    assert row["controller.settings.z2"] == BangBangConfig().z2
    assert row["design.thigh.mass"] == load(runs / "a").description.design.thigh.mass
    assert (row["rows"], row["torn"]) == (1000, None)


def test_a_run_that_was_cut_short_lasts_as_long_as_it_did(recorded: Path, tmp_path: Path) -> None:
    shutil.copytree(recorded, tmp_path / "short")
    samples = tmp_path / "short" / "samples.parquet"
    pq.write_table(pq.read_table(samples).slice(0, 400), samples)
    (row,) = rows_of(tmp_path)
    assert row["duration"] == summarise(load(tmp_path / "short")).duration
    assert row["planned_duration"] == 1.0


def test_what_is_known_is_not_measured_again(runs: Path, measured: list[str]) -> None:
    told: list[tuple[int, int]] = []
    first = rows_of(runs, lambda done, total: told.append((done, total)))
    assert names(first) == ["a", "b", "deep/er/c"]
    assert (measured, told) == (["a", "b", "c"], [(1, 3), (2, 3), (3, 3)])
    assert rows_of(runs) == first
    assert len(measured) == 3


def touch_manifest(runs: Path) -> None:
    path = runs / "b" / "run.json"
    path.write_text(path.read_text(encoding="utf-8") + " ", encoding="utf-8")


def touch_samples(runs: Path) -> None:
    os.utime(runs / "b" / "samples.parquet", ns=(1, 1))


def lose_the_archive(runs: Path) -> None:
    (runs / "b" / "samples.parquet").unlink()


@pytest.mark.parametrize("change", [touch_manifest, touch_samples, lose_the_archive])
def test_a_run_that_changed_is_measured_again(
    runs: Path, measured: list[str], change: Callable[[Path], None]
) -> None:
    rows_of(runs)
    change(runs)
    measured.clear()
    rows = rows_of(runs)
    assert measured == ["b"]
    if change is lose_the_archive:
        assert rows[1]["status"] == "unreadable"
        assert "has no samples" in str(rows[1]["cause"])


def test_runs_that_come_and_go(runs: Path, measured: list[str]) -> None:
    rows_of(runs)
    measured.clear()
    shutil.rmtree(runs / "a")
    shutil.copytree(runs / "b", runs / "d")
    assert names(rows_of(runs)) == ["b", "d", "deep/er/c"]
    assert measured == ["d"]
    known = json.loads((runs / INDEX).read_text(encoding="utf-8"))["runs"]
    assert sorted(known) == ["b", "d", "deep/er/c"]


@pytest.mark.parametrize(
    "damage", [b"", b"{", b"[]", b'{"version": [1, "0"], "runs": {}}', b"\xff"]
)
def test_a_damaged_index_is_built_anew(runs: Path, measured: list[str], damage: bytes) -> None:
    first = rows_of(runs)
    whole = (runs / INDEX).read_bytes()
    (runs / INDEX).write_bytes(damage)
    measured.clear()
    assert rows_of(runs) == first
    assert measured == ["a", "b", "c"]
    assert (runs / INDEX).read_bytes() == whole


def test_entries_that_cannot_be_are_measured_again(runs: Path, measured: list[str]) -> None:
    first = rows_of(runs)
    content = json.loads((runs / INDEX).read_text(encoding="utf-8"))
    content["runs"]["a"] = 3
    content["runs"]["b"]["row"] = None
    (runs / INDEX).write_text(json.dumps(content), encoding="utf-8")
    measured.clear()
    assert rows_of(runs) == first
    assert measured == ["a", "b"]


def test_a_folder_that_may_not_be_written_keeps_its_index_in_the_cache(
    runs: Path, tmp_path: Path, measured: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    real = index.write_whole

    def refused(path: Path, content: bytes) -> None:
        if path.parent == runs:
            raise PermissionError(13, "Permission denied")
        real(path, content)

    monkeypatch.setattr(index, "write_whole", refused)
    first = rows_of(runs)
    assert not (runs / INDEX).exists()
    assert len(list((tmp_path / "cache/legbench").iterdir())) == 1
    measured.clear()
    assert rows_of(runs) == first
    assert measured == []
    monkeypatch.setenv("XDG_CACHE_HOME", "/dev/null")
    assert rows_of(runs) == first
    assert measured == ["a", "b", "c"]


def test_processes_that_share_the_work_find_the_same(
    runs: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    first = rows_of(runs)
    (runs / INDEX).unlink()
    monkeypatch.setattr(index, "MANY", 1)
    assert rows_of(runs) == first


def test_a_folder_that_is_not_there_is_named(tmp_path: Path) -> None:
    with pytest.raises(RecordingError, match=r"cannot list runs in .*nowhere: No such file"):
        rows_of(tmp_path / "nowhere")


def test_the_command_lists_and_chooses(runs: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["runs", str(runs), "--where", "run != b", "--columns", "z2", "run"]) == 0
    assert capsys.readouterr().out.splitlines() == [
        "z2 [rad]  run",
        f"{BangBangConfig().z2:>8.5g}  a",
        f"{BangBangConfig().z2:>8.5g}  deep/er/c",
        f"2 of 3 runs in {runs}",
    ]
    sorting = ["--sort", "run", "--descending", "--columns", "run", "--json"]
    assert main(["runs", str(runs), *sorting]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["runs"] == [{"run": "deep/er/c"}, {"run": "b"}, {"run": "a"}]
    assert main(["runs", str(runs)]) == 0
    assert capsys.readouterr().out.startswith("run        setup  controller  z2 [rad]")
    assert main(["runs", str(runs), "--sort", "speed"]) == 2
    assert "no run has a figure or setting 'speed'" in capsys.readouterr().err


def test_an_empty_folder_has_no_runs(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["runs", str(tmp_path), "--where", "rating>1", "--columns", "rating"]) == 0
    assert capsys.readouterr().out.splitlines()[-1] == f"0 of 0 runs in {tmp_path}"
