"""Exports that cannot be: one clear error, nothing half-written, the recording untouched."""

import builtins
import sys
from dataclasses import replace
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np
import pytest

from legbench.cli import main
from legbench.errors import ConfigError, MissingExtraError, RecordingError
from legbench.export.formats import Format, export
from legbench.recording.reader import Recording, load


@pytest.mark.parametrize("name", ["samples.parquet", "run.json", "events.jsonl", "samples.arrows"])
def test_the_recording_itself_is_not_overwritten(jump: Path, name: str) -> None:
    before = {path.name: path.read_bytes() for path in jump.iterdir()}
    with pytest.raises(ConfigError, match=r"is part of the recording itself; choose another file"):
        export(load(jump), jump / name, Format.PARQUET)
    assert {path.name: path.read_bytes() for path in jump.iterdir()} == before


@pytest.mark.parametrize("kind", list(Format))
def test_a_full_disk_leaves_nothing(run: Recording, small_disk: Path, kind: Format) -> None:
    (small_disk / "ballast").write_bytes(bytes(200_000))
    columns = {
        name: np.random.default_rng(1).permutation(np.tile(values, 40)).astype(values.dtype)
        for name, values in run.columns.items()
    }
    time = np.tile(run.time, 40)
    large = replace(run, columns=MappingProxyType(columns), time=time, events=())
    with pytest.raises(RecordingError, match="No space left on device"):
        export(large, small_disk / "run.out", kind)
    assert [path.name for path in small_disk.iterdir()] == ["ballast"]


def test_names_that_matlab_does_not_take_are_named(run: Recording, tmp_path: Path) -> None:
    name = "torque_" + "x" * 60
    columns = MappingProxyType(dict(run.columns) | {name: run.time})
    with pytest.raises(ConfigError, match=rf"column '{name}' cannot be a variable of MATLAB"):
        export(replace(run, columns=columns), tmp_path / "run.mat", Format.MAT)
    assert list(tmp_path.iterdir()) == []


def test_a_missing_mcap_names_its_extra(
    run: Recording, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    real = builtins.__import__

    def without(name: str, *rest: Any, **more: Any) -> Any:
        if name.startswith("mcap"):
            raise ImportError(name)
        return real(name, *rest, **more)

    for module in [each for each in sys.modules if each.startswith("legbench.export.")]:
        if "mcap" in module:
            monkeypatch.delitem(sys.modules, module)
    monkeypatch.setattr(builtins, "__import__", without)
    with pytest.raises(MissingExtraError, match=r"pip install 'legbench\[mcap\]'"):
        export(run, tmp_path / "run.mcap", Format.MCAP)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("flags", "status", "message"),
    [
        ([], 2, "no format was chosen; choose one of --csv, --parquet, --mat, --mcap"),
        (["--csv", "--mat"], 2, "one file has one format; choose one of --csv"),
        (["--out", "run.xlsx"], 2, "no format was chosen"),
        (["--csv", "--out", "run.mat"], 2, "--csv does not go with run.mat"),
        (["--csv", "--out", "/dev/null/run.csv"], 1, "cannot write /dev/null/run.csv"),
    ],
)
def test_the_command_says_what_it_needs(
    jump: Path, flags: list[str], status: int, message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["export", str(jump), *flags]) == status
    told = capsys.readouterr()
    assert told.out == ""
    assert told.err.startswith("legbench: ")
    assert message in told.err
    assert told.err.count("\n") == 1


def test_the_suffix_chooses_where_no_flag_does(
    jump: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "out" / "run.CSV"
    assert main(["export", str(jump), "--out", str(path), "--json"]) == 0
    assert f'"out": "{path}", "format": "csv", "rows": 500' in capsys.readouterr().out
    assert path.read_text(encoding="utf-8").count("\n") == 501
