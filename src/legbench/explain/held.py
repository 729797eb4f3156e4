"""Motion of legs whose motors stand still after one step, by the compiled equations."""

from collections.abc import Sequence

import numpy as np

from legbench.analytic import LegModel, Regime
from legbench.analytic.leg_batch import Friction, LegBatch
from legbench.analytic.losses import CREEP
from legbench.control import AbstractController, make_controllers
from legbench.design.setup import SetupKind
from legbench.design.statics import GRAVITY
from legbench.errors import PlantFault
from legbench.experiment import Experiment
from legbench.explain.rating import Rows
from legbench.explain.rows import first_action, measured, targets_of_many
from legbench.imperfections import Imperfections
from legbench.plant.backlash import rest_of
from legbench.plant.start import PERIOD
from legbench.servo import Servo
from legbench.signals import Bools, Command, Floats, Observation

TOLERANCE = 1e-12
"""Error of a step of the integration [-]: far below what a rating shows."""


def move_held(experiment: Experiment, imperfections: Sequence[Imperfections]) -> tuple[Rows, Bools]:
    """Rows of a position jump of many legs, and which of them (n,) came to a joint stop.

    The compiled equations have no stops: rows of a leg that came to one are not its own.
    """
    count, first = len(imperfections), first_action(experiment)
    targets = targets_of_many(experiment, count)
    controller = make_controllers([experiment.controller] * count, targets)
    held = controller.start_motor_pos
    servo = Servo(experiment.servo, PERIOD, imperfections)
    servo.reset(held)
    before = servo.position
    rest = rest_of(targets.designs, targets.support, held, imperfections)
    stepped = _command_after(controller, experiment, before, rest)
    after = servo.follow(stepped.motor_pos)
    rows = round(experiment.duration / PERIOD) - first
    try:
        batch = _batch(experiment, imperfections)
        batch.start(np.concatenate([rest, np.zeros_like(rest)], axis=1))
        path = batch.path(np.arange(rows, dtype=np.float64) * PERIOD, servo.shaft(after))
        outside = batch.outside
    except PlantFault:
        # One leg of them runs away: the arrays, which keep legs apart, tell which.
        path, outside = np.zeros((count, rows, 4)), np.ones(count, dtype=np.bool_)
    motor = np.repeat(after[:, np.newaxis], rows, axis=1)
    motor[:, 0] = before
    return (
        measured(experiment, imperfections, servo, path[..., :2], path[..., 2:], motor),
        outside,
    )


def _command_after(
    controller: AbstractController, experiment: Experiment, motor_pos: Floats, joint_pos: Floats
) -> Command:
    """Command of a position jump from its step on."""
    seen = Observation(
        time=experiment.duration,
        motor_pos=motor_pos,
        joint_pos=joint_pos,
        joint_vel=np.zeros_like(joint_pos),
        spring_torque=np.zeros_like(joint_pos),
        applied_pos=motor_pos,
    )
    return controller.step(seen)


def _batch(experiment: Experiment, imperfections: Sequence[Imperfections]) -> LegBatch:
    kind = experiment.setup.kind
    gravity = 0.0 if kind is SetupKind.HFTS else GRAVITY
    models = [
        LegModel.of(each.leg_of(experiment.design), gravity=gravity) for each in imperfections
    ]
    friction, guide = None, None
    if any(each.coulomb_friction for each in imperfections):
        friction = [
            Friction(torque=each.coulomb_friction or (0.0, 0.0), width=CREEP)
            for each in imperfections
        ]
    if any(each.guide_damping for each in imperfections):
        guide = [each.guide_damping or (0.0, 0.0) for each in imperfections]
    regime = Regime.PINNED if kind is SetupKind.FFS else Regime.HANGING
    return LegBatch(models, regime, friction=friction, guide=guide, tolerance=TOLERANCE)
