"""Golden texts: a name that has been given keeps its meaning, so no field changes unnoticed."""

import hashlib
from dataclasses import replace
from pathlib import Path

import pytest
from experiments import CONTROLLERS, PLANTS, experiment

from legbench.design.setup import Setup, SetupKind
from legbench.errors import ConfigError
from legbench.experiment import (
    Experiment,
    canonical_text,
    experiment_hash,
    experiment_text,
    load_experiment,
    save_experiment,
)
from legbench.imperfections import Imperfections
from legbench.mjcf import Linkage, Numerics
from legbench.servo import ServoConfig

GOLDEN = Path(__file__).parent / "golden"
MODELS = Path(__file__).parents[2] / "models"
FULL = replace(
    experiment("position-jump", "sim"),
    setup=Setup(kind=SetupKind.FFS, boom_radius=1.5),
    linkage=Linkage(bar_density=0.006),
    numerics=Numerics(timestep=0.00025, loop_solref=(0.00025, 1.0)),
    servo=ServoConfig(slew_rate=5.0, bandwidth=30.0, delay_cycles=2, encoder_counts=4096),
)
CASES = {
    **{controller: experiment(controller, "sim") for controller in CONTROLLERS},
    **{plant: experiment("jump", plant) for plant in PLANTS},
    "full": FULL,
    "imperfect": replace(
        experiment("position-jump", "sim"),
        imperfections=Imperfections(
            stiffness_error=(0.04, -0.02),
            damping_error=(0.5, 0.0),
            trunk_mass_error=0.01,
            mass_error=(0.1, 0.0, -0.1),
            com_error=(0.001, 0.0, 0.002),
            inertia_error=(0.0, 0.2, 0.0),
            coulomb_friction=(0.01, 0.006),
            backlash=(0.01, 0.02),
            guide_damping=(1.0, 0.5),
            link_zero=(0.02, -0.01),
            motor_zero=(0.0, 0.01),
            link_noise=(0.001, 0.001),
            motor_noise=(0.0005, 0.0005),
            motor_slew_rate=(20.0, 9.0),
            motor_delay_cycles=(2, 0),
            motor_range=((-1.0, -0.25), (0.0, 2.0)),
        ),
    ),
}


@pytest.mark.parametrize(("name", "chosen"), CASES.items(), ids=CASES.keys())
def test_the_canonical_text_is_what_it_always_was(name: str, chosen: Experiment) -> None:
    golden = (GOLDEN / f"{name}.txt").read_text(encoding="utf-8")
    assert canonical_text(chosen) == golden


def test_what_format_1_left_unsaid_keeps_its_meaning(tmp_path: Path) -> None:
    """Format 1 had one step, one bar and one reference for every leg; format 2 fits them."""
    old, new = tmp_path / "old.toml", tmp_path / "new.toml"
    design = MODELS / "optimal.toml"
    rest = f'design = "{design}"\ncontroller.kind = "jump"\n'
    old.write_text(f"format = 1\n{rest}", encoding="utf-8")
    new.write_text(f"format = 2\n{rest}", encoding="utf-8")
    before, now = load_experiment(old), load_experiment(new)
    assert before.numerics == Numerics(timestep=0.00025, loop_solref=(0.00025, 1.0))
    assert before.linkage == Linkage(bar_density=0.006)
    assert before.conventions.rating_reference == "motor"
    assert (now.numerics, now.linkage) == (Numerics(), Linkage())
    assert now.conventions.rating_reference == "setup"
    old.write_text(f"format = 1\n{rest}numerics.timestep = 0.0005\n", encoding="utf-8")
    assert load_experiment(old).numerics.timestep == 0.0005
    old.write_text(f"format = 1\n{rest}numerics = 3\n", encoding="utf-8")
    with pytest.raises(ConfigError, match="numerics"):
        load_experiment(old)


def test_the_file_says_units() -> None:
    text = experiment_text(FULL)
    for line in (
        "duration = 0.15  # [s]",
        "stiffness = [2.3, 2.3]  # [N m/rad]",
        "slew_rate = 5.0  # [rad/s]",
        "z2 = 0.9  # [rad]",
        "timestep = 0.00025  # [s]",
    ):
        assert f"\n{line}\n" in text


def test_what_is_perfect_is_not_said() -> None:
    assert "imperfections" not in canonical_text(FULL)
    assert "imperfections" not in experiment_text(FULL)
    text = experiment_text(CASES["imperfect"])
    assert "\n[imperfections]\n" in text
    assert "\nbacklash = [0.01, 0.02]  # [rad]\n" in text


def test_a_file_holds_imperfections_bit_for_bit(tmp_path: Path) -> None:
    path = tmp_path / "imperfect.toml"
    save_experiment(CASES["imperfect"], path)
    assert load_experiment(path) == CASES["imperfect"]


def test_the_hash_is_that_of_the_text() -> None:
    text = (GOLDEN / "full.txt").read_bytes()
    assert experiment_hash(FULL) == hashlib.sha256(text).hexdigest()
