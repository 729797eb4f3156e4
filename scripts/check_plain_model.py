"""Step a model of `legbench model --plain` in MJX and MuJoCo Warp, and compare with MuJoCo.

    legbench model --plain --out leg.xml
    python -m venv elsewhere
    elsewhere/bin/pip install mujoco-warp==4.0.0 'jax[cpu]' scipy 'etils[epath]' trimesh
    elsewhere/bin/pip install --no-deps mujoco-mjx==3.17.0
    elsewhere/bin/python scripts/check_plain_model.py leg.xml --engines warp mjx

Both bring a MuJoCo of their own, so that they live in an environment beside the project's; nothing
of legbench is needed there. The last MJX asks for a MuJoCo before 4, hence `--no-deps`. Warp
compiles its kernels at the first call, half a minute of processor time. MJX is not compiled, which
may take longer than all steps: its operations are called one by one, 5 s a step. Exit status 1 if
an engine ends further from MuJoCo than its bound.
"""

import argparse
import importlib.metadata
import sys
from collections.abc import Callable
from pathlib import Path

import mujoco
import numpy as np

PUSH = 0.01
"""Distance of the first joint from the posture that the model's keyframe holds [rad or m]."""
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
    """Joint positions after some steps of MJX in double precision, operation by operation."""
    import jax  # type: ignore  # noqa: PLC0415
    from mujoco import mjx  # type: ignore  # noqa: PLC0415

    jax.config.update("jax_enable_x64", True)
    there, state = mjx.put_model(model), mjx.put_data(model, data)
    with jax.disable_jit():
        for done in range(1, steps + 1):
            state = mjx.step(there, state)
            print(f"\rmjx: {done} of {steps} steps", end="", file=sys.stderr, flush=True)
    print(file=sys.stderr)
    return np.asarray(state.qpos)


def in_warp(model: mujoco.MjModel, data: mujoco.MjData, steps: int) -> np.ndarray:
    """Joint positions after some steps of MuJoCo Warp, in single precision."""
    import mujoco_warp  # type: ignore  # noqa: PLC0415
    import warp  # type: ignore  # noqa: PLC0415

    warp.config.quiet = True
    there, state = mujoco_warp.put_model(model), mujoco_warp.put_data(model, data)
    for _ in range(steps):
        mujoco_warp.step(there, state)
    return state.qpos.numpy()[0].astype(np.float64)


ENGINES: dict[str, tuple[Steps, str, float]] = {
    "mjx": (in_mjx, "mujoco-mjx", 1e-11),
    "warp": (in_warp, "mujoco-warp", 1e-4),
}
"""By name: how an engine steps, its package, and how far it may end from MuJoCo in 100 steps of the
shipped legs [rad or m]: MJX in double, Warp in single precision, whose rounding the
stiff constraint of a pinned foot enlarges a hundredfold (docs/numerics.md)."""


def main() -> int:
    """Print a line for each model and engine; returns the exit status."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("models", nargs="+", type=Path, help="files of legbench model --plain")
    parser.add_argument("--engines", nargs="+", choices=list(ENGINES), default=list(ENGINES))
    parser.add_argument("--steps", type=int, default=100)
    asked = parser.parse_args()
    missed = False
    for path in asked.models:
        model = mujoco.MjModel.from_xml_path(str(path))
        begin = started(model).qpos.copy()
        wanted = in_mujoco(model, started(model), asked.steps)
        for name in asked.engines:
            engine, package, bound = ENGINES[name]
            reached = engine(model, started(model), asked.steps)
            apart = float(np.max(np.abs(reached - wanted)))
            missed |= not apart <= bound
            print(
                f"{path.name}: {package} {importlib.metadata.version(package)} is {apart:.1e} from "
                f"mujoco {mujoco.__version__} after {asked.steps} steps (bound {bound:g}), in "
                f"which the leg moved by {np.max(np.abs(wanted - begin)):.1e} rad or m"
                f"{'; MISSED' if not apart <= bound else ''}",
                flush=True,
            )
    return int(missed)


if __name__ == "__main__":
    sys.exit(main())
