"""How the model is integrated and how hard its constraints are; all of it is written out.

Ordinary settings dissipate: with the default solref a released undamped leg loses most of its
energy within a second through the closed loops. RK4 and a time constant of one step, without
MuJoCo's guard of two, keep it.
"""

import math
from dataclasses import dataclass

import mujoco

from legbench.errors import ConfigError


def _whole(value: float) -> bool:
    return value > 0.5 and abs(value - round(value)) < 1e-9 * value


@dataclass(frozen=True, slots=True, kw_only=True)
class Numerics:
    """Integrator, solver and constraint settings.

    Raises:
        ConfigError: a time step that does not divide the 1 ms control period.
    """

    timestep: float = 0.00025
    """[s]"""
    loop_solref: tuple[float, float] = (0.00025, 1.0)
    """Time constant [s] and damping ratio of loop closures, foot pin and joint equality."""
    loop_solimp: tuple[float, float, float, float, float] = (0.9999, 0.9999, 0.001, 0.5, 2.0)
    contact_solref: tuple[float, float] = (0.001, 1.0)
    contact_solimp: tuple[float, float, float, float, float] = (0.9, 0.95, 0.001, 0.5, 2.0)
    stop_solref: tuple[float, float] = (0.01, 1.0)
    """Joint stops: soft rubber, as `legbench.analytic.stops`."""
    stop_solimp: tuple[float, float, float, float, float] = (0.95, 0.95, 0.001, 0.5, 2.0)
    iterations: int = 50
    tolerance: float = 1e-12

    def __post_init__(self) -> None:
        if not (0.0 < self.timestep < math.inf and _whole(0.001 / self.timestep)):
            raise ConfigError(
                f"timestep is {self.timestep:g} s; it must divide the control period of 0.001 s"
            )

    def apply(self, spec: mujoco.MjSpec) -> None:
        """Write the options into a spec."""
        option = spec.option
        option.integrator = mujoco.mjtIntegrator.mjINT_RK4
        option.timestep = self.timestep
        option.cone = mujoco.mjtCone.mjCONE_ELLIPTIC
        option.solver = mujoco.mjtSolver.mjSOL_NEWTON
        option.iterations = self.iterations
        option.tolerance = self.tolerance
        option.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_REFSAFE)
        option.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_AUTORESET)
