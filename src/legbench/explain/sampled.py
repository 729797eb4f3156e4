"""Motion of legs whose motors move cycle by cycle, as arrays: controller, servo, play and stops."""

from collections.abc import Callable, Iterator, Sequence

import numpy as np

from legbench.analytic import LegModel
from legbench.analytic.losses import Losses
from legbench.analytic.many import ManyLegs, advance
from legbench.control import make_controllers
from legbench.design.setup import SetupKind
from legbench.design.statics import GRAVITY
from legbench.experiment import Experiment
from legbench.explain.rating import Rows
from legbench.explain.rows import first_action, measured, targets_of_many
from legbench.imperfections import Imperfections
from legbench.plant.backlash import rest_of
from legbench.plant.start import PERIOD
from legbench.servo import Servo
from legbench.signals import Floats, Observation

FRICTION_PARTS = 4
"""Number of steps in a period where there is dry friction, which is then harder [-]."""
LOOK_EVERY = 250
"""Number of cycles after which it is asked whether to stop [-]."""


def move_sampled(
    experiment: Experiment,
    imperfections: Sequence[Imperfections],
    together: int,
    stopped: Callable[[], bool],
) -> Iterator[Rows]:
    """Rows of an experiment of many legs, `together` legs at a time in their order.

    All legs move in step, by Runge-Kutta steps of a period or less. There are no rows once
    `stopped` says so.
    """
    count, first = len(imperfections), first_action(experiment)
    targets = targets_of_many(experiment, count)
    controller = make_controllers([experiment.controller] * count, targets)
    servo = Servo(experiment.servo, PERIOD, imperfections)
    servo.reset(controller.start_motor_pos)
    rest = rest_of(targets.designs, targets.support, controller.start_motor_pos, imperfections)
    parts = FRICTION_PARTS if any(each.coulomb_friction for each in imperfections) else 1
    legs = many_legs(experiment, imperfections, PERIOD / parts)
    zero = np.array([each.link_zero or (0.0, 0.0) for each in imperfections])
    stiffness = np.asarray(experiment.design.stiffness)
    cycles = round(experiment.duration / PERIOD)
    kept = np.empty((3, cycles - first, count, 2))
    q, v = rest.T.copy(), np.zeros_like(rest.T)
    for cycle in range(cycles):
        if cycle % LOOK_EVERY == 0 and stopped():
            return
        seen = _observation(cycle, servo, q.T + zero, v.T, stiffness)
        if cycle == 0:
            controller.reset(seen)
        if cycle >= first:
            kept[:, cycle - first] = q.T, v.T, servo.position
        shaft = servo.shaft(servo.follow(controller.step(seen).motor_pos))
        for _ in range(parts):
            q, v = advance(legs, (shaft[:, 0], shaft[:, 1]), q, v, PERIOD / parts)
    for begin in range(0, count, together):
        part = slice(begin, begin + together)
        joint_pos, joint_vel, motor_pos = (np.moveaxis(each[:, part], 0, 1) for each in kept)
        yield measured(experiment, imperfections[part], servo, joint_pos, joint_vel, motor_pos)


def many_legs(
    experiment: Experiment, imperfections: Sequence[Imperfections], step: float
) -> ManyLegs:
    """Constants of the legs as they were built and are held, for steps of `step` [s]."""
    kind = experiment.setup.kind
    gravity = 0.0 if kind is SetupKind.HFTS else GRAVITY
    models = [
        LegModel.of(each.leg_of(experiment.design), gravity=gravity, losses=Losses.of(each))
        for each in imperfections
    ]
    return ManyLegs.of(models, standing=kind is SetupKind.FFS, step=step)


def _observation(
    cycle: int, servo: Servo, joint_pos: Floats, joint_vel: Floats, stiffness: Floats
) -> Observation:
    """Observation of the legs before a cycle, as the analytic plant gives it."""
    motor_pos, shown = servo.encode(servo.position), servo.encode(joint_pos)
    return Observation(
        time=cycle * PERIOD,
        motor_pos=motor_pos,
        joint_pos=shown,
        joint_vel=joint_vel,
        spring_torque=stiffness * (motor_pos - shown),
        applied_pos=motor_pos,
    )
