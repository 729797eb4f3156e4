"""Rows of many legs as their encoders show them."""

from collections.abc import Sequence

import numpy as np

from legbench.control import LegTargets
from legbench.experiment import Experiment, targets_of
from legbench.explain.rating import Rows
from legbench.imperfections import Imperfections
from legbench.kinematics import joint_to_modal
from legbench.metrics.changes import rows_before_change
from legbench.metrics.rating import link_equilibrium
from legbench.plant.analytic import STRAIGHT_MARGIN
from legbench.plant.start import PERIOD
from legbench.servo import Servo
from legbench.signals import Floats


def targets_of_many(experiment: Experiment, count: int) -> LegTargets:
    """Set points of so many legs, all of the design that the controller believes."""
    one = targets_of(experiment)
    return LegTargets(
        designs=[experiment.design] * count,
        support=one.support,
        meaning=one.meaning,
        convention=one.convention,
    )


def first_action(experiment: Experiment) -> int:
    """Row of the first control action, which follows a time at rest."""
    times = np.arange(round(experiment.duration / PERIOD)) * PERIOD
    return int(np.searchsorted(times, getattr(experiment.controller, "delay", 0.0)))


def measured(
    experiment: Experiment,
    imperfections: Sequence[Imperfections],
    servo: Servo,
    joint_pos: Floats,
    joint_vel: Floats,
    motor_pos: Floats,
) -> Rows:
    """Rows of many legs as a recording has them, and their deflections.

    A leg that straightens, folds through or runs away is broken; its rows are those of no motion.

    Args:
        experiment: what is done.
        imperfections: of each leg.
        servo: drives of the legs, whose encoders count.
        joint_pos: true link angles (n, t, 2) [rad].
        joint_vel: their rates (n, t, 2) [rad/s].
        motor_pos: positions that the motors' encoders show, uncounted (n, t, 2) [rad].
    """
    convention = experiment.conventions.modal
    with np.errstate(invalid="ignore"):  # infinity less infinity
        knee = joint_pos[..., 1] - joint_pos[..., 0]
    whole = (knee > STRAIGHT_MARGIN) & (knee < np.pi - STRAIGHT_MARGIN)
    whole &= np.isfinite(joint_vel).all(axis=-1)
    kept = np.all(whole, axis=1)[:, np.newaxis, np.newaxis]
    joint_pos, joint_vel = np.where(kept, joint_pos, 0.0), np.where(kept, joint_vel, 0.0)
    zero = np.array([each.link_zero or (0.0, 0.0) for each in imperfections])
    if experiment.servo.encoder_counts is None:
        shown, motors = joint_pos + zero[:, np.newaxis], motor_pos
    else:
        shown = _encoded(servo, joint_pos + zero[:, np.newaxis])
        motors = _encoded(servo, motor_pos)
    support = experiment.setup.support
    flat = motors.reshape(-1, 2)
    equilibrium = link_equilibrium(experiment.design, flat, support).reshape(motors.shape)
    # The leg is at rest until its motors move: such rows are not rated, as in `metrics`.
    rests = np.arange(motors.shape[1]) < rows_before_change(motors)[:, np.newaxis]
    rated = np.where(rests[..., np.newaxis], np.nan, shown)
    return Rows(
        radial=joint_to_modal(shown, convention)[..., 1],
        radial_rate=joint_to_modal(joint_vel, convention)[..., 1],
        about_equilibrium=rated - equilibrium,
        about_motor=rated - motors,
        broken=~kept[:, 0, 0],
    )


def _encoded(servo: Servo, angles: Floats) -> Floats:
    """Angles (n, t, 2) as counts; the servo takes the legs of one instant (n, 2)."""
    return np.stack([servo.encode(row) for row in np.moveaxis(angles, 1, 0)], axis=1)
