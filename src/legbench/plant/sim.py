"""One leg in MuJoCo."""

import math
from collections.abc import Callable
from typing import final

import mujoco
import numpy as np

from legbench.design import LegDesign
from legbench.encoders import EncoderErrors
from legbench.errors import PlantFault
from legbench.imperfections import Imperfections
from legbench.mjcf import BuildOptions, model_text, rest_qpos
from legbench.mjcf.messages import silence
from legbench.plant.abstract import AbstractPlant
from legbench.plant.backlash import Backlash
from legbench.plant.observe import LiveArrays, Observer, branch_fault, branch_message
from legbench.plant.start import PERIOD, Start
from legbench.plant.stepping import PeriodSteps
from legbench.servo import PERFECT, Servo, ServoConfig
from legbench.signals import Command, Floats, Observation


@final
class SimPlant(AbstractPlant):
    """The leg of a design, simulated at 1 kHz with substeps.

    What is simulated is the leg as it was built, with its imperfections; springs are read as those
    of the design.

    Attributes:
        xml: the MJCF text that was compiled; saved with a run, it is exactly what ran.
        model: the compiled model, for viewers and renderers.
        data: the live simulation state, for viewers and renderers.
    """

    def __init__(
        self,
        design: LegDesign,
        options: BuildOptions,
        start: Start,
        servo: ServoConfig | None = None,
        imperfections: Imperfections = PERFECT,
        seed: int = 0,
    ) -> None:
        silence()
        self.period = PERIOD
        built = imperfections.leg_of(design)
        self.xml = model_text(built, options.built(imperfections))
        self.model = mujoco.MjModel.from_xml_string(self.xml)
        self.data = mujoco.MjData(self.model)
        self._backlash = Backlash(imperfections)
        self._substeps = round(PERIOD / self.model.opt.timestep)
        at_once = self._substeps if self._backlash.none else 1
        self._steps = PeriodSteps(self.model, self.data, at_once)
        self._start_qpos = rest_qpos(self.model, design, start.joint_pos)
        self._start = start
        self._servo = Servo(servo or ServoConfig(), PERIOD, imperfections)
        self._errors = EncoderErrors(imperfections, seed)
        self._arrays = LiveArrays(
            qpos=self.data.qpos,
            qvel=self.data.qvel,
            ctrl=self.data.ctrl,
            sensordata=self.data.sensordata,
            energy=self.data.energy,
        )
        self._stiffness = np.asarray(built.stiffness)
        believed = np.asarray(design.stiffness)
        self._observer = Observer(self.model, self._arrays, believed, self._servo, self._errors)
        self._cycle = 0

    def reset(self) -> Observation:
        """Put the leg at rest in its start posture."""
        mujoco.mj_resetData(self.model, self.data)
        self._arrays.qpos[:] = self._start_qpos
        self._servo.reset(self._start.motor_pos)
        self._errors.reset()
        self._arrays.ctrl[:] = self._servo.shaft(self._servo.position)
        mujoco.mj_forward(self.model, self.data)
        self._cycle = 0
        return self._observer.look(0.0, self._start.motor_pos)

    def step(self, command: Command) -> Observation:
        """Apply a command over one period of substeps.

        Raises:
            PlantFault: the command is not finite, the simulation diverged, or the leg left its
                branch: it straightened or folded through, or a bar loop crossed.
        """
        if not math.hypot(*command.motor_pos.tolist()) < math.inf:
            raise PlantFault(
                "command not finite",
                f"commanded motor positions are {command.motor_pos} rad at t = "
                f"{self._cycle * PERIOD:.3f} s; the controller must give finite numbers",
            )
        shaft = self._servo.shaft(self._servo.follow(command.motor_pos))
        try:
            self._advance(shaft)
        except mujoco.FatalError as error:
            raise PlantFault("simulation failed", str(error)) from error
        self._cycle += 1
        if (cause := branch_fault(self._observer.joints, self._arrays.qpos)) is not None:
            raise PlantFault(cause, branch_message(cause, self._cycle * PERIOD))
        return self._observer.look(self._cycle * PERIOD, command.motor_pos)

    def _advance(self, shaft: Floats) -> None:
        """Step over one period with the shafts at (2,) [rad]."""
        if self._backlash.none:
            self._arrays.ctrl[:] = shaft
            self._steps.advance()
            return
        timestep = self.model.opt.timestep
        for _ in range(self._substeps):
            joint_pos, joint_vel = self._observer.links()
            self._arrays.ctrl[:] = self._backlash.flank(shaft, joint_pos, joint_vel, timestep)
            self._steps.advance()

    def spring_torque(self) -> Floats:
        """Return the true torques of the springs on the links at this instant (2,) [N m]."""
        joint_pos, _ = self._observer.links()
        return self._stiffness * (self._arrays.ctrl - joint_pos)

    def rest(self, motor_pos: Floats, interrupted: Callable[[], bool]) -> None:
        """Leave the simulated leg where it is."""

    def close(self) -> None:
        """Nothing to release."""
