"""Runs that the first format wrote, thinned to some hundred rows, and what was measured of them."""

import json
import math
import shutil
from pathlib import Path
from typing import Any

import pytest

from legbench.metrics import summarise
from legbench.phases import Counting, Role
from legbench.recording.format_1 import built_in, upgraded
from legbench.recording.reader import load
from legbench.recording.repair import recover

RUNS = Path(__file__).parent / "format_1"
NAMES = ["jump", "jump-without-truth", "bang-bang", "bang-bang-without-truth"]


def leaves(path: str, value: Any) -> dict[str, Any]:
    """Numbers and texts of a summary by their dotted names."""
    if isinstance(value, list):
        found = {f"{path}[{place}]": each for place, each in enumerate(value)}
        return {f"{path}.count": len(value)} | found
    return {path: value}


@pytest.mark.parametrize("name", NAMES)
def test_an_old_run_is_measured_as_it_was(name: str) -> None:
    run = load(RUNS / name)
    before = json.loads((RUNS / name / "summary.json").read_text())
    after = summarise(run).to_json()
    for key, value in before.items():
        for path, number in leaves(key, value).items():
            assert leaves(key, after[key])[path] == (
                pytest.approx(number, rel=1e-9, abs=1e-12) if isinstance(number, float) else number
            ), path
    assert after["warnings"] == []


@pytest.mark.parametrize("name", NAMES)
def test_an_old_run_describes_itself(name: str) -> None:
    found = load(RUNS / name).description
    jumps = name.startswith("jump")
    assert found.controller == ("jump" if jumps else "bang-bang")
    assert found.plant == ("can" if name.endswith("truth") else "sim")
    assert found.linkage == "bars"
    assert found.crank_length == 0.02
    assert found.design.name == "prototype"
    assert found.planned_duration is None
    assert found.duration == pytest.approx(1.499)
    assert found.counting == (Counting() if jumps else Counting(most=20))
    assert {"python", "numpy", "mujoco-core"} <= found.versions.keys()
    assert found.model_hash is not None
    assert found.layout.own == ()
    roles = {phase.name: phase.role for phase in found.phases}
    assert roles["rest"] is Role.REST
    assert ("compress" in roles) is jumps
    assert ("folded" in roles) is not jumps


def test_a_touchdown_is_told_as_late_as_the_settings_say() -> None:
    late = {phase.name: phase.late for phase in load(RUNS / "jump").description.phases}
    assert late == {"rest": 0.0, "flight": 0.0, "compress": 0.05, "push": 0.0, "release": 0.0}


def test_after_a_position_jump_a_tenth_of_it_counts() -> None:
    assert built_in("position-jump", {"dz2": -0.3}).counting.smallest == pytest.approx(0.03)
    assert built_in("position-jump", {"dz2": math.nan}).counting == Counting()


def test_a_run_that_names_no_controller_has_the_phases_of_all() -> None:
    codes = [phase.code for phase in built_in("", {}).phases]
    assert codes == [*range(9)]


def test_nothing_that_format_1_said_is_lost() -> None:
    old = json.loads((RUNS / "bang-bang-without-truth" / "run.json").read_text())
    new = upgraded(old)
    homes = (new, new["experiment"], new["plant"], new["provenance"])
    for key, value in old.items():
        if key not in ("plant", "controller"):
            assert any(key in home and home[key] == value for home in homes), key
    assert new["experiment"]["plant"] == {"kind": "can"}
    chosen = new["experiment"]["controller"]
    assert {"kind": chosen["kind"], **chosen["settings"]} == old["controller"]


def test_an_old_run_is_recovered_in_its_own_format(tmp_path: Path) -> None:
    run = tmp_path / "run"
    shutil.copytree(RUNS / "jump", run)
    manifest = json.loads((run / "run.json").read_text()) | {"status": "running"}
    (run / "run.json").write_text(json.dumps(manifest))
    assert recover(run).status == "recovered"
    again = load(run)
    assert again.manifest["format"] == 1
    assert again.description.status == "recovered"
    assert again.description.controller == "jump"
