"""Models for other engines: nothing that they refuse, and every step as with it."""

import mujoco
import numpy as np
import pytest

from legbench import load_design
from legbench.design.setup import Setup, SetupKind
from legbench.mjcf import BuildOptions, build_spec
from legbench.mjcf.plain import plain_xml


@pytest.mark.parametrize("kind", list(SetupKind))
def test_a_plain_model_moves_to_the_bit_as_the_whole_one(kind: SetupKind) -> None:
    spec = build_spec(load_design("prototype"), BuildOptions(setup=Setup(kind=kind)))
    text = plain_xml(spec)
    assert "<contact " not in text
    assert "energy=" not in text
    assert "autoreset" not in text
    models = spec.compile(), mujoco.MjModel.from_xml_string(text)
    data = [mujoco.MjData(model) for model in models]
    for model, state in zip(models, data, strict=True):
        mujoco.mj_resetDataKeyframe(model, state, 0)
        state.qpos[0] += 0.01
        mujoco.mj_step(model, state, nstep=200)
    assert np.array_equal(data[0].qpos, data[1].qpos)
    assert np.array_equal(data[0].qvel, data[1].qvel)
    assert np.any(data[0].qvel != 0.0)
