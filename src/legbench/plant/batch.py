"""Many legs in step, each with a design of its own, bit-identical to as many single ones."""

import os
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import final

import mujoco
import numpy as np
from mujoco import batch

from legbench.design import LegDesign
from legbench.encoders import EncoderErrors
from legbench.errors import ConfigError
from legbench.imperfections import Imperfections
from legbench.mjcf import BuildOptions
from legbench.mjcf.messages import silence
from legbench.plant.abstract import AbstractPlant
from legbench.plant.backlash import Backlash
from legbench.plant.leg_models import batch_of
from legbench.plant.observe import (
    LiveArrays,
    Observer,
    branch_fault,
    branch_fault_mask,
    branch_message,
)
from legbench.plant.start import PERIOD, Start
from legbench.servo import PERFECT, Servo, ServoConfig
from legbench.signals import Bools, Command, Floats, Observation

NOT_FINITE = "command not finite"
"""Cause of a leg whose command was no number."""
FAILED = "simulation failed"
"""Cause of a leg that MuJoCo could not step."""


@final
class BatchPlant(AbstractPlant):
    """Batch of legs that share setup, linkage, ground and step; all else is each leg's own.

    A leg that faults does not stop the others: it keeps its cause and its cycle, and its
    observations mean nothing from then on.

    Attributes:
        model: the first leg's compiled model, without what can only be seen.
        threads: how many threads step the legs.
        faulted: which legs have left their branch, diverged or had a command that was no
            number (n,).
        causes: cause of each leg's fault, as `SimPlant` names it; None for a leg without one.
        messages: what to tell a user of each fault.
        fault_cycles: number of cycles that each leg was commanded until its fault, that of the
            fault included; -1 for a leg without one.

    Raises:
        ConfigError: no design, or starts, servos, imperfections or seeds that are not one for
            each leg, or a leg that no step suits.
    """

    def __init__(
        self,
        designs: Sequence[LegDesign],
        options: BuildOptions,
        start: Start,
        servo: ServoConfig | Sequence[ServoConfig] | None = None,
        threads: int | None = None,
        imperfections: Sequence[Imperfections] | None = None,
        seeds: Sequence[int] | None = None,
    ) -> None:
        silence()
        count = len(designs)
        flaws = [PERFECT] * count if imperfections is None else list(imperfections)
        chosen = [0] * count if seeds is None else list(seeds)
        servo = ServoConfig() if servo is None else servo
        _check(count, start, servo, flaws, chosen)
        self.period = PERIOD
        built = [each.leg_of(design) for each, design in zip(flaws, designs, strict=True)]
        # Legs in step share the step of the one that needs the finest.
        options = replace(options, numerics=options.numerics.fitted(built, options.linkage))
        legs = [(leg, options.built(each)) for leg, each in zip(built, flaws, strict=True)]
        self.threads = threads or os.cpu_count() or 1
        self._batch, self.model, self._start_qpos = batch_of(
            legs, designs, start.joint_pos, self.threads
        )
        self._start = start
        self._servo = Servo(servo, PERIOD, flaws)
        self._errors, self._backlash = EncoderErrors(flaws, chosen), Backlash(flaws)
        substeps = round(PERIOD / self.model.opt.timestep)
        self._rounds, self._at_once = (1, substeps) if self._backlash.none else (substeps, 1)
        self._arrays = LiveArrays(
            qpos=self._batch.bind("qpos"),
            qvel=self._batch.bind("qvel"),
            ctrl=self._batch.bind("ctrl"),
            sensordata=self._batch.bind("sensordata"),
            energy=self._batch.bind("energy"),
        )
        believed = np.array([design.stiffness for design in designs])
        self._observer = Observer(self.model, self._arrays, believed, self._servo, self._errors)
        self._cycle = 0
        self._forget_faults()

    def reset(self) -> Observation:
        """Put every leg at rest in its start posture."""
        self._batch.reset(stage=int(mujoco.mjtStage.mjSTAGE_NONE))
        self._arrays.qpos[:] = self._start_qpos
        self._servo.reset(self._start.motor_pos)
        self._errors.reset()
        self._arrays.ctrl[:] = self._servo.shaft(self._servo.position)
        self._batch.forward()
        self._cycle = 0
        self._forget_faults()
        return self._observer.look(0.0, self._start.motor_pos)

    def step(self, command: Command) -> Observation:
        """Apply each leg's command over one period of substeps."""
        self._cycle += 1
        self._note(~np.logical_and.reduce(np.isfinite(command.motor_pos), axis=-1), NOT_FINITE)
        shaft = self._servo.shaft(self._servo.follow(command.motor_pos))
        for _ in range(self._rounds):
            self._push(shaft)
            try:
                self._batch.step(nstep=self._at_once, stage=int(mujoco.mjtStage.mjSTAGE_VEL))
            except batch.SimulationError:
                self._note(np.asarray(self._batch.status) != 0, FAILED)
        self._note(branch_fault_mask(self._observer.joints, self._arrays.qpos), None)
        return self._observer.look(self._cycle * PERIOD, command.motor_pos)

    def rest(self, motor_pos: Floats, interrupted: Callable[[], bool]) -> None:
        """Leave the simulated legs where they are."""

    def close(self) -> None:
        """Nothing to release."""

    def _push(self, shaft: Floats) -> None:
        """Put the springs where the shafts (n, 2) [rad] hold them."""
        if self._backlash.none:
            self._arrays.ctrl[:] = shaft
            return
        joint_pos, joint_vel = self._observer.links()
        step = self.model.opt.timestep
        self._arrays.ctrl[:] = self._backlash.flank(shaft, joint_pos, joint_vel, step)

    def _forget_faults(self) -> None:
        count = len(self._start_qpos)
        self.faulted: Bools = np.zeros(count, dtype=np.bool_)
        self.causes: list[str | None] = [None] * count
        self.messages: list[str | None] = [None] * count
        self.fault_cycles = np.full(count, -1, dtype=np.int64)

    def _note(self, faults: Bools, cause: str | None) -> None:
        """Keep the first fault of each leg; without a cause it is that of its posture."""
        new = faults & ~self.faulted
        if not new.any():
            return
        self.faulted = self.faulted | new
        for leg in np.flatnonzero(new).tolist():
            posture = branch_fault(self._observer.joints, self._arrays.qpos[leg])
            named = cause or posture or FAILED
            time = self._cycle * PERIOD
            self.causes[leg] = named
            at = f"{named} at t = {time:.3f} s"
            self.messages[leg] = branch_message(named, time) if cause is None else at
            self.fault_cycles[leg] = self._cycle


def _check(
    count: int,
    start: Start,
    servo: ServoConfig | Sequence[ServoConfig],
    imperfections: Sequence[Imperfections],
    seeds: Sequence[int],
) -> None:
    """Refuse what is not one for each leg."""
    if count == 0:
        raise ConfigError("a batch needs at least one design")
    for what, array in (("posture", start.joint_pos), ("motors", start.motor_pos)):
        if array.shape != (count, 2):
            raise ConfigError(
                f"start {what} has shape {array.shape}; {count} designs need ({count}, 2)"
            )
    servos = count if isinstance(servo, ServoConfig) else len(servo)
    for what, length in (
        ("servos", servos),
        ("imperfections", len(imperfections)),
        ("seeds", len(seeds)),
    ):
        if length != count:
            raise ConfigError(f"{length} {what} for {count} designs; each leg needs one")
