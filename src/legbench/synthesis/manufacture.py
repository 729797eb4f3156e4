"""Table from which a leg is built, and weights for a part that came out wrong."""

import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

from legbench.design import LegDesign, Segment
from legbench.design.matching import Condition, Parameters, check_conditions
from legbench.design.realisable import SEGMENTS, Reach, reaches
from legbench.errors import ConfigError

LENGTH_APART = 0.05
"""Relative difference of lengths above which a measured segment is another one [-]."""
SMALLEST_WEIGHT = 1e-5
"""Largest difference of mass that is left as it is [kg]."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ManufactureRow:
    """One number of the manufacture table."""

    part: str
    quantity: str
    symbol: str
    value: float
    """SI."""
    unit: str
    shown: str
    """Value in workshop units, as text."""
    note: str = ""
    """Remark for the workshop; empty if there is nothing to mind."""


def manufacture_table(design: LegDesign) -> tuple[ManufactureRow, ...]:
    """Every number from which the leg is built, in the units of a workshop."""
    rows = [_row("trunk", "mass", "m_t", design.trunk_mass, "kg")]
    parts = zip(reaches(design), design.segments, strict=True)
    for index, (reach, segment) in enumerate(parts, start=1):
        name = reach.segment
        rows += [
            _row(name, "mass", f"m_{index}", segment.mass, "kg"),
            _row(name, "length", f"l_{index}", segment.length, "m"),
            _row(name, "centre of mass", f"c_{index}", segment.com, "m"),
            _row(name, "inertia", f"I_{index}", segment.inertia, "kg m^2", beyond(reach)),
        ]
    for index in range(2):
        number = index + 1
        rows += [
            _row(
                f"spring {number}", "stiffness", f"k_{number}", design.stiffness[index], "N m/rad"
            ),
            _row(f"joint {number}", "damping", f"d_{number}", design.damping[index], "N m s/rad"),
        ]
    return tuple(rows)


WORKSHOP = {
    "kg": (("g", 1e3), ("kg", 1.0)),
    "m": (("mm", 1e3),),
    "kg m^2": (("kg mm^2", 1e6),),
}
"""SI unit -> units of a workshop and how many of them make one; the last for large numbers."""
LARGE = 1e4
"""Smallest value that is shown in the larger unit."""


def shown(value: float, unit: str) -> str:
    """A value in workshop units with four digits, never with an exponent of ten above."""
    units = WORKSHOP.get(unit, ((unit, 1.0),))
    name, factor = units[0] if abs(value) * units[0][1] < LARGE else units[-1]
    number = factor * value
    if number == 0.0:
        return f"0 {name}"
    digits = max(0, 3 - math.floor(math.log10(abs(number))))
    return f"{number:.{digits}f} {name}"


def _row(
    part: str, quantity: str, symbol: str, value: float, unit: str, note: str = ""
) -> ManufactureRow:
    words = shown(value, unit)
    return ManufactureRow(
        part=part,
        quantity=quantity,
        symbol=symbol,
        value=value,
        unit=unit,
        shown=words,
        note=note,
    )


def beyond(reach: Reach) -> str:
    """Words for an inertia that mass between the joints cannot have; empty if it can."""
    if reach.realisable:
        return ""
    return (
        f"needs mass {shown(reach.overhang, 'm')} beyond both joints: between them there can be "
        f"{shown(reach.most, 'kg m^2')} at most"
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class Lump:
    """One piece of a weight, small against the segment."""

    mass: float
    """Mass of the piece [kg]."""
    position: float
    """Distance from the proximal joint towards the distal one [m]."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Adjustment:
    """The weight that moves a measured segment to its target."""

    segment: str
    mass: float
    """Mass to be added; negative: to be taken away [kg]."""
    position: float
    """Centre of the weight, from the proximal joint towards the distal one [m]; NaN if no single
    weight does it."""
    lumps: tuple[Lump, ...]
    """Pieces into which the weight is split so that the inertia comes to its target, or as near as
    the segment is long; one piece where that already has as much as wanted or more."""
    mass_after: float
    """[kg]"""
    com_after: float
    """[m]"""
    inertia_after: float
    """[kg m^2]"""
    inertia_missing: float
    """Inertia that is still missing [kg m^2]; negative: a weight cannot take inertia away."""
    note: str
    """Remark for the workshop; empty if the weight fits on the segment."""


