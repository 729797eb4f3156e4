"""An experiment is data: to a file and back, to a run and back, and one name for each."""

import tomllib
from dataclasses import fields, replace
from pathlib import Path
from typing import Any, get_type_hints

import numpy as np
import pytest
from experiments import CONTROLLERS, PLANTS, PROTOTYPE, experiment
from hypothesis import given, settings
from hypothesis import strategies as st

from legbench.control import JumpConfig
from legbench.design.setup import Setup, SetupKind
from legbench.experiment import (
    Experiment,
    canonical_text,
    experiment_hash,
    experiment_text,
    load_experiment,
    record,
    save_experiment,
)
from legbench.experiment.tables import read_tables, write_tables
from legbench.limits.safety import SafetyLimits
from legbench.mjcf import Ground, Linkage, LinkageKind, Numerics
from legbench.plants import SimChoice
from legbench.recording.reader import load
from legbench.servo import ServoConfig

EVERY = pytest.mark.parametrize(
    ("controller", "plant"),
    [(controller, plant) for controller in CONTROLLERS for plant in PLANTS],
)
POSITIVE = st.floats(min_value=0.0, exclude_min=True, allow_nan=False, allow_infinity=False)


@EVERY
def test_a_file_gives_the_same_experiment_back(controller: str, plant: str, tmp_path: Path) -> None:
    chosen = experiment(controller, plant)
    save_experiment(chosen, tmp_path / "one.toml")
    again = load_experiment(tmp_path / "one.toml")
    assert canonical_text(again) == canonical_text(chosen)
    assert experiment_text(again, tmp_path) == experiment_text(chosen, tmp_path)
    if controller != "sine" and plant in ("sim", "limited", "analytic"):
        assert again == chosen


@settings(max_examples=40)
@given(
    z2=st.floats(allow_nan=False),
    duration=st.floats(0.001, 604_800.0),
    slew=st.none() | POSITIVE,
    radius=st.floats(0.5, 1e300),
    seed=st.integers(0, (1 << 63) - 1),
    name=st.text(st.characters(exclude_categories=("Cs",))),
    torque=st.none() | st.floats(1e-300, 50.0),
)
def test_every_value_survives_the_text(
    z2: float,
    duration: float,
    slew: float | None,
    radius: float,
    seed: int,
    name: str,
    torque: float | None,
) -> None:
    limits = None if torque is None else SafetyLimits(spring_torque=torque)
    chosen = Experiment(
        design=replace(PROTOTYPE, name=name),
        controller=JumpConfig(z2=z2),
        setup=Setup(kind=SetupKind.FFS, boom_radius=radius),
        linkage=Linkage(kind=LinkageKind.REDUCED),
        servo=ServoConfig(slew_rate=slew),
        plant=SimChoice(limits=limits),
        duration=duration,
        seed=seed,
    )
    tables = tomllib.loads(experiment_text(chosen))
    again = read_tables(Experiment, tables, Path())
    assert again == chosen
    assert canonical_text(again) == canonical_text(chosen)


def test_a_number_that_is_none_survives_the_text() -> None:
    chosen = replace(experiment("jump", "sim"), controller=JumpConfig(z2=float("nan")))
    again = read_tables(Experiment, tomllib.loads(experiment_text(chosen)), Path())
    assert canonical_text(again) == canonical_text(chosen)


@pytest.mark.parametrize(
    ("controller", "plant"),
    [("jump", plant) for plant in PLANTS] + [(controller, "sim") for controller in CONTROLLERS][1:],
)
def test_a_run_holds_its_experiment_and_gives_the_same_rows_again(
    controller: str, plant: str, tmp_path: Path
) -> None:
    chosen = experiment(controller, plant)
    first = record(chosen, tmp_path / "runs").path
    again = Experiment.from_run(first)
    assert canonical_text(again) == canonical_text(chosen)
    second = record(again, tmp_path / "again").path
    one, two = load(first), load(second)
    assert len(one.time) == 150
    for column, values in one.columns.items():
        if column not in ("cycle_us", "late_us"):
            assert values.tobytes() == two.columns[column].tobytes(), column
    assert Experiment.from_run(second / "run.json").duration == chosen.duration


def test_a_run_keeps_the_wished_and_the_reached_duration(tmp_path: Path) -> None:
    weak = SimChoice(limits=SafetyLimits(command_step=0.01))
    chosen = replace(experiment("jump", "sim", 2.0), plant=weak)
    finished = record(chosen, tmp_path)
    manifest = load(finished.path).manifest
    assert finished.outcome.status == "fault"
    assert manifest["experiment"]["duration"] == 2.0
    assert manifest["duration"] == pytest.approx((finished.outcome.cycles - 1) * 1e-3)


def test_where_an_experiment_runs_is_no_part_of_its_name() -> None:
    chosen = experiment("jump", "can")
    elsewhere = replace(
        chosen,
        # pyrefly: ignore[bad-specialization]
        plant=replace(PLANTS["can"], bus=Path("x.toml"), interface="y", channel="z"),
    )
    assert experiment_hash(elsewhere) == experiment_hash(chosen)
    # pyrefly: ignore[bad-specialization]
    other = replace(chosen, plant=replace(PLANTS["can"], read_only=True))
    assert experiment_hash(other) != experiment_hash(chosen)


@pytest.mark.parametrize(
    "other",
    [
        {"seed": 8},
        {"duration": np.nextafter(0.15, 1.0)},
        {"design": replace(PROTOTYPE, trunk_mass=np.nextafter(PROTOTYPE.trunk_mass, 1.0))},
        {"setup": Setup(kind=SetupKind.FFS)},
        {"ground": Ground(friction=0.5)},
        {"numerics": Numerics(iterations=51)},
        {"servo": ServoConfig(delay_cycles=1)},
        {"controller": JumpConfig(dz2=0.11)},
    ],
    ids=lambda other: next(iter(other)),
)
def test_every_choice_has_a_name_of_its_own(other: dict[str, Any]) -> None:
    chosen = experiment("jump", "sim")
    changed = replace(chosen, **other)
    assert experiment_hash(changed) != experiment_hash(chosen)


def test_an_int_where_a_float_belongs_is_the_same_experiment() -> None:
    one, two = (replace(experiment("jump", "sim"), duration=value) for value in (1, 1.0))
    assert experiment_hash(one) == experiment_hash(two)


def test_what_is_absent_by_default_may_be_absent_from_a_file() -> None:
    """TOML has no null: every `X | None` must have None as its default."""
    kinds: list[Any] = [Experiment, Setup, Linkage, Ground, Numerics, ServoConfig]
    kinds += [type(settings) for settings in (*CONTROLLERS.values(), *PLANTS.values())]
    for kind in kinds:
        hints = get_type_hints(kind)
        for entry in fields(kind):
            if type(None) in getattr(hints[entry.name], "__args__", ()):
                assert entry.default is None, f"{kind.__name__}.{entry.name}"


def test_the_written_design_is_the_design_files() -> None:
    tables = write_tables(experiment("jump", "sim"))
    assert list(tables["design"]["springs"]) == ["stiffness", "damping"]
