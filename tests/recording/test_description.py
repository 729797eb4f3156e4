"""`run.json` as one typed value: what is written comes back, what makes no sense is named."""

import json
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from recorded_rows import append_rows

from legbench.design.setup import Setup, SetupKind
from legbench.design.toml import design_to_mapping, load_design
from legbench.errors import FormatError
from legbench.imperfections import Imperfections
from legbench.kinematics import ModalConvention
from legbench.phases import ControllerDescription, Counting, PhaseInfo, Role
from legbench.recording.controller_table import controller_table
from legbench.recording.description import InitialState, Reference, describe
from legbench.recording.imperfections_table import parse_imperfections
from legbench.recording.reader import load
from legbench.recording.unlike import unlike
from legbench.recording.writer import RunWriter
from legbench.signals import Signal

DESIGN = load_design(Path(__file__).parents[2] / "models" / "prototype.toml")
GUEST = ControllerDescription(
    phases=(
        PhaseInfo(code=0, name="wait", role=Role.REST, doc="before anything"),
        PhaseInfo(code=3, name="load", role=Role.STANCE, late=0.02),
        PhaseInfo(code=127, name="fly", role=Role.FLIGHT),
    ),
    signals=(
        Signal("target", ("hip", "knee"), "rad", "set point"),
        Signal("gain", (), "N m/rad", "stiffness"),
    ),
    counting=Counting(most=7, smallest=0.01),
)
EXPERIMENT = {
    "design": design_to_mapping(DESIGN),
    "setup": {"kind": "ffs", "boom_radius": 1.5},
    "linkage": {"kind": "bars", "crank_length": 0.03},
    "controller": {"kind": "mine", "settings": {"z2": 0.5, "freq": 2.0}},
    "plant": {"kind": "sim"},
    "conventions": {"modal": "literal", "setpoint": "link", "rating_reference": "equilibrium"},
    "duration": 8.0,
    "seed": 4,
}
GIVEN: dict[str, Any] = {
    "experiment": EXPERIMENT,
    "controller": controller_table("mine", GUEST),
    "provenance": {"mjcf_sha256": "ab12", "versions": {"mujoco-core": "4.0"}},
    "plant": {"kind": "sim", "limits": {"command_speed": 5.0}},
    "period": 0.001,
    "initial_state": {"joint_pos": [-0.5, 0.5], "motor_pos": [-0.4, 0.6]},
}


@pytest.fixture
def run(tmp_path: Path) -> Path:
    with RunWriter.create(tmp_path, GIVEN) as writer:
        append_rows(writer, 60)
        writer.close("fault", "leg crossed")
    return writer.path


def test_what_is_written_comes_back_typed(run: Path) -> None:
    found = load(run).description
    assert (found.design, found.setup) == (DESIGN, Setup(kind=SetupKind.FFS, boom_radius=1.5))
    assert (found.controller, found.phases, found.counting) == (
        "mine",
        GUEST.phases,
        GUEST.counting,
    )
    assert found.layout.own == GUEST.signals
    assert (found.convention, found.reference) == (ModalConvention.LITERAL, Reference.EQUILIBRIUM)
    assert (found.title, found.crank_length) == ("sim / bars / prototype", 0.03)
    assert (found.z2, found.dz2) == (0.5, None)
    assert (found.status, found.cause, found.rows) == ("fault", "leg crossed", 60)
    assert found.duration == pytest.approx(0.059)
    assert (found.planned_duration, found.period) == (8.0, 0.001)
    assert found.initial_state == InitialState(joint_pos=(-0.5, 0.5), motor_pos=(-0.4, 0.6))
    assert (found.id, found.model_hash) == (run.name, "ab12")
    assert {"python", "numpy", "pyarrow", "mujoco-core"} == found.versions.keys()
    assert found.experiment == EXPERIMENT
    assert not found.complete


@pytest.mark.parametrize("kind", list(SetupKind))
def test_a_run_that_asks_for_none_is_rated_by_the_reference_of_its_setup(kind: SetupKind) -> None:
    setup = {"kind": str(kind)}
    suits = Reference.MOTOR if kind is SetupKind.JUMP else Reference.EQUILIBRIUM
    for asked, reference in (
        (None, suits),
        ("setup", suits),
        ("motor", Reference.MOTOR),
        ("equilibrium", Reference.EQUILIBRIUM),
    ):
        conventions = {} if asked is None else {"rating_reference": asked}
        told = EXPERIMENT | {"setup": setup, "conventions": conventions}
        assert describe(GIVEN | {"experiment": told}).reference is reference


def test_own_signals_of_a_described_run_are_read_by_name(run: Path) -> None:
    recording = load(run)
    assert recording["target"].shape == (60, 2)
    assert recording.signals[-2:] == ("target", "gain")


def test_the_samples_carry_the_description(run: Path) -> None:
    (run / "run.json").rename(run.parent / "lost.json")
    assert load(run).description.phases == GUEST.phases


def test_keys_of_a_later_version_are_left_alone() -> None:
    """The format rises when an older reader would misread a run, so other keys are additions."""
    later = json.loads(json.dumps(GIVEN))
    later["weather"] = "dry"
    later["experiment"]["setup"]["surface"] = "sand"
    later["controller"]["phases"][0]["colour"] = "red"
    assert replace(describe(later), experiment={}) == replace(describe(GIVEN), experiment={})


def changed(path: str, value: Any) -> dict[str, Any]:
    """The manifest with one entry replaced."""
    manifest = json.loads(json.dumps(GIVEN))
    *tables, key = path.split("/")
    table = manifest
    for name in tables:
        table = table[int(name)] if isinstance(table, list) else table[name]
    table[key] = value
    return manifest


