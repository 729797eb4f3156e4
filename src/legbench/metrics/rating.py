"""The rating P^r of eq. (14): how much of a deflection lies along the radial mode."""

import numpy as np

from legbench.design.leg import LegDesign
from legbench.design.statics import Support, equilibrium, gravity_load
from legbench.errors import DesignError
from legbench.kinematics import MODE_RADIAL
from legbench.metrics.source import Recorded, Reference, terms_of
from legbench.signals import Floats, Ints

AT_REST = 1e-9
"""Deflection below which a row has no direction and is skipped [rad]: far below any encoder's
count, far above rounding."""

GRID = 0.01
"""Spacing of the motor positions whose equilibria are looked up [rad]; Newton's method refines
each row from there."""


def alignment(deflection: Floats) -> Floats:
    """|w.q| / (|w| |q|) of each deflection (..., 2), w = [-1, 1]; NaN below `AT_REST` (...).

    Source: the summand of eq. (14).
    """
    size = np.linalg.norm(deflection, axis=-1)
    along = np.abs(deflection @ MODE_RADIAL) / np.linalg.norm(MODE_RADIAL)
    moved = size > AT_REST
    return np.where(moved, along / np.where(moved, size, 1.0), np.nan)


def rate(deflection: Floats) -> float:
    """P^r of the rows (n, 2), eq. (14); rows without direction do not count, NaN if none does."""
    values = alignment(deflection)
    values = values[np.isfinite(values)]
    return float(values.mean()) if len(values) else float("nan")


def link_equilibrium(design: LegDesign, motor_pos: Floats, support: Support) -> Floats:
    """`statics.equilibrium` of many motor positions (n, 2); NaN where none is stable [rad].

    Solved on the positions rounded to `GRID` that occur, then refined row by row.
    """
    stiffness = np.asarray(design.stiffness)
    moment = np.asarray(gravity_load(design, support).moment)
    if support is Support.NONE or len(motor_pos) == 0:
        return motor_pos.copy()
    cells, cell = np.unique(np.round(motor_pos / GRID), axis=0, return_inverse=True)
    joint_pos = _solve(design, GRID * cells, support)[cell.reshape(-1)]
    for _ in range(4):
        residual = stiffness * (motor_pos - joint_pos) - moment * np.sin(joint_pos)
        slope = stiffness + moment * np.cos(joint_pos)
        joint_pos = joint_pos + residual / np.where(slope > 0.0, slope, np.nan)
    residual = stiffness * (motor_pos - joint_pos) - moment * np.sin(joint_pos)
    stable = stiffness + moment * np.cos(joint_pos) > 0.0
    held = np.all(stable & (np.abs(residual) < 1e-9), axis=-1, keepdims=True)
    return np.where(held, joint_pos, np.nan)


def _solve(design: LegDesign, motor_pos: Floats, support: Support) -> Floats:
    """Equilibria of a batch; halved until those without one are alone, and NaN."""
    try:
        return equilibrium(design, motor_pos, support)
    except DesignError:
        if len(motor_pos) == 1:
            return np.full_like(motor_pos, np.nan)
    half = len(motor_pos) // 2
    parts = (motor_pos[:half], motor_pos[half:])
    return np.concatenate([_solve(design, part, support) for part in parts])


def deflection(
    design: LegDesign,
    joint_pos: Floats,
    motor_pos: Floats,
    support: Support,
    reference: Reference,
) -> Floats:
    """`q - q_d` of eq. (14) (n, 2) [rad], with the reference that is asked for.

    The motor target is the measured motor position of the same row: what the springs feel, not
    what the controller wished. Rows without a stable equilibrium are NaN.
    """
    if reference is Reference.MOTOR:
        return joint_pos - motor_pos
    return joint_pos - link_equilibrium(design, motor_pos, support)


def rate_phases(
    recording: Recorded, support: Support, reference: Reference, first: Ints, stop: Ints
) -> list[float]:
    """P^r of each stretch of rows [first, stop) of a run, with what carries the leg in them.

    Raises:
        FormatError: a manifest without a leg.
    """
    design = terms_of(recording.manifest).design
    rows = [np.arange(low, high) for low, high in zip(first, stop, strict=True)]
    if not rows:
        return []
    chosen = np.concatenate(rows)
    joint_pos, motor_pos = recording["joint_pos"][chosen], recording["motor_pos"][chosen]
    deflected = deflection(design, joint_pos, motor_pos, support, reference)
    return [rate(part) for part in np.split(deflected, np.cumsum(stop - first)[:-1])]
