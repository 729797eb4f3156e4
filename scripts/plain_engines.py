"""The other side of `check_plain.py`: steps models in each engine that is there.

PYTHON scripts/plain_engines.py FOLDER STEPS

Prints a line of JSON for each model and engine: the largest difference of a joint position from
MuJoCo's, and by how much the model moved.
"""

import json
import sys
from collections.abc import Callable
from pathlib import Path

import mujoco
import numpy as np

PUSH = 0.01
"""Distance of the start from the posture that the model's keyframe holds [rad, m]."""
Steps = Callable[[mujoco.MjModel, mujoco.MjData, int], np.ndarray]


def started(model: mujoco.MjModel) -> mujoco.MjData:
    """State of the first keyframe, its first joint moved aside."""
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, 0)
    data.qpos[0] += PUSH
    mujoco.mj_forward(model, data)
    return data


def in_mujoco(model: mujoco.MjModel, data: mujoco.MjData, steps: int) -> np.ndarray:
    """Joint positions after some steps of MuJoCo."""
    mujoco.mj_step(model, data, nstep=steps)
    return data.qpos.copy()


def in_mjx(model: mujoco.MjModel, data: mujoco.MjData, steps: int) -> np.ndarray:
    """Joint positions after some steps of MJX in double precision."""
    import jax  # type: ignore[import-not-found]  # noqa: PLC0415
    from mujoco import mjx  # type: ignore  # noqa: PLC0415

    jax.config.update("jax_enable_x64", True)
    there, state = mjx.put_model(model), mjx.put_data(model, data)
    step = jax.jit(mjx.step)
    for _ in range(steps):
        state = step(there, state)
    return np.asarray(state.qpos)


def in_warp(model: mujoco.MjModel, data: mujoco.MjData, steps: int) -> np.ndarray:
    """Joint positions after some steps of MuJoCo Warp, in single precision."""
    import mujoco_warp as mjw  # type: ignore[import-not-found]  # noqa: PLC0415

    there, state = mjw.put_model(model), mjw.put_data(model, data)
    for _ in range(steps):
        mjw.step(there, state)
    return state.qpos.numpy()[0].astype(np.float64)


ENGINES: dict[str, Steps] = {"MJX": in_mjx, "MuJoCo Warp": in_warp}


def main() -> None:
    """Step every model of the folder in every engine."""
    folder, steps = Path(sys.argv[1]), int(sys.argv[2])
    for name, engine in ENGINES.items():
        for path in sorted(folder.glob("*.xml")):
            model = mujoco.MjModel.from_xml_path(str(path))
            begin = started(model).qpos.copy()
            wanted = in_mujoco(model, started(model), steps)
            try:
                reached = engine(model, started(model), steps)
            except ImportError as error:
                print(json.dumps({"engine": name, "refused": str(error)}))
                break
            except (NotImplementedError, ValueError) as error:
                print(json.dumps({"engine": name, "model": path.stem, "refused": str(error)}))
                continue
            found = {
                "engine": name,
                "model": path.stem,
                "difference": float(np.max(np.abs(reached - wanted))),
                "moved": float(np.max(np.abs(wanted - begin))),
            }
            print(json.dumps(found), flush=True)


if __name__ == "__main__":
    main()
