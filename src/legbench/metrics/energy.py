"""The energy that flows through a simulated run, and how much of it nothing explains."""

from dataclasses import dataclass

import numpy as np

from legbench.design.statics import GRAVITY
from legbench.metrics.built import built_of
from legbench.metrics.changes import changes
from legbench.metrics.rows import runs_of
from legbench.metrics.source import Recorded
from legbench.metrics.window import WINDOW_ROWS, RowWindow, spans
from legbench.signals import Bools, Floats

STOP_MARGIN = 0.02
"""Distance to a joint stop from which it may act [rad]: stops are soft, and touch early."""


AT_REST = 1e-6
"""Share of weight times shank length that a leg at rest does not exceed in kinetic energy [-]: some
microjoules, where the paper's smallest oscillations have millijoules."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Flows:
    """Energy that flowed in each interval between two rows (n - 1,) [J]; NaN without truth.

    They are NaN, too, where noise on the encoders hides it.

    `gain = motor_work - damper_loss + unexplained` holds by definition of the last.
    """

    gain: Floats
    """Change of gravitational, kinetic and spring energy together."""
    motor_work: Floats
    """Work of the motors, U(theta_k+1, q_k) - U(theta_k, q_k), in an interval's first instant."""
    damper_loss: Floats
    """Loss in both joints, viscous and dry, and in the trunk's guide."""
    unexplained: Floats
    """Unexplained rest: contact, impact, stops, and what the numerics make or lose."""


def energy_flows(recording: Recorded, rows: int = WINDOW_ROWS) -> Flows:
    """Split the change of energy over each interval into work, loss and the unexplained.

    The leg is the one that was built, with the imperfections that the run says it had.

    Args:
        recording: the run.
        rows: number of rows to work on at once.
    """
    last = len(recording.time) - 1
    names, parts = tuple(Flows.__dataclass_fields__), []
    for first, stop in spans(last, rows):
        # An interval's integral asks for the rows around it: one before, two after.
        low, high = max(first - 1, 0), min(stop + 2, last + 1)
        part = _flows(RowWindow(recording, low, high))
        inside = slice(first - low, first - low + stop - first)
        parts.append([getattr(part, name)[inside] for name in names])
    joined = map(np.concatenate, zip(*parts, strict=True))
    return Flows(**dict(zip(names, joined, strict=True)))


def _flows(recording: Recorded) -> Flows:
    built = built_of(recording)
    motor, joint = built.shaft, built.joint
    after_move = built.spring_energy(motor[1:], joint[:-1])
    work = after_move - built.spring_energy(motor[:-1], joint[:-1])
    energy = recording["energy"]
    passive = np.diff(energy[:, 0] + energy[:, 1])
    passive += built.spring_energy(motor[1:], joint[1:]) - after_move
    power = np.square(recording["joint_vel"]) @ np.asarray(built.design.damping)
    power = power + built.other_power
    loss = _integral(recording.time, power, motor)
    return Flows(gain=work + passive, motor_work=work, damper_loss=loss, unexplained=passive + loss)


def _integral(time: Floats, power: Floats, motor_pos: Floats) -> Floats:
    """Integral of `power` over each interval (n - 1,).

    Cubic through four rows where the motors stood still around the interval, else trapezoid: a
    moved motor bends the velocities.
    """
    step = np.diff(time)
    integral = 0.5 * step * (power[:-1] + power[1:])
    if len(power) < 4:
        return integral
    bend = power[:-3] - power[1:-2] - power[2:-1] + power[3:]
    moved = changes(motor_pos)
    even = np.abs(np.diff(step)) < 1e-6 * step[1:]
    smooth = ~(moved[1:-1] | moved[2:]) & even[:-1] & even[1:]
    integral[1:-1] -= np.where(smooth, step[1:-1] * bend / 24.0, 0.0)
    return integral


def stop_intervals(recording: Recorded) -> Bools:
    """Intervals (n - 1,) in which a joint stop may act, one row spared around."""
    limits = recording.description.design.limits
    joint = recording["joint_pos"]
    near = np.zeros(len(joint), dtype=bool)
    angles = ((joint[:, 0], limits.hip), (joint[:, 1] - joint[:, 0], limits.knee))
    for angle, (low, high) in angles:
        near |= (angle < low + STOP_MARGIN) | (angle > high - STOP_MARGIN)
    return _around(near)


def clean_intervals(recording: Recorded) -> Bools:
    """Intervals (n - 1,) in which only springs, dampers and gravity act, one row spared around."""
    stops = stop_intervals(recording)
    if not recording.description.jumps:
        return ~stops
    # A foot may touch and leave between two rows: it is then on the ground without a contact.
    down = np.asarray(recording["contact"], dtype=bool) | (recording["foot_pos"][:, 1] <= 0.0)
    return ~(stops | _around(down))


def _around(rows: Bools) -> Bools:
    """Intervals (n - 1,) that one of the rows (n,) ends, begins, or is next to."""
    wide = rows.copy()
    wide[1:] |= rows[:-1]
    wide[:-1] |= rows[1:]
    return wide[:-1] | wide[1:]


def energy_residual(recording: Recorded, flows: Flows) -> float:
    """Worst drift of the unexplained energy over a clean stretch, over the peak kinetic energy [-].

    NaN without truth, motion or a clean stretch; a leg whose kinetic energy stays below `AT_REST`
    of its weight times its length does not move.
    """
    clean = clean_intervals(recording)
    kinetic = recording["energy"][:, 1]
    if not (clean.any() and np.all(np.isfinite(flows.unexplained))):
        return np.nan
    runs, running = runs_of(clean), np.cumsum(flows.unexplained)
    before = np.concatenate([[0.0], running])[runs.first]
    drift = np.abs(running - np.repeat(before, runs.stop - runs.first))
    worst = float(np.max(drift[clean]))
    peak, design = float(kinetic.max()), recording.description.design
    rest = AT_REST * GRAVITY * design.total_mass * design.shank.length
    return worst / peak if peak > rest else np.nan


def loop_gap_max(recording: Recorded) -> float:
    """Widest opening of a bar loop in the whole run [m]; NaN without truth."""
    gaps = np.abs(recording["loop_gap"])
    gaps = gaps[np.isfinite(gaps)]
    return float(gaps.max()) if len(gaps) else np.nan
