"""A run as the short table that people see, as an Arrow table and as a DataFrame."""

import html
import json
import re
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pyarrow as pa
import pytest
from recorded_rows import append_rows

from legbench.design.toml import design_to_mapping, load_design
from legbench.errors import MissingExtraError, RecordingError
from legbench.recording.reader import Recording, load
from legbench.recording.writer import RunWriter

DESIGN = load_design(Path(__file__).parents[2] / "models" / "prototype.toml")
GIVEN = {
    "experiment": {
        "design": design_to_mapping(DESIGN),
        "setup": {"kind": "ffs"},
        "controller": {"kind": "bang-bang", "settings": {}},
        "plant": {"kind": "sim"},
    },
}


def recorded(folder: Path, *, truth: bool = True, **entries: object) -> Recording:
    with RunWriter.create(folder, {**GIVEN, **entries}) as writer:
        append_rows(writer, 120, start=300, truth=truth)
        writer.event(0.31, "notice", message="the hip <is> warm & loud")
        writer.event(0.32, "touchdown")
        writer.close("fault", "bus_off")
    return load(writer.path)


def shown(run: Recording) -> list[tuple[str, str]]:
    lines = [re.split(r" {2,}", line, maxsplit=1) for line in repr(run).splitlines()]
    return [(label, text) for label, text in lines]


def test_a_run_says_what_ran_how_long_and_how_it_ended(tmp_path: Path) -> None:
    run = recorded(tmp_path)
    wanted = [
        ("run", run.path.name),
        ("leg", "sim / prototype, ffs"),
        ("controller", "bang-bang"),
        ("ended", "fault: bus_off"),
        ("message", "the hip <is> warm & loud"),
        ("rows", "0.119 s, 120 rows"),
        ("signals", ", ".join(run.signals)),
    ]
    assert shown(run) == wanted
    # Texts stand below each other.
    pairs = zip(repr(run).splitlines(), wanted, strict=True)
    assert len({line.index(text) for line, (_, text) in pairs}) == 1


def test_the_table_of_a_notebook_is_the_same_and_escaped(tmp_path: Path) -> None:
    run = recorded(tmp_path)
    page = run._repr_html_()
    cells = re.findall(r"<t[hd][^>]*>(.*?)</t[hd]>", page)
    assert "&lt;is&gt; warm &amp; loud" in page
    texts = [html.unescape(cell) for cell in cells]
    assert list(zip(texts[::2], texts[1::2], strict=True)) == shown(run)


def test_a_run_that_is_not_understood_says_so(tmp_path: Path) -> None:
    with RunWriter.create(tmp_path, {"experiment": {"design": {}}}) as writer:
        pass
    rows = dict(shown(load(writer.path)))
    assert rows["not understood"].startswith("manifest design: [trunk] is missing")
    assert rows.keys() == {"run", "not understood", "rows", "signals"}
    assert rows["rows"] == "0 rows"


def test_a_torn_run_says_what_is_missing(tmp_path: Path) -> None:
    with RunWriter.create(tmp_path, GIVEN) as writer:
        rows = shown(load(writer.path))
        writer.event(0.0, "start")
        with (writer.path / "events.jsonl").open("a") as file:
            file.write("{")
        torn = load(writer.path).torn
    assert rows[-1] == ("torn", "samples.arrows has no end mark after 0 rows")
    assert ("ended", "running") in rows
    assert torn == f"{rows[-1][1]}; events.jsonl has 1 unreadable lines"


@pytest.mark.parametrize("truth", [False, True])
def test_an_arrow_table_has_every_column_with_its_unit_and_the_manifest(
    tmp_path: Path, truth: bool
) -> None:
    run = recorded(tmp_path, truth=truth)
    table = run.to_arrow()
    assert table.column_names == list(run.columns)
    for name in table.column_names:
        unit = (table.schema.field(name).metadata or {}).get(b"unit")
        assert unit == run.layout.units[name].encode(), name
    assert table["t_ns"].type == pa.int64()
    assert table["t_ns"].to_pylist() == [1_000_000 * row for row in range(300, 420)]
    contact = [int(row % 3 == 0) if truth else None for row in range(300, 420)]
    assert table["contact"].to_pylist() == contact
    assert table["phase"].to_pylist() == [row % 9 for row in range(300, 420)]
    assert table["phase"].type == table["contact"].type == pa.int8()
    assert json.loads(table.schema.metadata[b"legbench"]) == run.manifest


def test_a_frame_is_indexed_by_the_time_or_says_what_it_lacks(tmp_path: Path) -> None:
    run = recorded(tmp_path)
    if find_spec("pandas") is None:
        with pytest.raises(MissingExtraError, match=r"pip install pandas, or take to_arrow\(\)"):
            run.to_pandas()
        return
    frame = run.to_pandas()
    assert frame.index.name == "t"
    np.testing.assert_array_equal(frame.index.to_numpy(), run["t"])
    assert list(frame.columns) == [name for name in run.columns if name != "t_ns"]
    np.testing.assert_array_equal(frame["joint_vel_2"].to_numpy(), run["joint_vel"][:, 1])


def test_a_folder_of_runs_names_the_last_five(tmp_path: Path) -> None:
    for number in range(7):
        (tmp_path / f"r{number}").mkdir()
        (tmp_path / f"r{number}" / "run.json").write_text("{}")
    (tmp_path / "empty").mkdir()
    with pytest.raises(RecordingError, match=r"it holds the runs r2, r3, r4, r5, r6$"):
        load(tmp_path)
    with pytest.raises(RecordingError, match=r"it has no run\.json$"):
        load(tmp_path / "empty")


@pytest.mark.parametrize(
    ("row", "contact", "known"), [(0, -1, False), (59, -1, False), (7, 0, True)]
)
def test_one_row_without_truth_is_enough_to_have_none(
    tmp_path: Path, row: int, contact: int, known: bool
) -> None:
    run = recorded(tmp_path)
    columns = {name: column.copy() for name, column in run.columns.items()}
    columns["contact"][row] = contact
    altered = Recording(
        path=run.path,
        manifest=run.manifest,
        described=run.described,
        time=run.time,
        columns=columns,
        events=(),
    )
    assert altered.has_truth is known
    assert bool(altered["contact"][row]) is (contact == 1)
