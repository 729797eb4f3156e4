"""Quantities of a run's rows that pictures show: coordinates, period numbers, stance.

Everything here is causal: a run taken in slices gives what the whole run gives, so that the
viewer shows the same live and afterwards.
"""

from dataclasses import dataclass
from typing import final

import numpy as np
from numpy.typing import NDArray

from legbench.design.setup import SetupKind
from legbench.kinematics import joint_to_modal, joint_to_polar
from legbench.metrics.roles import STANCE, states_by_controller
from legbench.metrics.source import Recorded
from legbench.metrics.stance import MINIMUM_PHASE
from legbench.signals import Bools, Floats, Ints
from legbench.viz.facts import Facts

RATE_FLOOR = 0.05
"""Lowest rate of radial motion that counts as oscillation [rad/s]; slower motion is rest."""
RATE_SHARE = 0.05
"""Hysteresis of a period's start, as a share of the fastest radial motion so far."""


@dataclass(frozen=True, slots=True, kw_only=True)
class TracedRows:
    """Rows of a run with the values that pictures derive from them."""

    rows: Recorded
    time: Floats
    """Times (n,) of the rows [s]."""
    joint: Floats
    """Joint angles q1, q2 (n, 2) [rad]."""
    polar: Floats
    """Polar coordinates x1 [rad], x2 [m] of the foot tip (n, 2)."""
    modal: Floats
    """Radial modal coordinate z2 [rad] and its rate [rad/s] (n, 2)."""
    period: Ints
    """Numbers (n,) of the rows' oscillation periods, or jumps."""
    stance: Bools
    """Mask (n,) of the rows in which the foot carries the leg."""
    hip: Floats
    """Heights (n,) of the hip above the ground [m]; NaN without truth."""


@final
class TouchdownMemory:
    """Memory of a leg that touches down, across slices of a run as if they were one."""

    def __init__(self) -> None:
        self._stance, self._hip, self._fell = False, np.nan, False

    def bounces(self, hip: Floats, stance: Bools) -> Bools:
        """Mask (n,) of the rows since a touchdown after which the hip has only fallen.

        As in `metrics.stance`: a foot that is off the ground in such a row has bounced.
        """
        falls = np.diff(np.append(self._hip, hip)) < 0.0
        before = np.append(self._stance, stance)
        touches = before[1:] & ~before[:-1]
        known = np.append(True, touches | ~falls)
        last = np.maximum.accumulate(np.where(known, np.arange(len(known)), 0))
        fell = np.append(self._fell, touches)[last]
        if len(hip):
            self._stance, self._hip, self._fell = bool(stance[-1]), float(hip[-1]), bool(fell[-1])
        return fell[1:]


@final
class Tracer:
    """Converter of consecutive slices of a run into traced rows."""

    def __init__(self, facts: Facts) -> None:
        self._facts = facts
        self._period, self._between = 0, False
        self._fastest = 0.0
        self._grounded = -np.inf
        self._landing = TouchdownMemory()

    def extend(self, rows: Recorded) -> TracedRows:
        """Derive what pictures need of the next rows."""
        joint = rows["joint_pos"]
        convention = self._facts.run.convention
        z2 = joint_to_modal(joint, convention)[..., 1]
        rate = joint_to_modal(rows["joint_vel"], convention)[..., 1]
        stance = stance_of(rows, self._facts.run.setup.kind)
        hip = rows["trunk_pos"][:, 1]
        return TracedRows(
            rows=rows,
            time=rows.time,
            joint=joint,
            polar=joint_to_polar(joint, self._facts.run.design.shank.length),
            modal=np.stack([z2, rate], axis=-1),
            period=self._count_periods(*self._extremes(rows.time, stance, rate, hip)),
            stance=stance,
            hip=hip,
        )

    def _extremes(
        self, time: Floats, stance: Bools, rate: Floats, hip: Floats
    ) -> tuple[Bools, Bools]:
        """Rows that may begin a period, and rows that must lie between two beginnings."""
        if self._facts.run.jumps:
            grounded = np.maximum.accumulate(
                np.append(self._grounded, np.where(stance, time, -np.inf))
            )
            self._grounded = float(grounded[-1])
            off_for = time - grounded[1:]
            return stance, (off_for >= MINIMUM_PHASE) & ~self._landing.bounces(hip, stance)
        fastest = np.maximum.accumulate(np.append(self._fastest, np.abs(rate)))
        self._fastest = float(fastest[-1])
        threshold = np.maximum(RATE_FLOOR, RATE_SHARE * fastest[1:])
        return rate > threshold, rate < -threshold

    def _count_periods(self, begins: Bools, between: Bools) -> Ints:
        """Number of the period of each row: how often `begins` followed `between`."""
        known = np.append(True, begins | between)
        last = np.maximum.accumulate(np.where(known, np.arange(len(known)), 0))
        held = np.append(self._between, between)[last]
        periods = self._period + np.cumsum(held[:-1] & ~held[1:])
        self._between, self._period = bool(held[-1]), int(np.append(self._period, periods)[-1])
        return periods.astype(np.int64)


def stance_of(rows: Recorded, kind: SetupKind) -> Bools:
    """Mask (n,) of the rows in stance: the contact, or what the controller took for it."""
    if kind is SetupKind.FFS:
        return np.ones(len(rows.time), dtype=np.bool_)
    if kind is not SetupKind.JUMP:
        return np.zeros(len(rows.time), dtype=np.bool_)
    if rows.has_truth:
        return np.asarray(rows["contact"], dtype=np.bool_)
    return states_by_controller(rows) == STANCE


@final
class Thinner:
    """Picks rows at a lower rate, across slices as if they were one."""

    def __init__(self, freq: float) -> None:
        self._period = 1.0 / freq
        self._step: int | None = None
        self._count = 0
        self._last = np.zeros(0)

    def pick(self, time: Floats) -> NDArray[np.intp]:
        """Indices of the rows to keep out of the next slice; `freq` is met from above."""
        steps = np.diff(np.append(self._last, time))
        if self._step is None and len(steps):
            self._step = max(1, int(self._period / float(np.median(steps)) + 1e-6))
        kept = np.arange(-self._count % (self._step or 1), len(time), self._step or 1)
        self._count += len(time)
        self._last = np.append(self._last, time)[-1:]
        return kept
