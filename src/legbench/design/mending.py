"""Changes of one parameter each by which a condition of modal matching would be met."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from legbench.design.leg import LegDesign
from legbench.design.matching import Condition, Parameters, check_conditions
from legbench.errors import DesignError

SEGMENTS = ("thigh", "shank", "foot")
SYMBOLS = {"mass": "m", "com": "c", "inertia": "I"}
UNITS = {"mass": "kg", "com": "m", "inertia": "kg m^2"}
PAIRS = {"stiffness": ("k", "N m/rad"), "damping": ("d", "N m s/rad")}


@dataclass(frozen=True, slots=True, kw_only=True)
class Mend:
    """A change of one parameter after which a condition is met exactly."""

    parameter: str
    """Key of the design file, such as `thigh.inertia`, with the paper's symbol."""
    unit: str
    value: float
    """Present value of the parameter."""
    change: float
    """Amount to be added to the parameter."""
    moves: tuple[str, ...]
    """Other conditions that this change alters."""
    topples: bool
    """Whether the leg stands before the change and no longer after it, by condition (10)."""

    @property
    def share(self) -> float:
        """Change relative to the present value [-]."""
        return self.change / self.value if self.value else float("inf")


def mends(design: LegDesign, condition: Condition, half_angle: float) -> tuple[Mend, ...]:
    """Every single parameter that can mend `condition`; those that leave the leg standing and
    disturb nothing else first.

    Lengths are not among them: `l2 = l1 + l3` ties two of them. For stability the change reaches
    the border: more than that is needed.
    """
    found: list[Mend] = []
    before = check_conditions(Parameters.of(design), half_angle)
    index = [other.name for other in before].index(condition.name)
    for name, unit, value, changed in _parameters(design):
        target = _root(changed, value, index, half_angle)
        if target is None or not _possible(design, name, target):
            continue
        after = check_conditions(changed(target), half_angle)
        moves = tuple(
            other.name
            for other, was in zip(after, before, strict=True)
            if other.name not in (condition.name, "stability")
            and abs(other.residual - was.residual) > 1e-12 * other.scale
        )
        topples = before[-1].is_met() and not after[-1].is_met()
        mend = Mend(
            parameter=name,
            unit=unit,
            value=value,
            change=target - value,
            moves=moves,
            topples=topples and condition.name != "stability",
        )
        found.append(mend)
    return tuple(sorted(found, key=lambda mend: (mend.topples, len(mend.moves), abs(mend.share))))


Changed = Callable[[float], Parameters]


def _parameters(design: LegDesign) -> list[tuple[str, str, float, Changed]]:
    """Name, unit, value and the parameters with another value in its place."""
    base = Parameters.of(design)

    def in_leg(field: str, index: int) -> Changed:
        def changed(value: float) -> Parameters:
            column = getattr(base.leg, field).copy()
            column[index] = value
            return replace(base, leg=replace(base.leg, **{field: column}))

        return changed

    def in_pair(field: str, index: int) -> Changed:
        def changed(value: float) -> Parameters:
            pair = getattr(base, field).copy()
            pair[index] = value
            return replace(base, **{field: pair})

        return changed

    rows: list[tuple[str, str, float, Changed]] = []
    for field, symbol in SYMBOLS.items():
        for index, segment in enumerate(SEGMENTS):
            value = float(getattr(base.leg, field)[index])
            label = f"{segment}.{field} ({symbol}{index + 1})"
            rows.append((label, UNITS[field], value, in_leg(field, index)))
    for field, (symbol, unit) in PAIRS.items():
        for index in range(2):
            value = float(getattr(base, field)[index])
            rows.append(
                (f"springs.{field} ({symbol}{index + 1})", unit, value, in_pair(field, index))
            )
    rows.append(
        (
            "trunk.mass (m_t)",
            "kg",
            base.trunk_mass,
            lambda value: replace(base, trunk_mass=value),
        )
    )
    return rows


def _root(changed: Changed, value: float, index: int, half_angle: float) -> float | None:
    """Parameter value nearest to `value` at which the residual vanishes; none where it never does.

    Every residual is a polynomial of degree two or less in each parameter, so three values
    determine it; one step of Newton's method removes what rounding left.
    """
    step = abs(value) if value else 1e-3

    def residual(at: float) -> float:
        return check_conditions(changed(at), half_angle)[index].residual

    low, middle, high = residual(value - step), residual(value), residual(value + step)
    slope, bend = 0.5 * (high - low), 0.5 * (high + low) - middle
    scale = check_conditions(changed(value), half_angle)[index].scale
    if max(abs(slope), abs(bend)) <= 1e-12 * scale:
        return None
    if abs(bend) <= 1e-12 * scale:
        steps = np.array([-middle / slope])
    else:
        roots = np.roots([bend, slope, middle])
        steps = roots[np.abs(roots.imag) < 1e-12].real
    if len(steps) == 0:
        return None
    nearest = float(steps[np.argmin(np.abs(steps))])
    rate = slope + 2.0 * bend * nearest
    found = value + step * nearest
    return found - step * residual(found) / rate if rate else found


def _possible(design: LegDesign, name: str, value: float) -> bool:
    """Whether a leg with that parameter could exist."""
    path = name.split(" ")[0]
    group, field = path.split(".")
    try:
        if group == "trunk":
            replace(design, trunk_mass=value)
        elif group == "springs":
            index = int(name[-2]) - 1
            pair = list(getattr(design, field))
            pair[index] = value
            changes: dict[str, Any] = {field: tuple(pair)}
            replace(design, **changes)
        else:
            changes = {group: replace(getattr(design, group), **{field: value})}
            replace(design, **changes)
    except DesignError:
        return False
    return True