def adjust(name: str, measured: Segment, target: Segment) -> Adjustment:
    """The weight that gives `measured` the mass, the centre of mass and, if it can, the inertia of
    `target`.

    A point mass `w = m* - m` at `p = (m* c* - m c) / w` sets mass and centre of mass. Two lumps
    around it, at `p - a` and `p + b` with masses `w b / (a + b)` and `w a / (a + b)`, add `w a b`
    to the inertia; on the segment that is at most `w p (l - p)`.
    """
    weight = target.mass - measured.mass
    if abs(weight) < SMALLEST_WEIGHT:
        aside = 1e3 * abs(measured.com - target.com)
        note = f"centre of mass {aside:.2f} mm off: move a weight instead" if aside > 1e-3 else ""
        return _none(name, measured, target, note)
    position = (target.mass * target.com - measured.mass * measured.com) / weight
    on_segment = 0.0 <= position <= target.length
    if weight < 0.0 and not on_segment:
        note = (
            f"{-1e3 * weight:.2f} g too heavy, and taking that away anywhere on it would not put "
            "its centre of mass right: lighten it further, then add a weight"
        )
        return _none(name, measured, target, note)
    shifted = measured.inertia + measured.mass * (measured.com - target.com) ** 2
    lump = shifted + weight * (position - target.com) ** 2
    missing = target.inertia - lump
    below, above = 0.0, 0.0
    if weight > 0.0 and missing > 0.0 and on_segment:
        below, above = _spread(missing / weight, position, target.length - position)
    reached = lump + weight * below * above
    if weight < 0.0:
        note = "too heavy: take this much away there"
    elif not on_segment:
        note = "beyond the segment's ends: needs an outrigger"
    else:
        note = ""
    return Adjustment(
        segment=name,
        mass=weight,
        position=position,
        lumps=_lumps(weight, position, below, above),
        mass_after=target.mass,
        com_after=target.com,
        inertia_after=reached,
        inertia_missing=target.inertia - reached,
        note=note,
    )


def _spread(product: float, below: float, above: float) -> tuple[float, float]:
    """Distances a <= `below` and b <= `above` [m] whose product is `product` [m^2], or the largest.

    They are equal where there is room for that: two halves are easier to make than two lumps.
    """
    half = math.sqrt(product)
    if half <= min(below, above):
        return half, half
    if product >= below * above:
        return below, above
    return (below, product / below) if below < above else (product / above, above)


def _lumps(weight: float, position: float, below: float, above: float) -> tuple[Lump, ...]:
    """One lump, or two whose masses balance about `position`."""
    if not (below > 0.0 and above > 0.0):
        return (Lump(mass=weight, position=position),)
    share = above / (below + above)
    return (
        Lump(mass=share * weight, position=position - below),
        Lump(mass=(1.0 - share) * weight, position=position + above),
    )


def _none(name: str, measured: Segment, target: Segment, note: str) -> Adjustment:
    """No weight: the segment stays as it was measured."""
    return Adjustment(
        segment=name,
        mass=0.0,
        position=math.nan,
        lumps=(),
        mass_after=measured.mass,
        com_after=measured.com,
        inertia_after=measured.inertia,
        inertia_missing=target.inertia - measured.inertia,
        note=note,
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class Adjusted:
    """A measured leg, its weights, and what is left of the conditions."""

    adjustments: tuple[Adjustment, ...]
    before: tuple[Condition, ...]
    after: tuple[Condition, ...]


def adjust_leg(measured: LegDesign, target: LegDesign) -> Adjusted:
    """The weights for all segments of a measured leg; lengths, springs and dampers stay.

    Raises:
        ConfigError: a segment is not the target's at all, by its length.
    """
    for name, has, wants in zip(SEGMENTS, measured.segments, target.segments, strict=True):
        if abs(has.length - wants.length) > LENGTH_APART * wants.length:
            raise ConfigError(
                f"measured {name} is {1e3 * has.length:.1f} mm long, the target's "
                f"{1e3 * wants.length:.1f} mm: weights cannot make one the other"
            )
    adjustments = tuple(
        adjust(name, has, wants)
        for name, has, wants in zip(SEGMENTS, measured.segments, target.segments, strict=True)
    )
    parameters = Parameters.of(measured)
    angle = 0.5 * measured.limits.knee[0]
    weighted = replace(
        parameters.leg,
        mass=np.array([adjustment.mass_after for adjustment in adjustments]),
        com=np.array([adjustment.com_after for adjustment in adjustments]),
        inertia=np.array([adjustment.inertia_after for adjustment in adjustments]),
    )
    return Adjusted(
        adjustments=adjustments,
        before=check_conditions(parameters, angle),
        after=check_conditions(replace(parameters, leg=weighted), angle),
    )


def table_to_json(rows: Sequence[ManufactureRow]) -> list[dict[str, Any]]:
    """The table as JSON."""
    return [asdict(row) for row in rows]
