"""How the model is integrated and how hard its constraints are; all of it is written out.

Ordinary settings dissipate: with the default solref a released undamped leg loses most of its
energy within a second through the closed loops. RK4 and a time constant of one step, without
MuJoCo's guard of two, keep it.
"""

import mujoco

from legbench.mjcf.options import Numerics


def apply_numerics(spec: mujoco.MjSpec, numerics: Numerics) -> None:
    """Write the options into a spec; step and loop closure are those of `Numerics.fitted`."""
    option = spec.option
    option.integrator = mujoco.mjtIntegrator.mjINT_RK4
    if numerics.timestep is not None:
        option.timestep = numerics.timestep
    option.cone = mujoco.mjtCone.mjCONE_ELLIPTIC
    option.solver = mujoco.mjtSolver.mjSOL_NEWTON
    option.iterations = numerics.iterations
    option.tolerance = numerics.tolerance
    option.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_REFSAFE)
    option.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_AUTORESET)
