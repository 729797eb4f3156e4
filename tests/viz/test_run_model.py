"""A run folder that somebody sent: what lies in it is drawn from what the run says, or refused."""

import copy
import json
import os
import warnings
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest
import viz_rrd

from legbench.control import JumpConfig
from legbench.design import load_design
from legbench.design.setup import SetupKind
from legbench.errors import FormatError, LegbenchError
from legbench.experiment import Experiment, record
from legbench.metrics import summarise
from legbench.recording.description import describe
from legbench.recording.reader import load
from legbench.viz.facts import as_markdown, facts_of
from legbench.viz.live.rrd import write_rrd
from legbench.viz.run_model import model_of

MODELS = Path(__file__).parents[2] / "models"
BAD: list[object] = [1e308, -1, "x", None, {}, 10**400]
"""What stands in the place of each entry of a manifest, by turns."""
FAR_BOOM = {"kind": "ffs", "boom_radius": 5e5}
INCLUDE = '<mujoco><include file="/etc/passwd"/></mujoco>'
REPLICATE = (
    '<mujoco><worldbody><replicate count="100000000" offset="1 0 0"><body><geom size="1"/></body>'
    "</replicate></worldbody></mujoco>"
)


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    design = load_design(MODELS / "prototype.toml")
    chosen = Experiment(design=design, controller=JumpConfig(), duration=0.05)
    return record(chosen, tmp_path_factory.mktemp("sent")).path


def sent(run: Path, folder: Path) -> Path:
    """A copy of a run's folder, to plant something in."""
    folder.mkdir()
    for path in run.iterdir():
        (folder / path.name).write_bytes(path.read_bytes())
    return folder


@pytest.mark.parametrize("kind", list(SetupKind))
@pytest.mark.parametrize("linkage", ["bars", "reduced"])
def test_a_model_made_anew_has_the_shape_of_the_one_that_ran(
    kind: SetupKind, linkage: str, run: Path
) -> None:
    manifest = json.loads((run / "run.json").read_text())
    tables = manifest["experiment"]
    tables["setup"] = {"kind": kind.value, "boom_radius": 1.2 if kind is SetupKind.FFS else None}
    tables["linkage"] = {"kind": linkage}
    model = model_of(describe(manifest))
    assert ("bar_thigh" in [model.joint(k).name for k in range(model.njnt)]) is (linkage == "bars")
    assert ("boom_yaw" in [model.joint(k).name for k in range(model.njnt)]) is (kind == "ffs")
    if kind is SetupKind.JUMP and linkage == "bars":
        ran = mujoco.MjModel.from_xml_path(str(run / "leg.xml"))
        for name in ("body_pos", "body_mass", "geom_size", "geom_pos", "site_pos", "jnt_axis"):
            np.testing.assert_allclose(getattr(model, name), getattr(ran, name), atol=1e-15)
        assert [model.body(k).name for k in range(model.nbody)] == [
            ran.body(k).name for k in range(ran.nbody)
        ]


@pytest.mark.parametrize("planted", [INCLUDE, REPLICATE, "<mujoco", ""])
def test_a_planted_model_is_not_opened(planted: str, run: Path, tmp_path: Path) -> None:
    """Neither by name nor by content: its time of last access would tell, a FIFO would hang."""
    folder = sent(run, tmp_path / "run")
    (folder / "leg.xml").write_text(planted)
    write_rrd(load(folder), tmp_path / "planted.rrd")
    (folder / "leg.xml").unlink()
    os.mkfifo(folder / "leg.xml")
    write_rrd(load(folder), tmp_path / "fifo.rrd")
    (folder / "leg.xml").unlink()
    (folder / "leg.xml").symlink_to("/etc/passwd")
    write_rrd(load(folder), tmp_path / "link.rrd")
    drawn = [viz_rrd.temporal(tmp_path / f"{name}.rrd") for name in ("planted", "fifo", "link")]
    assert drawn[0].keys() == drawn[1].keys() == drawn[2].keys()
    assert any(path.startswith("/scene/model") for path in drawn[0])


def entries(table: Mapping[str, Any], path: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    """The way to every entry of a manifest, those of its tables and the first of a list included.

    Left out are the units, which nothing reads.
    """
    for key, entry in table.items():
        yield (*path, key)
        if isinstance(entry, dict) and key != "units":
            yield from entries(entry, (*path, key))
        elif isinstance(entry, list) and entry:
            yield (*path, key, 0)


@pytest.mark.long
def test_every_entry_of_a_manifest_may_be_nonsense(run: Path, tmp_path: Path) -> None:
    """Whatever an entry holds, a run is summarised and drawn, or refused by one line.

    Each entry holds two of the kinds of nonsense, and each kind is held by a third of the entries.
    """
    folder = sent(run, tmp_path / "run")
    manifest = json.loads((folder / "run.json").read_text())
    refused: list[str] = []
    for place, way in enumerate(entries(manifest)):
        for value in (BAD[place % len(BAD)], BAD[(place + 2) % len(BAD)]):
            changed = copy.deepcopy(manifest)
            table: Any = changed
            for key in way[:-1]:
                table = table[key]
            table[way[-1]] = value
            (folder / "run.json").write_text(json.dumps(changed))
            try:
                shown(folder)
            except LegbenchError as error:
                refused.append(str(error))
    assert len(refused) > 70
    assert not any("\n" in line for line in refused)


def shown(folder: Path) -> None:
    """Make of a run what `replay` and `render` make of it before they draw."""
    with warnings.catch_warnings():
        # A damping of 1e308 makes infinite energies, which the summary shows.
        warnings.filterwarnings("ignore", "overflow|invalid value", RuntimeWarning)
        seen = load(folder)
        as_markdown(facts_of(seen.description), summarise(seen))
        model_of(seen.description)


@pytest.mark.parametrize(
    ("entry", "value", "words"),
    [
        (("linkage", "kind"), "chain", r"linkage\.kind is 'chain'; known are bars, reduced"),
        (("linkage", "crank_length"), 1e300, r"linkage\.crank_length is 1e\+300 m; between"),
        (("linkage", "crank_length"), 3.0, r"linkage\.crank_length is 3 m; between 0 and 0\.26"),
        (("ground", "tip_radius"), "r", r"ground\.tip_radius is 'r'; it must be a number"),
        (("setup",), FAR_BOOM, r"setup\.boom_radius is 500000 m; between 0\.001 and 100"),
        (("setup", "boom_radius"), 1.0, r"setup jump has no boom"),
        (("linkage", "bar_density"), 1e5, r"no model that can be drawn: the bars weigh"),
        (("controller",), "../other/run.json", r"controller is '\.\./other/run\.json'; it must be"),
    ],
)
def test_what_is_wrong_is_named(
    entry: tuple[str, ...], value: object, words: str, run: Path, tmp_path: Path
) -> None:
    folder = sent(run, tmp_path / "run")
    manifest = json.loads((folder / "run.json").read_text())
    table = manifest if entry == ("controller",) else manifest["experiment"]
    for key in entry[:-1]:
        table = table.setdefault(key, {})
    table[entry[-1]] = value
    (folder / "run.json").write_text(json.dumps(manifest))
    with pytest.raises(FormatError, match=words):
        model_of(load(folder).description)


def test_a_draft_that_is_a_link_is_not_written_through(run: Path, tmp_path: Path) -> None:
    precious = tmp_path / "precious"
    precious.write_text("kept\n")
    (tmp_path / ".view.draft.rrd").symlink_to(precious)
    write_rrd(load(run), tmp_path / "view.rrd")
    assert precious.read_text() == "kept\n"
    assert not (tmp_path / "view.rrd").is_symlink()
