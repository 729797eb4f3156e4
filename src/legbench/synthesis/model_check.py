"""Modal matching measured on the generated MuJoCo model, over the whole range of x2.

Nothing here uses the algebra of `design.matching` except to compare with it: inertia matrix, bias,
spring and damper forces are MuJoCo's own, the constraints are eliminated with MuJoCo's Jacobians,
and what is left is projected onto the polar coordinates. The linkage is `reduced`, the paper's
massless one; bars would add masses that the conditions do not know.
"""

from dataclasses import dataclass

import numpy as np

from legbench.design import LegDesign
from legbench.design.matching import Condition, Parameters, check_conditions
from legbench.design.setup import SetupKind
from legbench.design.statics import GRAVITY
from legbench.signals import Floats
from legbench.synthesis.reduced_model import SWING, WINDUP, Forces, Reduced

POSTURES = 60
"""Number of leg lengths x2 that are checked, spread evenly in the half angle."""
TILT = 1e-4
"""Polar angle by which the leg is tilted to measure stability [rad]."""
AGREES = 1e-9
"""Difference of model and algebra that is rounding, of the scale of the terms [-]."""
TILT_AGREES = 1e-6
"""Difference that is rounding for stability, where the model's value is a finite difference [-]."""

SETUPS = (SetupKind.HFTS, SetupKind.VFTS, SetupKind.FFS, SetupKind.JUMP)


@dataclass(frozen=True, slots=True, kw_only=True)
class Projection:
    """One condition in one setup, over the whole range of x2."""

    setup: SetupKind
    condition: str
    coupling: float
    """Largest coupling of the radial motion into the others, of the terms' size [-]."""
    disagreement: float | None
    """Largest difference from the algebra, of its scale [-]; none where it has no formula."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ModelCheck:
    """The generated model against the conditions, and against the algebra."""

    rows: tuple[Projection, ...]
    shortest: float
    """Range of leg lengths that was checked [m]."""
    longest: float

    @property
    def coupling(self) -> float:
        """Largest coupling of all [-]; a matched leg's is rounding."""
        return max(row.coupling for row in self.rows if row.condition != "stability")

    @property
    def disagreement(self) -> float:
        """Largest difference of model and algebra, in units of what is allowed [-]."""
        return max(
            row.disagreement / (TILT_AGREES if row.condition == "stability" else AGREES)
            for row in self.rows
            if row.disagreement is not None
        )

    @property
    def agrees(self) -> bool:
        """Whether generator and algebra agree."""
        return self.disagreement <= 1.0


def check_model(design: LegDesign) -> ModelCheck:
    """Project the generated model of a design onto polar coordinates in all four setups."""
    low, high = design.limits.knee
    halves = np.linspace(0.5 * low, 0.5 * high, POSTURES)
    rows = [row for kind in SETUPS for row in _check_setup(design, kind, halves)]
    reach = 2.0 * design.shank.length
    return ModelCheck(
        rows=tuple(rows),
        shortest=float(reach * np.cos(halves[-1])),
        longest=float(reach * np.cos(halves[0])),
    )


def _check_setup(design: LegDesign, kind: SetupKind, halves: Floats) -> list[Projection]:
    reduced = Reduced(design, kind)
    seen = [reduced.at(np.array([-half, half])) for half in halves]
    inertia, elastic, gravity, damping, _ = check_conditions(
        Parameters.of(design), float(halves[0])
    )
    even = np.ones_like(halves)
    weight = GRAVITY * np.sin(halves)
    rows = [
        _inertia(kind, seen, halves, design, (inertia, gravity)),
        _forces(kind, "elastic", [forces.spring for forces in seen], (elastic, -WINDUP * even)),
        _forces(kind, "damping", [forces.damper for forces in seen], (damping, SWING * even)),
        _forces(kind, "velocity", [forces.bias - forces.gravity for forces in seen], None),
    ]
    if kind is not SetupKind.HFTS:
        formula = None if kind is SetupKind.JUMP else (gravity, weight)
        rows.append(_forces(kind, "gravity", [forces.gravity for forces in seen], formula))
    if kind is SetupKind.FFS:
        rows.append(_stability(reduced, design, halves))
    return rows


def _forces(
    kind: SetupKind, name: str, forces: list[Floats], formula: tuple[Condition, Floats] | None
) -> Projection:
    """The polar part of forces (n,) at every length, against `factor * residual` of the algebra.

    x1 moves q1 and q2 together: the polar part is the sum of the two.
    """
    joints = np.array([force[-2:] for force in forces])
    polar, size = joints.sum(axis=1), float(np.abs(joints).sum(axis=1).max())
    apart = None
    if formula is not None:
        condition, factor = formula
        scale = float(np.abs(factor).max()) * condition.scale
        apart = _relative(float(np.abs(polar - factor * condition.residual).max()), scale)
    return Projection(
        setup=kind,
        condition=name,
        coupling=_relative(float(np.abs(polar).max()), size),
        disagreement=apart,
    )


def _relative(value: float, scale: float) -> float:
    return value / scale if scale > 0.0 else 0.0


def _inertia(
    kind: SetupKind,
    seen: list[Forces],
    halves: Floats,
    design: LegDesign,
    conditions: tuple[Condition, Condition],
) -> Projection:
    """Inertia coupling of x2 into x1, and with a free trunk of (z, x2) into (x, x1).

    The algebra has eq. (5) for the pinned foot. With the trunk fixed it is `M11 = M22` of the
    hanging leg, which differs from (5) by `2 l2` times the residual of gravity.
    """
    inertia, gravity = conditions
    l2 = design.shank.length
    expected, scale = inertia.residual, inertia.scale
    if kind is not SetupKind.FFS:
        expected -= 2.0 * l2 * gravity.residual
        scale += 2.0 * l2 * gravity.scale
    coupling, apart = 0.0, 0.0
    for forces, half in zip(seen, halves, strict=True):
        t8 = 1.0 / (2.0 * l2 * np.sin(half))
        change = np.eye(len(forces.mass))
        change[-2:, -2:] = np.array([[1.0, t8], [1.0, -t8]])
        mass = change.T @ forces.mass @ change
        size = np.sqrt(np.diag(mass))
        share = np.abs(mass) / np.outer(size, size)
        radial = [-1] if len(mass) == 2 else [-1, 1]
        other = [-2] if len(mass) == 2 else [-2, 0]
        coupling = max(coupling, float(share[np.ix_(radial, other)].max()))
        apart = max(apart, abs(float(mass[-2, -1]) / t8 - expected) / scale)
    return Projection(
        setup=kind,
        condition="inertia",
        coupling=coupling,
        disagreement=None if kind is SetupKind.JUMP else apart,
    )


def _stability(reduced: Reduced, design: LegDesign, halves: Floats) -> Projection:
    """Restoring torque of a tilted leg against eq. (10), at every length."""
    apart = []
    for half in halves:
        upright = np.array([-half, half])
        condition = check_conditions(Parameters.of(design), float(half))[-1]
        pushed = [
            reduced.static(upright + sign * TILT, upright).sum() / TILT for sign in (-1.0, 1.0)
        ]
        margin = 0.5 * (pushed[0] - pushed[1])
        apart.append(abs(margin - condition.residual) / condition.scale)
    return Projection(
        setup=reduced.kind, condition="stability", coupling=0.0, disagreement=float(max(apart))
    )
