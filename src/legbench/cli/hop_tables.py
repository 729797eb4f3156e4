"""Results of `legbench hop` as lines of text and as JSON."""

from typing import Any

import numpy as np

from legbench.design import LegDesign
from legbench.modes.cycles import HopCycle
from legbench.modes.fixed_point import UNITS, FixedPoint
from legbench.modes.hop import NAMES, Apex
from legbench.modes.hop_family import HopFamily
from legbench.modes.settings import SPANS

LINES = 12
"""Rows of a table, about [-]."""
SMALL = 1e-9
"""Multipliers below this are zero but for rounding, and their directions say nothing [-]."""


def hop_lines(design: LegDesign, apexes: list[Apex]) -> list[str]:
    """Hops in a row."""
    lines = [
        f"{design.name} under the jump controller (continuous time)",
        "",
        "hop   apex height [m]   speed [m/s]   z1 [rad]",
    ]
    for index in range(0, len(apexes), max(1, len(apexes) // LINES)):
        apex = apexes[index]
        lines.append(f"{index:3d} {apex.height:17.5f} {apex.speed:13.5f} {apex.z1:10.5f}")
    return lines


def point_lines(point: FixedPoint, verdict: str) -> list[str]:
    """A hop that returns to where it began."""
    apex, done = point.apex, point.hop
    flight = done.duration - (done.liftoff - done.touchdown)
    return [
        "",
        f"periodic hop   {_apex_words(apex)}",
        f"  period {done.duration:.5f} s, flight {flight:.5f} s, impact {1e3 * done.impact:.3g} mJ",
        f"  multipliers {_sizes(point.multipliers)}: {verdict}",
    ]


def point_content(point: FixedPoint) -> dict[str, Any]:
    """A hop that returns to where it began, as JSON."""
    return {
        "apex": point.apex._asdict(),
        "period": point.hop.duration,
        "touchdown": point.hop.touchdown,
        "liftoff": point.hop.liftoff,
        "impact": point.hop.impact,
        "multipliers": _pairs(point.multipliers),
        "residual": point.residual,
    }


def cycle_lines(cycle: HopCycle) -> list[str]:
    """A cycle of hops: apexes, times, multipliers and the direction of the largest one."""
    many = cycle.period > 1
    lines = ["", f"hop of period {cycle.period}" if many else "periodic hop"]
    if many:
        lines += [f"  {_apex_words(apex)}" for apex in cycle.apexes]
    else:
        lines[-1] += f"   {_apex_words(cycle.apexes[0])}"
    flight = sum(done.duration - (done.liftoff - done.touchdown) for done in cycle.hops)
    impact = sum(done.impact for done in cycle.hops)
    verdict = "stable" if cycle.stable else "not stable"
    return [
        *lines,
        f"  period {cycle.duration:.5f} s, flight {flight:.5f} s, impact {1e3 * impact:.3g} mJ",
        f"  multipliers {_sizes(cycle.multipliers)}: {verdict}",
        f"  {_growth(cycle)}",
    ]


def _growth(cycle: HopCycle) -> str:
    """Words for the growth by the largest multiplier, and for its direction."""
    value, direction = cycle.multipliers[0], cycle.directions[:, 0] * UNITS
    largest = int(np.argmax(np.abs(cycle.directions[:, 0])))
    scaled = np.abs(direction / direction[largest])
    parts = ", ".join(
        f"{name} {size:.2g}" for name, size in zip(NAMES, scaled, strict=True) if size > 0.01
    )
    change = 100.0 * (abs(value) - 1.0)
    turning = "turning round" if abs(value.imag) > 1e-6 else "alternating"
    how = "" if value.imag == 0.0 and value.real > 0.0 else f", {turning}"
    verb = "grow" if change > 0.0 else "shrink"
    return f"deviations along ({parts}) {verb} by {abs(change):.2g} % a period{how}"


def cycle_content(cycle: HopCycle) -> dict[str, Any]:
    """A cycle of hops, as JSON."""
    first = cycle.hops[0]
    kept = [abs(value) > SMALL for value in cycle.multipliers]
    return {
        "apex": cycle.apexes[0]._asdict(),
        "apexes": [apex._asdict() for apex in cycle.apexes],
        "hops": cycle.period,
        "period": cycle.duration,
        "touchdown": first.touchdown,
        "liftoff": first.liftoff,
        "impact": sum(done.impact for done in cycle.hops),
        "multipliers": _pairs(cycle.multipliers),
        "directions": [
            dict(zip(NAMES, _pairs(tuple((column * UNITS).tolist())), strict=True))
            for column, keep in zip(cycle.directions.T, kept, strict=True)
            if keep
        ],
        "stable": cycle.stable,
        "residual": cycle.residual,
    }


def family_lines(family: HopFamily) -> list[str]:
    """A hop followed over a setting."""
    unit = "" if SPANS[family.setting] == 1.0 or family.setting == "mismatch" else " [rad]"
    lines = [
        "",
        f"followed over {family.setting}",
        f"{str(family.setting) + unit:>12}   apex height [m]   z1 [rad]   largest multiplier",
    ]
    step = max(1, len(family.members) // LINES)
    for member in [*family.members[:-1:step], family.members[-1]]:
        cycle = member.cycle
        value = cycle.multipliers[0]
        size = f"{value.real:+.4f}" + (f" +-{abs(value.imag):.4f}i" if value.imag else "")
        lines.append(
            f"{member.value:12.4f} {cycle.apexes[0].height:17.5f} {cycle.apexes[0].z1:10.5f}   "
            f"{size}{'' if cycle.stable else '  not stable'}"
        )
    for change in family.changes:
        verb = "gains" if change.stable_after else "loses"
        lines.append(
            f"  {verb} stability at {family.setting} = {change.value:.4g}, by {change.kind}"
        )
    return [*lines, f"  ended: {family.ended}"]


def family_content(family: HopFamily) -> dict[str, Any]:
    """A hop followed over a setting, as JSON."""
    return {
        "setting": str(family.setting),
        "ended": family.ended,
        "changes": [
            {
                "value": change.value,
                "multiplier": _pairs(change.member.cycle.multipliers[:1])[0],
                "stable_after": change.stable_after,
                "kind": change.kind,
            }
            for change in family.changes
        ],
        "members": [
            {"value": member.value} | cycle_content(member.cycle) for member in family.members
        ],
    }


def _apex_words(apex: Apex) -> str:
    return (
        f"apex {apex.height:.5f} m, speed {apex.speed:+.5f} m/s, "
        f"z1 {apex.z1:+.5f} rad, z2 {apex.z2:.5f} rad"
    )


def _sizes(multipliers: tuple[complex, ...]) -> str:
    return ", ".join(f"{abs(value):.4g}" for value in multipliers)


def _pairs(values: tuple[complex, ...]) -> list[list[float]]:
    return [[complex(value).real, complex(value).imag] for value in values]
