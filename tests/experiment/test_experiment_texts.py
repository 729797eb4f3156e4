"""Golden texts: a name that has been given keeps its meaning, so no field changes unnoticed."""

import hashlib
from dataclasses import replace
from pathlib import Path

import pytest
from experiments import CONTROLLERS, PLANTS, experiment

from legbench.design.setup import Setup, SetupKind
from legbench.experiment import Experiment, canonical_text, experiment_hash, experiment_text
from legbench.servo import ServoConfig

GOLDEN = Path(__file__).parent / "golden"
FULL = replace(
    experiment("position-jump", "sim"),
    setup=Setup(kind=SetupKind.FFS, boom_radius=1.5),
    servo=ServoConfig(slew_rate=5.0, bandwidth=30.0, delay_cycles=2, encoder_counts=4096),
)
CASES = {
    **{controller: experiment(controller, "sim") for controller in CONTROLLERS},
    **{plant: experiment("jump", plant) for plant in PLANTS},
    "full": FULL,
}


@pytest.mark.parametrize(("name", "chosen"), CASES.items(), ids=CASES.keys())
def test_the_canonical_text_is_what_it_always_was(name: str, chosen: Experiment) -> None:
    golden = (GOLDEN / f"{name}.txt").read_text(encoding="utf-8")
    assert canonical_text(chosen) == golden


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


def test_the_hash_is_that_of_the_text() -> None:
    text = (GOLDEN / "full.txt").read_bytes()
    assert experiment_hash(FULL) == hashlib.sha256(text).hexdigest()
