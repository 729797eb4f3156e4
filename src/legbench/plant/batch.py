"""Many legs in step, each with a design of its own, bit-identical to as many single ones."""

import os
from collections.abc import Callable, Sequence
from typing import final

import mujoco
import numpy as np
from mujoco import batch

from legbench.design import LegDesign
from legbench.encoders import EncoderErrors
from legbench.errors import ConfigError
from legbench.mjcf import BuildOptions, build_spec, rest_qpos, to_xml
from legbench.plant.abstract import AbstractPlant
from legbench.plant.observe import LiveArrays, Observer, branch_fault_mask
from legbench.plant.start import PERIOD, Start
from legbench.servo import PERFECT, Servo, ServoConfig
from legbench.signals import Bools, Command, Floats, Observation


@final
class BatchPlant(AbstractPlant):
    """Batch of legs that differ in design but share setup, linkage and servo.

    A leg that leaves its branch does not stop the others: it is marked in `faulted` and its
    observations mean nothing from then on.

    Attributes:
        model: the first leg's compiled model.
        threads: how many threads step the legs.
        faulted: which legs have left their branch, diverged or had a command that was no
            number (n,).

    Raises:
        ConfigError: no design, or a start that is not one row a leg.
    """

    def __init__(
        self,
        designs: Sequence[LegDesign],
        options: BuildOptions,
        start: Start,
        servo: ServoConfig | None = None,
        threads: int | None = None,
    ) -> None:
        if not designs:
            raise ConfigError("a batch needs at least one design")
        for what, array in (("posture", start.joint_pos), ("motors", start.motor_pos)):
            if array.shape != (len(designs), 2):
                raise ConfigError(
                    f"start {what} has shape {array.shape}; {len(designs)} designs need "
                    f"({len(designs)}, 2)"
                )
        self.period = PERIOD
        models = _models(designs, options)
        self.model = models[0]
        self.threads = threads or os.cpu_count() or 1
        self._batch = batch.Batch(models[0], nsim=len(models), nthread=self.threads)
        self._batch.set_models(models)
        self._substeps = round(PERIOD / models[0].opt.timestep)
        self._start = start
        self._start_qpos = np.array(
            [
                rest_qpos(model, design, posture)
                for model, design, posture in zip(models, designs, start.joint_pos, strict=True)
            ]
        )
        self._servo = Servo(servo or ServoConfig(), PERIOD)
        self._arrays = LiveArrays(
            qpos=self._batch.bind("qpos"),
            qvel=self._batch.bind("qvel"),
            ctrl=self._batch.bind("ctrl"),
            sensordata=self._batch.bind("sensordata"),
            energy=self._batch.bind("energy"),
        )
        stiffness = np.array([design.stiffness for design in designs])
        self._observer = Observer(
            models[0], self._arrays, stiffness, self._servo, EncoderErrors(PERFECT)
        )
        self.faulted: Bools = np.zeros(len(designs), dtype=np.bool_)
        self._cycle = 0

    def reset(self) -> Observation:
        """Put every leg at rest in its start posture."""
        self._batch.reset(stage=int(mujoco.mjtStage.mjSTAGE_NONE))
        self._arrays.qpos[:] = self._start_qpos
        self._arrays.ctrl[:] = self._start.motor_pos
        self._servo.reset(self._start.motor_pos)
        self._batch.forward()
        self.faulted = np.zeros(len(self._start_qpos), dtype=np.bool_)
        self._cycle = 0
        return self._observer.look(0.0, self._start.motor_pos)

    def step(self, command: Command) -> Observation:
        """Apply each leg's command over one period of substeps."""
        self.faulted = self.faulted | ~np.isfinite(command.motor_pos).all(axis=-1)
        self._arrays.ctrl[:] = self._servo.follow(command.motor_pos)
        try:
            self._batch.step(nstep=self._substeps, stage=int(mujoco.mjtStage.mjSTAGE_VEL))
        except batch.SimulationError:
            self.faulted |= np.asarray(self._batch.status) != 0
        self._cycle += 1
        self.faulted |= branch_fault_mask(self._observer.joints, self._arrays.qpos)
        return self._observer.look(self._cycle * PERIOD, command.motor_pos)

    def rest(self, motor_pos: Floats, interrupted: Callable[[], bool]) -> None:
        """Leave the simulated legs where they are."""

    def close(self) -> None:
        """Nothing to release."""


def _models(designs: Sequence[LegDesign], options: BuildOptions) -> list[mujoco.MjModel]:
    """Compiled model of each leg; equal designs share one."""
    compiled: dict[LegDesign, mujoco.MjModel] = {}
    for design in designs:
        if design not in compiled:
            xml = to_xml(build_spec(design, options))
            compiled[design] = mujoco.MjModel.from_xml_string(xml)
    return [compiled[design] for design in designs]
