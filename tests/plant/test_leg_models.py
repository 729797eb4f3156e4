"""What a batch keeps of the model of each of its legs."""

import tracemalloc
from dataclasses import replace

import numpy as np
import pytest
from mujoco import batch
from plants import JUMP, PROTOTYPE, built, family, standing

from legbench.design.setup import Setup, SetupKind
from legbench.errors import ConfigError
from legbench.mjcf import BuildOptions, LinkageKind, bare_model, rest_qpos
from legbench.plant.batch import BatchPlant
from legbench.plant.leg_models import batch_of

DAMPED = BuildOptions(setup=Setup(kind=SetupKind.FFS), guide_damping=(3.0, 4.0))
BOOM = BuildOptions(setup=Setup(kind=SetupKind.FFS, boom_radius=1.2))


@pytest.mark.parametrize(
    "options",
    [built(JUMP), built(JUMP, LinkageKind.REDUCED), DAMPED, BOOM],
    ids=["bars", "reduced", "damped guide", "boom"],
)
def test_each_leg_of_a_batch_runs_on_the_numbers_of_its_own_model(options: BuildOptions) -> None:
    """Every array of MuJoCo's model, one leg with friction and two that are equal."""
    designs = [*family(3), PROTOTYPE, PROTOTYPE]
    legs = [(each, options) for each in designs]
    legs[1] = designs[1], replace(options, friction=(0.02, 0.03))
    posture = standing(designs).joint_pos
    made, model, start = batch_of(legs, designs, posture, threads=1)
    assert np.array_equal(model.body_mass, bare_model(*legs[0]).body_mass)
    for place, (design, its) in enumerate(legs):
        wanted, found = bare_model(design, its, dry=True), made.get_model(place)
        for name in batch.MODEL_FIELDS:
            if "." not in name:
                assert np.array_equal(getattr(found, name), getattr(wanted, name)), (place, name)
        assert found.opt.timestep == wanted.opt.timestep
        assert np.array_equal(start[place], rest_qpos(wanted, design, posture[place]))


def test_a_leg_of_a_batch_keeps_its_own_numbers_only() -> None:
    """MuJoCo's bindings make 60 KiB of Python's arrays a model, none of which may stay."""
    designs = family(12)
    start = standing(designs)
    BatchPlant(designs[:2], built(), standing(designs[:2])).close()
    tracemalloc.start()
    plant = BatchPlant(designs, built(), start, threads=1)
    kept = tracemalloc.get_traced_memory()[0] / len(designs)
    tracemalloc.stop()
    assert not plant.faulted.any()
    assert kept < 10 * 1024


def test_a_leg_with_other_parts_is_refused() -> None:
    designs = family(2)
    legs = [(designs[0], built(JUMP)), (designs[1], built(JUMP, LinkageKind.REDUCED))]
    with pytest.raises(ConfigError, match="leg 1 of the batch has other parts than leg 0"):
        batch_of(legs, designs, standing(designs).joint_pos, threads=1)
