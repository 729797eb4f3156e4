"""Steps that compute nothing twice are MuJoCo's own steps, bit for bit."""

from pathlib import Path

import mujoco
import numpy as np
import pytest
from plants import PROTOTYPE, built, standing

from legbench.design.setup import Setup, SetupKind
from legbench.mjcf import LinkageKind, model_text, rest_qpos
from legbench.plant.stepping import PeriodSteps

CYCLES = 400
PUSHED = 200


@pytest.fixture(autouse=True)
def _elsewhere(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """MuJoCo writes its log into the working directory."""
    monkeypatch.chdir(tmp_path)


def seen(data: mujoco.MjData) -> bytes:
    """State, sensors, energy and acceleration."""
    arrays = (data.qpos, data.qvel, data.sensordata, data.energy, data.qacc_warmstart)
    return b"".join(array.tobytes() for array in arrays)


@pytest.mark.parametrize("substeps", [1, 4])
@pytest.mark.parametrize("linkage", LinkageKind)
@pytest.mark.parametrize("kind", [SetupKind.JUMP, SetupKind.FFS])
def test_a_period_is_that_of_mj_step(kind: SetupKind, linkage: LinkageKind, substeps: int) -> None:
    """Hop, and push the leg from outside once, which the steps have to notice."""
    setup = Setup(kind=kind)
    start = standing(PROTOTYPE, setup)
    model = mujoco.MjModel.from_xml_string(model_text(PROTOTYPE, built(setup, linkage)))
    datas = mujoco.MjData(model), mujoco.MjData(model)
    steps = PeriodSteps(model, datas[0], substeps)
    for data in datas:
        data.qpos[:] = rest_qpos(model, PROTOTYPE, start.joint_pos)
        mujoco.mj_forward(model, data)
    fastest = 0.0
    for cycle in range(CYCLES):
        wave = 0.15 * np.sin(0.05 * cycle) * np.array([1.0, -1.0])
        for data in datas:
            data.ctrl[:] = start.motor_pos + wave
            if cycle == PUSHED:
                data.qvel[-1] += 0.5
        steps.advance()
        mujoco.mj_step(model, datas[1], substeps)
        mujoco.mj_step1(model, datas[1])
        assert seen(datas[0]) == seen(datas[1]), cycle
        fastest = max(fastest, float(np.max(np.abs(datas[0].qvel))))
    assert fastest > 0.4


def test_a_change_from_outside_that_is_not_noticed_would_be_seen() -> None:
    """Two periods from the same numbers differ if the second begins from stale positions."""
    start = standing(PROTOTYPE)
    model = mujoco.MjModel.from_xml_string(model_text(PROTOTYPE, built()))
    fresh, stale = mujoco.MjData(model), mujoco.MjData(model)
    for data in (fresh, stale):
        data.qpos[:] = rest_qpos(model, PROTOTYPE, start.joint_pos)
        data.ctrl[:] = start.motor_pos
        mujoco.mj_forward(model, data)
    unaware = PeriodSteps(model, stale, 4)
    for steps in (PeriodSteps(model, fresh, 4), unaware):
        steps.advance()
    for data in (fresh, stale):
        data.qvel[-1] += 0.5
    unaware._evaluated = (stale.qpos.tobytes(), stale.qvel.tobytes())
    unaware.advance()
    mujoco.mj_step(model, fresh, 4)
    assert not np.array_equal(fresh.qpos, stale.qpos)
