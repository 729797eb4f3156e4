"""Steps of a MuJoCo simulation over one control period, with nothing computed twice."""

from typing import final

import mujoco

SKIP = int(mujoco.mjtStage.mjSTAGE_VEL)
"""Last stage that `mj_forwardSkip` leaves out: what follows from positions and velocities."""
RK4_ORDER = 4


@final
class PeriodSteps:
    """Steps of one leg, which leave sensors and energy as those of the new state.

    `mj_step1` computes at the end of a period what follows from positions and velocities, and
    `mj_step` would compute the same again at the beginning of the next. The first step of a period
    goes on from there, to the same bits, unless somebody has changed the state meanwhile.
    """

    def __init__(self, model: mujoco.MjModel, data: mujoco.MjData, substeps: int) -> None:
        """Prepare to step a model that is integrated by the Runge-Kutta method of order 4.

        Args:
            model: the compiled model.
            data: its live state.
            substeps: number of steps in a period.
        """
        self._model, self._data, self._substeps = model, data, substeps
        self._qpos, self._qvel = data.qpos, data.qvel
        self._evaluated: tuple[bytes, bytes] | None = None

    def advance(self) -> None:
        """Step over one period; raises mujoco.FatalError where MuJoCo does."""
        model, data, left = self._model, self._data, self._substeps
        if self._evaluated == (self._qpos.tobytes(), self._qvel.tobytes()):
            mujoco.mj_forwardSkip(model, data, SKIP, 0)
            mujoco.mj_checkAcc(model, data)
            mujoco.mj_RungeKutta(model, data, RK4_ORDER)
            left -= 1
        if left > 0:
            mujoco.mj_step(model, data, left)
        mujoco.mj_step1(model, data)
        self._evaluated = (self._qpos.tobytes(), self._qvel.tobytes())
