"""One leg in MuJoCo."""

import math
from collections.abc import Callable
from typing import final

import mujoco
import numpy as np

from legbench.design import LegDesign
from legbench.errors import PlantFault
from legbench.mjcf import BuildOptions, model_text, rest_qpos
from legbench.plant.abstract import AbstractPlant
from legbench.plant.observe import LiveArrays, Observer, branch_fault
from legbench.plant.start import PERIOD, Start
from legbench.plant.stepping import PeriodSteps
from legbench.servo import Servo, ServoConfig
from legbench.signals import Command, Floats, Observation


@final
class SimPlant(AbstractPlant):
    """The leg of a design, simulated at 1 kHz with substeps.

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
    ) -> None:
        self.period = PERIOD
        self.xml = model_text(design, options)
        self.model = mujoco.MjModel.from_xml_string(self.xml)
        self.data = mujoco.MjData(self.model)
        substeps = round(PERIOD / self.model.opt.timestep)
        self._steps = PeriodSteps(self.model, self.data, substeps)
        self._start_qpos = rest_qpos(self.model, design, start.joint_pos)
        self._start = start
        self._servo = Servo(servo or ServoConfig(), PERIOD)
        self._arrays = LiveArrays(
            qpos=self.data.qpos,
            qvel=self.data.qvel,
            ctrl=self.data.ctrl,
            sensordata=self.data.sensordata,
            energy=self.data.energy,
        )
        stiffness = np.asarray(design.stiffness)
        self._observer = Observer(self.model, self._arrays, stiffness, self._servo)
        self._cycle = 0

    def reset(self) -> Observation:
        """Put the leg at rest in its start posture."""
        mujoco.mj_resetData(self.model, self.data)
        self._arrays.qpos[:] = self._start_qpos
        self._arrays.ctrl[:] = self._start.motor_pos
        self._servo.reset(self._start.motor_pos)
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
        self._arrays.ctrl[:] = self._servo.follow(command.motor_pos)
        try:
            self._steps.advance()
        except mujoco.FatalError as error:
            raise PlantFault("simulation failed", str(error)) from error
        self._cycle += 1
        if (cause := branch_fault(self._observer.joints, self._arrays.qpos)) is not None:
            raise PlantFault(
                cause,
                f"{cause} at t = {self._cycle * PERIOD:.3f} s: the leg is no longer on the branch "
                "it was assembled on; push less (--dz2) or limit the servo (--slew-rate)",
            )
        return self._observer.look(self._cycle * PERIOD, command.motor_pos)

    def rest(self, motor_pos: Floats, interrupted: Callable[[], bool]) -> None:
        """Leave the simulated leg where it is."""

    def close(self) -> None:
        """Nothing to release."""
