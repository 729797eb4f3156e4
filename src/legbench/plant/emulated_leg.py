"""The simulated leg as the body of emulated drives."""

from collections.abc import Sequence
from typing import final

import mujoco
import numpy as np

from legbench.design import LegDesign
from legbench.encoders import EncoderErrors
from legbench.errors import PlantFault
from legbench.imperfections import Imperfections
from legbench.mjcf import BuildOptions, bare_model, rest_qpos
from legbench.mjcf.messages import silence
from legbench.plant.backlash import Backlash
from legbench.plant.observe import JointLayout, branch_fault, branch_message, relative
from legbench.plant.start import PERIOD, Start
from legbench.servo import PERFECT

UNSEEN = int(mujoco.mjtDisableBit.mjDSBL_SENSOR)
"""Flag of MuJoCo: no sensors, as drives and springs alone look at this body."""
WHOLE = int(mujoco.mjtDisableBit.mjDSBL_ISLAND)
"""Flag of MuJoCo: no search for parts of the leg that do not touch, as there are none."""


@final
class EmulatedLeg:
    """Body on the drives' shafts: the leg of `SimPlant` whose motors are where the drives put them.

    It moves to the bit as in `SimPlant`, but its model has no sensors, no energy and no shapes but
    those that touch. It rests in its start posture until the drives move. It
    knows nothing of time: one call is one period of `plant.start.PERIOD`. Imperfections of the leg
    and of its encoders are its own; how motors follow their targets is the drives'.

    Attributes:
        data: state of the simulation.
        periods: how many have passed.
        motor_noise: errors of the motor encoders' readings in this period [rad].
    """

    def __init__(
        self,
        design: LegDesign,
        options: BuildOptions,
        start: Start,
        imperfections: Imperfections = PERFECT,
        seed: int = 0,
    ) -> None:
        silence()
        own = imperfections.beyond_motors
        built = own.leg_of(design)
        self._model = model = bare_model(built, options.built(own))
        model.opt.disableflags |= UNSEEN | WHOLE
        model.opt.enableflags &= ~int(mujoco.mjtEnableBit.mjENBL_ENERGY)
        self.data = data = mujoco.MjData(model)
        self._substeps = round(PERIOD / model.opt.timestep)
        self._joints = JointLayout.of(model)
        self._qpos, self._ctrl = data.qpos, data.ctrl
        self._angles, self._rates = (
            relative(self._joints, each) for each in (data.qpos, data.qvel)
        )
        self._backlash = Backlash(own)
        self._zero = own.motor_zero
        self._stiffness = built.stiffness
        self._link_errors = EncoderErrors(own, seed)
        self._link_errors.advance()  # The first reading was that of the start posture.
        self._errors = EncoderErrors(imperfections, seed)
        self.motor_noise: Sequence[float] = (0.0, 0.0)
        self.periods = 0
        self._qpos[:] = rest_qpos(model, design, start.joint_pos)
        self._ctrl[:] = self._shaft(start.motor_pos.tolist())
        mujoco.mj_forward(model, data)

    def __call__(
        self, motor_positions: tuple[float, ...]
    ) -> tuple[Sequence[float], Sequence[float]]:
        """Move one period with the motors there [rad]; link angles [rad], spring torques [N m].

        Raises:
            PlantFault: the simulated leg has come apart.
        """
        try:
            self._advance(self._shaft(motor_positions))
        except mujoco.FatalError as error:
            raise PlantFault("simulation failed", str(error)) from error
        self.periods += 1
        if (cause := branch_fault(self._joints, self._qpos)) is not None:
            raise PlantFault(cause, branch_message(cause, self.periods * PERIOD))
        self._errors.advance()
        self.motor_noise = self._errors.motor.tolist()
        thigh, knee = self._angles.tolist()
        links, ends = (thigh, thigh + knee), self._ctrl.tolist()
        springs = zip(self._stiffness, ends, links, strict=True)
        torques = [stiffness * (end - link) for stiffness, end, link in springs]
        return self._read(links), torques

    def _shaft(self, motor_positions: Sequence[float]) -> Sequence[float]:
        """Return where the shafts are when the encoders count these positions [rad]."""
        if self._zero is None:
            return motor_positions
        return [at + zero for at, zero in zip(motor_positions, self._zero, strict=True)]

    def _advance(self, shaft: Sequence[float]) -> None:
        """Step over one period with the shafts there [rad]."""
        if self._backlash.none:
            self._ctrl[:] = shaft
            mujoco.mj_step(self._model, self.data, self._substeps)
            return
        timestep, shafts = self._model.opt.timestep, np.array(shaft)
        for _ in range(self._substeps):
            joint_pos = np.add.accumulate(self._angles)
            joint_vel = np.add.accumulate(self._rates)
            self._ctrl[:] = self._backlash.flank(shafts, joint_pos, joint_vel, timestep)
            mujoco.mj_step(self._model, self.data)

    def _read(self, links: Sequence[float]) -> Sequence[float]:
        """Link angles as their encoders read them [rad]."""
        errors = self._link_errors
        if errors.exact:
            return links
        errors.advance()
        return [link + error for link, error in zip(links, errors.link.tolist(), strict=True)]
