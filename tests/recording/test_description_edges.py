"""What a description says where its manifest says less, or something else than usual."""

import json
from pathlib import Path
from typing import Any

import pytest

from legbench.design.toml import design_to_mapping, load_design
from legbench.phases import Counting, PhaseInfo, Role
from legbench.recording.description import RunDescription, describe
from legbench.recording.format_1 import built_in, upgraded
from legbench.recording.unlike import unlike

DESIGN = design_to_mapping(load_design(Path(__file__).parents[2] / "models" / "prototype.toml"))


def described(head: dict[str, Any] | None = None, **experiment: Any) -> RunDescription:
    tables = {"design": DESIGN, "setup": {"kind": "jump"}, "controller": {"kind": "mine"}}
    return describe({"format": 2, "experiment": tables | experiment} | (head or {}), "folder")


def test_a_manifest_that_says_little_describes_little() -> None:
    found = described()
    assert (found.id, found.controller, found.title) == ("folder", "mine", "prototype")
    nothing = ("created", "linkage", "crank_length", "z2", "dz2", "plant", "status", "cause")
    nothing += ("rows", "duration", "planned_duration", "period", "initial_state", "model_hash")
    assert {name: getattr(found, name) for name in nothing} == dict.fromkeys(nothing)
    assert (found.looks_only, found.complete, found.jumps) == (False, False, True)
    assert (found.phases, found.counting) == ((), Counting())
    assert (dict(found.versions), found.layout.own) == ({}, ())


def test_the_manifest_of_a_run_goes_before_what_was_asked_for() -> None:
    head = {"id": "x", "controller": {"kind": "given"}, "plant": {"kind": "can"}}
    found = described(head, plant={"kind": "sim"})
    assert (found.id, found.controller, found.plant) == ("x", "given", "can")
    assert described(plant={"kind": "sim"}).plant == "sim"


@pytest.mark.parametrize(
    ("said", "looks"), [(True, True), (False, False), (1, False), (None, False)]
)
def test_a_plant_is_only_looked_at_if_its_bus_says_so(said: object, looks: bool) -> None:
    assert described({"plant": {"bus": {"read_only": said}}}).looks_only is looks
    assert described({"plant": {}}).looks_only is False


@pytest.mark.parametrize(
    ("linkage", "plant", "kind", "length"),
    [
        ({"kind": "bars"}, "sim", "bars", 0.02),
        ({"kind": "bars", "crank_length": 0.0}, "sim", "bars", 0.0),
        ({"kind": "bars", "crank_length": 0.035}, "sim", "bars", 0.035),
        ({"kind": "belt", "crank_length": 0.035}, "sim", "belt", None),
        ({"kind": "bars"}, "analytic", None, 0.02),
        ({"kind": "bars"}, "can", "bars", 0.02),
    ],
)
def test_bars_have_cranks_and_equations_have_no_linkage(
    linkage: dict[str, Any], plant: str, kind: str | None, length: float | None
) -> None:
    found = described(linkage=linkage, plant={"kind": plant})
    assert (found.linkage, found.crank_length) == (kind, length)


@pytest.mark.parametrize(
    ("said", "found"), [(0.5, 0.5), (2, 2.0), (0, 0.0), (True, None), ("0.5", None), ([1.0], None)]
)
def test_a_setting_is_a_number_or_means_something_else(said: Any, found: float | None) -> None:
    settings = {"kind": "mine", "settings": {"z2": said, "dz2": said}}
    run = described(controller=settings)
    assert (run.z2, run.dz2) == (found, found)


@pytest.mark.parametrize("missing", ["joint_pos", "motor_pos"])
def test_an_initial_state_is_whole_or_none(missing: str) -> None:
    whole = {"joint_pos": [0.1, 0.2], "motor_pos": [0.3, 0.4]}
    state = described({"initial_state": whole}).initial_state
    assert state is not None
    assert (state.joint_pos, state.motor_pos) == ((0.1, 0.2), (0.3, 0.4))
    del whole[missing]
    assert described({"initial_state": whole}).initial_state is None


@pytest.mark.parametrize("status", ["complete", "fault", "running", None])
def test_a_run_is_complete_by_its_status_alone(status: str | None) -> None:
    assert described({"status": status}).complete is (status == "complete")


