"""`import legbench`: its names, what it costs, and what a notebook does with it."""

import ast
import signal
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import legbench
from legbench.errors import ConfigError, MissingExtraError
from legbench.experiment import running
from legbench.lazily import lazy_names
from legbench.plants import Leg, OpenPlant, SimChoice
from legbench.recording.layout import TIME

MODELS = Path(__file__).parents[1] / "models"
PER_MACHINE = ("cycle_us", "late_us")
"""Columns of wall times."""


@pytest.fixture
def hop() -> legbench.Experiment:
    leg = legbench.load_design(MODELS / "prototype.toml")
    return legbench.Experiment(design=leg, controller=legbench.JumpConfig(), duration=0.73)


def test_importing_loads_nothing_else() -> None:
    """Neither a library nor a room: the face itself, and how it is loaded."""
    code = "import sys; old = set(sys.modules); import legbench; print(*(set(sys.modules) - old))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert set(done.stdout.split()) == {"legbench", "legbench.lazily"}


def test_every_name_is_there_and_is_completed() -> None:
    for name in legbench.__all__:
        home = getattr(legbench, name)
        assert home.__name__ == name, name
        assert home.__doc__, name
    assert dir(legbench) == sorted([*legbench.__all__, "__version__"])
    with pytest.raises(AttributeError, match="module 'legbench' has no attribute 'sumarise'"):
        lazy_names("legbench", {})("sumarise")


def test_type_checkers_are_told_the_same_names_from_the_same_homes() -> None:
    tree = ast.parse(Path(str(legbench.__file__)).read_text(encoding="utf-8"))
    told = {
        alias.name: node.module
        for block in tree.body
        if isinstance(block, ast.If)
        for node in block.body
        if isinstance(node, ast.ImportFrom)
        for alias in node.names
    }
    assert told == {name: getattr(legbench, name).__module__ for name in legbench.__all__}


def test_a_run_in_memory_is_the_run_of_a_folder(hop: legbench.Experiment, tmp_path: Path) -> None:
    inside, folder = legbench.run(hop), legbench.run(hop, tmp_path)
    assert not inside.path.exists()
    assert folder.path.parent == tmp_path
    assert list(inside.columns) == list(folder.columns)
    for name, values in folder.columns.items():
        assert inside.columns[name].dtype == values.dtype, name
        assert not inside.columns[name].flags.writeable, name
        if name not in PER_MACHINE:
            assert inside.columns[name].tobytes() == values.tobytes(), name
    assert inside.time.tobytes() == folder.time.tobytes()
    assert inside.complete
    assert folder.complete
    for key in ("status", "cause", "rows", "duration", "units", "experiment"):
        assert inside.manifest[key] == folder.manifest[key], key
    ours, theirs = legbench.summarise(inside), legbench.summarise(folder)
    assert ours.rating_stance == theirs.rating_stance
    assert legbench.compare(inside, folder).joint_max == 0.0


def test_a_run_is_silent_unless_it_is_asked_for_progress(
    hop: legbench.Experiment, capfd: pytest.CaptureFixture[str]
) -> None:
    seen: list[tuple[int, int]] = []
    legbench.run(hop)
    legbench.run(hop, progress=lambda done, total: seen.append((done, total)))
    assert seen == [(250, 730), (500, 730), (730, 730)]
    assert capfd.readouterr() == ("", "")


def test_files_are_named_by_text_or_path(hop: legbench.Experiment, tmp_path: Path) -> None:
    legbench.save_design(hop.design, str(tmp_path / "leg.toml"))
    legbench.save_experiment(hop, str(tmp_path / "hop.toml"))
    assert legbench.load_design(str(tmp_path / "leg.toml")) == hop.design
    assert legbench.load_experiment(str(tmp_path / "hop.toml")) == hop
    recording = legbench.run(hop, str(tmp_path / "runs"))
    assert np.array_equal(legbench.load(str(recording.path)).time, recording.time)