@pytest.mark.parametrize(
    ("path", "value", "message"),
    [
        ("experiment", [1], r"experiment is \[1\]; it must be a table"),
        ("experiment/design", {}, r"manifest design: \[trunk\] is missing"),
        ("experiment/setup/kind", "moon", "setup.kind is 'moon'; known are hfts, vfts, ffs, jump"),
        ("experiment/setup/boom_radius", -1.0, "setup: boom_radius is -1 m"),
        ("experiment/setup/boom_radius", True, "setup.boom_radius is True; it must be a number"),
        (
            "experiment/conventions/modal",
            "unit",
            "conventions.modal is 'unit'; known are ortho",
        ),
        ("experiment/duration", "long", "duration is 'long'; it must be a number"),
        ("status", 3, "status is 3; it must be a text"),
        ("rows", 1.5, "rows is 1.5; it must be a whole number"),
        ("initial_state/joint_pos", [1.0], r"joint_pos is \[1.0\]; it must be two numbers"),
        ("controller/phases", {}, "controller.phases is {}; it must be a list of tables"),
        ("controller/phases/0/role", "idle", r"phases\[0\].role is 'idle'; known are rest, acting"),
        ("controller/phases/1/code", 300, "phase 'load' has code 300; a recording holds 0 to 127"),
        ("controller/phases/1/code", 0, "two phases of a controller share a code"),
        ("controller/phases/1/late", "nan", "phase 'load' is told nan s late"),
        ("controller/phases/1/name", None, r"phases\[1\].name is None; it must be a text"),
        ("controller/signals/1/name", "phase", "is called phase, which every run has"),
        ("controller/signals/0/components", "xy", "components is 'xy'; it must be a list of texts"),
        ("controller/counting/most", "all", "counting.most is 'all'; it must be a number"),
    ],
)
def test_what_makes_no_sense_is_named(path: str, value: Any, message: str) -> None:
    with pytest.raises(FormatError, match=message):
        describe(changed(path, value))


def test_rows_of_a_run_that_describes_nothing_can_be_read(tmp_path: Path) -> None:
    with RunWriter.create(tmp_path, {"experiment": {"design": {}}}) as writer:
        append_rows(writer, 20)
    run = load(writer.path)
    assert run.complete
    assert run["joint_pos"].shape == (20, 2)
    for _ in range(2):
        with pytest.raises(FormatError, match=r"manifest design: \[trunk\] is missing"):
            assert run.description


def test_a_manifest_with_signals_that_no_run_can_have_writes_nothing(tmp_path: Path) -> None:
    with pytest.raises(FormatError, match="is called phase"):
        RunWriter.create(tmp_path, changed("controller/signals/1/name", "phase"))
    assert list(tmp_path.iterdir()) == []


def test_runs_differ_by_the_entries_of_their_experiments() -> None:
    ours = describe(GIVEN)
    assert unlike(ours, ours) == []
    theirs = describe(changed("experiment/controller/settings/freq", 3.0))
    assert unlike(ours, theirs) == ["controller.settings.freq"]
    # Plant, linkage and duration are what runs of one experiment are compared over.
    for entry in ("plant/kind", "linkage/crank_length", "duration"):
        value = "can" if entry == "plant/kind" else 2.0
        assert unlike(ours, describe(changed(f"experiment/{entry}", value))) == []


def test_a_run_says_its_imperfections() -> None:
    assert describe(GIVEN).imperfections.perfect
    said = {"trunk_mass_error": 0.1, "link_zero": [0.01, 0], "motor_range": [[-1, 1], [0, 2.5]]}
    found = describe(GIVEN | {"experiment": EXPERIMENT | {"imperfections": said}}).imperfections
    assert found == Imperfections(
        trunk_mass_error=0.1, link_zero=(0.01, 0.0), motor_range=((-1.0, 1.0), (0.0, 2.5))
    )


@pytest.mark.parametrize(
    ("names", "fits", "shape"),
    [
        (("trunk_mass_error",), 0.1, "()"),
        (("mass_error", "com_error", "inertia_error"), [0.01, 0.02, 0.03], "(3,)"),
        (("stiffness_error", "coulomb_friction", "motor_noise"), [0.01, 0.02], "(2,)"),
        (("motor_range",), [[-1.0, 1.0], [0.0, 2.0]], "(2, 2)"),
    ],
)
def test_an_imperfection_has_as_many_numbers_as_it_has_places(
    names: tuple[str, ...], fits: Any, shape: str
) -> None:
    sound = {"backlash": [0.0, 0.01]}
    for name in names:
        found = getattr(parse_imperfections(sound | {name: fits}), name)
        np.testing.assert_array_equal(found, fits)
        # A list around them, and one entry more; the entry before it is sound.
        for other in ([fits], [*fits, fits[0]] if isinstance(fits, list) else "0.1"):
            with pytest.raises(FormatError, match=rf"{name} is .* of shape {re.escape(shape)}"):
                parse_imperfections(sound | {name: other})


@pytest.mark.parametrize(
    ("said", "message"),
    [
        ({"zero": 1}, "manifest imperfections: unknown zero; known are stiffness_error,"),
        ({"link_zero": [1.0]}, r"imperfections.link_zero is \[1.0\]; it must be numbers of shape"),
        ({"link_zero": ["a", 1.0]}, "it must be numbers of shape"),
        ({"motor_range": [[0, 1], [1]]}, "it must be numbers of shape"),
        ({"backlash": [-1, 0]}, "manifest imperfections: backlash is"),
    ],
)
def test_imperfections_that_no_leg_can_have(said: dict[str, Any], message: str) -> None:
    with pytest.raises(FormatError, match=message):
        describe(GIVEN | {"experiment": EXPERIMENT | {"imperfections": said}})
