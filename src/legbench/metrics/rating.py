"""The rating P^r of eq. (14): how much of a deflection lies along the radial mode."""

from collections.abc import Iterator

import numpy as np

from legbench.design.leg import LegDesign
from legbench.design.statics import Support, balance, equilibrium, gravity_load, is_stable
from legbench.errors import DesignError
from legbench.kinematics import MODE_RADIAL
from legbench.metrics.changes import changes
from legbench.metrics.source import Recorded, Reference
from legbench.metrics.window import WINDOW_ROWS
from legbench.signals import Floats, Ints

RADIAL_SIZE = float(np.linalg.norm(MODE_RADIAL))
AT_REST = 1e-9
"""Deflection below which a row has no direction and is skipped [rad]: far below any encoder's
count, far above rounding."""

GRID = 0.01
"""Spacing of the motor positions whose equilibria are looked up [rad]; Newton's method refines
each row from there."""
REFINEMENTS = 4
"""Largest number of Newton steps of a row: they begin within half a `GRID` of its motors."""


def alignment(deflection: Floats) -> Floats:
    """|w.q| / (|w| |q|) of each deflection (..., 2), w = [-1, 1]; NaN below `AT_REST` (...).

    Source: the summand of eq. (14).
    """
    size = np.sqrt(np.square(deflection[..., 0]) + np.square(deflection[..., 1]))
    along = np.abs(deflection @ MODE_RADIAL) / RADIAL_SIZE
    moved = size > AT_REST
    return np.where(moved, along / np.where(moved, size, 1.0), np.nan)


def rate(deflection: Floats) -> float:
    """P^r of the rows (n, 2), eq. (14); rows without direction do not count, NaN if none does."""
    return _mean(alignment(deflection))


def _mean(aligned: Floats) -> float:
    known = aligned[np.isfinite(aligned)]
    return float(known.mean()) if len(known) else float("nan")


def link_equilibrium(design: LegDesign, motor_pos: Floats, support: Support) -> Floats:
    """`statics.equilibrium` of many motor positions (n, 2); NaN where none is stable [rad].

    Solved once for rows over which the motors stand still, on the positions rounded to `GRID` that
    occur, then refined position by position.
    """
    if support is Support.NONE or len(motor_pos) == 0:
        return motor_pos.copy()
    known = np.isfinite(motor_pos[:, 0]) & np.isfinite(motor_pos[:, 1])
    begins = np.concatenate([[True], changes(motor_pos)]) & known
    held = np.full(motor_pos.shape, np.nan)
    if known.any():
        solved = _refined(design, motor_pos[begins], support)
        held[known] = solved[np.cumsum(begins)[known] - 1]
    return held


def _refined(design: LegDesign, motor_pos: Floats, support: Support) -> Floats:
    """Equilibria of distinct, finite motor positions (m, 2), NaN where none is stable [rad]."""
    stiffness = np.asarray(design.stiffness)
    moment = np.asarray(gravity_load(design, support).moment)
    cells = np.round(motor_pos / GRID)
    # One key a cell, since whole rows are slow to sort: angles stay far below a million cells.
    keys = cells[:, 0] * 2.0**26 + cells[:, 1]
    _, place, cell = np.unique(keys, return_index=True, return_inverse=True)
    near = _solve(design, GRID * cells[place], support)[cell]
    joint_pos = balance(stiffness, moment, motor_pos, near, REFINEMENTS)
    held = np.all(is_stable(stiffness, moment, motor_pos, joint_pos), axis=-1, keepdims=True)
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
    """P^r of each stretch of rows [first, stop) of a run, with what carries the leg in them."""
    ratings: list[float] = []
    for some in _together(stop - first):
        ratings += _rate_together(recording, support, reference, first[some], stop[some])
    return ratings


def _together(lengths: Ints) -> Iterator[slice]:
    """Places of consecutive phases of about `WINDOW_ROWS` rows together, one phase at least."""
    ends = np.cumsum(lengths)
    place = 0
    while place < len(lengths):
        before = ends[place] - lengths[place]
        stop = max(place + 1, int(np.searchsorted(ends, before + WINDOW_ROWS, side="right")))
        yield slice(place, stop)
        place = stop


def _rate_together(
    recording: Recorded, support: Support, reference: Reference, first: Ints, stop: Ints
) -> list[float]:
    design = recording.description.design
    chosen = np.concatenate([np.arange(low, high) for low, high in zip(first, stop, strict=True)])
    joint_pos, motor_pos = recording["joint_pos"][chosen], recording["motor_pos"][chosen]
    aligned = alignment(deflection(design, joint_pos, motor_pos, support, reference))
    return [_mean(part) for part in np.split(aligned, np.cumsum(stop - first)[:-1])]