def test_drives_in_real_time_need_a_folder(
    hop: legbench.Experiment, monkeypatch: pytest.MonkeyPatch
) -> None:
    closed: list[bool] = []

    def opened(settings: SimChoice, leg: Leg) -> OpenPlant:
        plant = settings.open(leg).plant
        monkeypatch.setattr(type(plant), "close", lambda _plant: closed.append(True))
        return OpenPlant(plant=plant, realtime=True)

    monkeypatch.setattr(running, "open_plant", opened)
    with pytest.raises(ConfigError, match="recorded in a folder only; give out"):
        legbench.run(hop)
    assert closed == [True]


def test_a_controller_of_a_notebook_runs_in_memory_and_needs_a_file_for_a_folder(
    hop: legbench.Experiment, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delattr(sys.modules["__main__"], "__file__", raising=False)
    cell = (MODELS.parent / "scripts" / "examples" / "own_controller.py").read_text("utf-8")
    names: dict[str, Any] = {"__name__": "__main__"}
    exec(compile(cell, "<cell>", "exec"), names)
    chosen = replace(
        hop, controller=names["Pump"](), setup=legbench.Setup(kind=legbench.SetupKind.FFS)
    )
    run = legbench.run(chosen)
    assert run.complete
    assert np.array_equal(run["fold_rate"], run["joint_vel"] @ [-0.5, 0.5])
    assert run.manifest["experiment"]["controller"]["kind"] == "pump"
    with pytest.raises(ConfigError, match="'pump' has no file that another process could find"):
        legbench.run(chosen, tmp_path)
    assert list(tmp_path.iterdir()) == []


def test_an_interruption_goes_on_to_the_caller_once_the_run_is_whole(
    hop: legbench.Experiment, tmp_path: Path
) -> None:
    def impatient(done: int, total: int) -> None:
        signal.raise_signal(signal.SIGINT)

    with pytest.raises(KeyboardInterrupt, match="was interrupted after 250 rows"):
        legbench.run(hop, progress=impatient)
    with pytest.raises(KeyboardInterrupt):
        legbench.run(hop, tmp_path, progress=impatient)
    (kept,) = tmp_path.iterdir()
    assert len(legbench.load(kept).time) == 250
    assert legbench.load(kept).description.status == "interrupted"


def test_a_recording_shows_itself_as_a_short_table(hop: legbench.Experiment) -> None:
    recording = legbench.run(hop)
    lines = repr(recording).splitlines()
    assert lines[1:5] == [
        "leg         sim / bars / prototype, jump",
        "controller  jump",
        "ended       complete",
        "rows        0.729 s, 730 rows",
    ]
    assert len(lines) == 6
    html = recording._repr_html_()
    assert html.count("<tr>") == 6
    assert "<td style='text-align:left'>0.729 s, 730 rows</td>" in html
    odd = replace(recording, path=Path("<b>"), torn="a & b")
    assert "&lt;b&gt;" in odd._repr_html_()
    assert "a &amp; b" in odd._repr_html_()


def test_a_table_of_arrow_has_every_column_with_its_unit(hop: legbench.Experiment) -> None:
    recording = legbench.run(hop)
    table = recording.to_arrow()
    assert table.column_names == list(recording.columns)
    for name in table.column_names:
        assert np.array_equal(table[name].to_numpy(), recording.columns[name]), name
    units = {field.name: field.metadata[b"unit"].decode() for field in table.schema}
    assert units == recording.layout.units
    unknown = {**recording.columns, "contact": np.full(len(recording.time), -1, dtype=np.int8)}
    assert replace(recording, columns=unknown).to_arrow()["contact"].null_count == 730


def test_a_frame_of_pandas_has_the_time_as_its_index(hop: legbench.Experiment) -> None:
    recording = legbench.run(hop)
    try:
        frame = recording.to_pandas()
    except MissingExtraError as error:
        assert "pip install pandas, or take to_arrow()" in str(error)  # noqa: PT017
        return
    assert list(frame.columns) == [name for name in recording.columns if name != TIME]
    assert np.array_equal(frame.index.to_numpy(), recording.time)
    assert np.array_equal(frame["joint_pos_1"].to_numpy(), recording["joint_pos"][:, 0])


def test_a_figure_shows_itself(hop: legbench.Experiment) -> None:
    figure = legbench.phase_figure(legbench.run(hop))
    shown = figure._repr_png_()
    assert shown.startswith(b"\x89PNG\r\n")
    assert figure._repr_png_() == shown
    assert len(figure.axes) >= 3