@pytest.mark.parametrize("setup", ["hfts", "vfts", "ffs", "jump"])
def test_only_a_leg_that_may_leave_the_ground_jumps(setup: str) -> None:
    assert described(setup={"kind": setup}).jumps is (setup == "jump")


def test_the_phases_of_format_1_are_those_that_were_written() -> None:
    """By number, name, role and lateness, as runs of that time have them."""
    late = 0.04
    rest = (0, "rest", Role.REST, 0.0)
    wanted = {
        "position-jump": [rest, (1, "stepped", Role.ACTING, 0.0)],
        "bang-bang": [
            rest,
            (2, "middle", Role.ACTING, 0.0),
            (3, "folded", Role.ACTING, 0.0),
            (4, "stretched", Role.ACTING, 0.0),
        ],
        "jump": [
            rest,
            (5, "flight", Role.FLIGHT, 0.0),
            (6, "compress", Role.STANCE, late),
            (7, "push", Role.STANCE, 0.0),
            (8, "release", Role.FLIGHT, 0.0),
        ],
    }

    def told(phases: tuple[PhaseInfo, ...]) -> list[tuple[int, str, Role, float]]:
        return [(phase.code, phase.name, phase.role, phase.late) for phase in phases]

    for kind, phases in wanted.items():
        assert told(built_in(kind, {"touchdown_time": late}).phases) == phases
    unknown = told(built_in("swing", {"touchdown_time": late}).phases)
    every = {phase for phases in wanted.values() for phase in phases}
    assert set(unknown) == every
    assert len(unknown) == len(every)
    assert {phase.late for phase in built_in("jump", {}).phases} == {0.0}


@pytest.mark.parametrize(
    ("kind", "settings", "counting"),
    [
        ("bang-bang", {"dz2": 0.3}, Counting(most=20)),
        ("position-jump", {"dz2": 0.5}, Counting(smallest=0.05)),
        ("position-jump", {"dz2": -0.5}, Counting(smallest=0.05)),
        ("position-jump", {}, Counting()),
        ("position-jump", {"dz2": "inf"}, Counting()),
        ("jump", {"dz2": 0.5}, Counting()),
        ("swing", {"dz2": 0.5}, Counting()),
    ],
)
def test_the_periods_of_format_1_that_count(
    kind: str, settings: dict[str, Any], counting: Counting
) -> None:
    assert built_in(kind, settings).counting == counting


def test_an_old_manifest_without_controller_and_plant_has_none() -> None:
    new = upgraded({"format": 1, "design": DESIGN, "setup": {"kind": "ffs"}, "status": "complete"})
    assert new["experiment"].keys() == {"design", "setup"}
    assert new["controller"]["kind"] == ""
    assert (new["plant"], new["provenance"]) == ({}, {})
    assert (new["format"], new["status"]) == (1, "complete")
    assert "design" not in new
    old = {"format": 1, "design": DESIGN, "setup": {"kind": "ffs"}, "plant": "can", "bus": {"a": 1}}
    assert upgraded(old)["plant"] == {"bus": {"a": 1}}
    assert describe(old).plant == "can"


def test_entries_that_only_one_run_has_are_unlike_and_tables_that_only_one_has_are_not() -> None:
    ours = described(servo={"bandwidth": 30.0, "delay": {"steps": 1}}, ground={"slope": 0.1})
    theirs = described(servo={"bandwidth": 30.0, "delay": {"steps": 2, "more": 1}, "zeta": 0.7})
    wanted = ["servo.delay.more", "servo.delay.steps", "servo.zeta"]
    assert unlike(ours, theirs) == unlike(theirs, ours) == wanted
    other = json.loads(json.dumps(DESIGN))
    other["trunk"]["mass"] += 1.0
    assert unlike(ours, described(design=other)) == ["design.trunk.mass"]


@pytest.mark.parametrize("other", [3.0, "wood", [1]])
def test_a_table_is_unlike_what_is_no_table(other: object) -> None:
    ours, theirs = described(ground={"kind": {"slope": 0.1}}), described(ground={"kind": other})
    assert unlike(ours, theirs) == unlike(theirs, ours) == ["ground.kind"]
    absent = described(ground={})
    assert unlike(ours, absent) == unlike(absent, ours) == ["ground.kind"]
