"""Results of `legbench modes` as lines of text."""

from collections.abc import Sequence
from typing import TypeVar

from legbench.cli.modes_found import ModesFound
from legbench.modes.brake import BrakeOrbit
from legbench.modes.branches import Branch
from legbench.modes.damped import DampedFamily
from legbench.modes.family import Family, Passing
from legbench.modes.response import Response, ResponseCurve

LINES = 8
"""Orbits of a family that are printed, about [-]."""

Item = TypeVar("Item")


def _some(items: Sequence[Item]) -> list[Item]:
    """About `LINES` of many, the last one among them."""
    step = max(1, len(items) // LINES)
    chosen = list(items[:-1:step])
    return [*chosen, items[-1]]


def tables(found: ModesFound) -> list[str]:
    """Everything that was found."""
    scene = found.scene
    q1, q2 = scene.rest
    lines = [
        f"{scene.design.name}, {scene.kind}, undamped, at rest at q = ({q1:.4f}, {q2:.4f}) rad",
        "",
        "linear      freq [Hz]   shape (q1, q2)        alignment",
    ]
    for mode in found.linear.values():
        shape = f"({mode.shape[0]:+.4f}, {mode.shape[1]:+.4f})"
        lines.append(f"{mode.name:<10} {mode.freq:10.4f}   {shape}   {mode.alignment:12.8f}")
    lines += [
        "",
        "x1 = 0 as a strict mode",
        f"  geodesic residual   {found.strict.geodesic:10.2e} 1/rad",
        f"  force off the line  {found.strict.force:10.2e}",
        f"  leaves the line by  {found.strict.invariance:10.2e} rad in two periods",
    ]
    for family in found.families:
        name = family.mode.name
        lines += ["", *_family(family, found.shown.get(name))]
        for number, branch in enumerate(found.branches[name], start=1):
            lines += ["", *_branch(branch, name, number)]
    for damped in found.damped:
        lines += ["", *_damped(damped)]
    for curve in found.curves:
        lines += ["", *_curve(curve)]
    if found.ridden is not None:
        lines += ["", *_ridden(found.ridden.cycles, found.ridden.threshold, found.ridden.ended)]
    return lines


def _family(family: Family, shown: BrakeOrbit | None) -> list[str]:
    lines = [
        f"{family.mode.name} mode   energy [J]   freq [Hz]   bend [rad]   multipliers"
        "        ends at (q1, q2)"
    ]
    for orbit in _some(family.orbits):
        ends = ", ".join(f"({end[0]:+.3f}, {end[1]:+.3f})" for end in (orbit.start, orbit.end))
        lines.append(
            f"{'':<13} {orbit.energy:10.5f} {1.0 / orbit.period:11.5f} {orbit.bend:12.2e}   "
            f"{_pair(orbit):<18} {ends}"
        )
    lines.append(f"  followed to {family.largest:.4g} J: {family.ended}")
    lines += [f"  {_passing(one)}" for one in family.passings]
    if shown is not None:
        sizes = ", ".join(f"{abs(value):.6f}" for value in shown.monodromy.multipliers)
        off = shown.monodromy.determinant - 1.0
        lines.append(
            f"  Floquet multipliers at {shown.energy:.4g} J: {sizes}; product off 1 by {off:+.0e}"
        )
    return lines


def _pair(orbit: BrakeOrbit) -> str:
    """The pair of multipliers beside those that are one."""
    first, second = orbit.monodromy.pair
    if orbit.monodromy.stable:
        return f"{first.real:+.3f} +-{abs(first.imag):.3f}i"
    return f"{first.real:+.4f}, {second.real:+.4f}"


def _passing(passing: Passing) -> str:
    energy = f"at {passing.orbit.energy:.4g} J"
    if not passing.changes:
        return (
            f"internal resonance 1:{passing.periods} {energy}: the motion across it takes "
            f"{passing.periods} periods"
        )
    what = "gains stability" if passing.stable_after else "loses stability"
    by = "+1" if passing.periods == 1 else "-1, to motion of twice the period"
    return f"{what} {energy}, by a multiplier of {by}"


def _branch(branch: Branch, name: str, number: int) -> list[str]:
    lines = [
        f"branch {number} of the {name} mode, from {branch.passing.orbit.energy:.4g} J"
        "   energy [J]   freq [Hz]   z2 [rad]   z1 [rad]"
    ]
    for orbit in _some(branch.orbits):
        kind = "stops at both ends" if orbit.brakes else "circles"
        stable = "stable" if orbit.monodromy.stable else "not stable"
        lines.append(
            f"{'':<40} {orbit.energy:10.5f} {1.0 / orbit.period:11.5f} {orbit.radial:10.4f} "
            f"{orbit.polar:10.4f}   {kind}, {stable}"
        )
    lines.append(f"  ended: {branch.ended}")
    return lines


def _damped(family: DampedFamily) -> list[str]:
    d1, d2 = family.damping
    lines = [
        f"{family.name} mode, damped by {d1:g} and {d2:g} N m s/rad   energy [J]   freq [Hz]   "
        "damping ratio   z2 [rad]   z1 [rad]"
    ]
    for orbit in _some(family.orbits):
        lines.append(
            f"{'':<50} {orbit.energy:10.5f} {1.0 / orbit.period:11.5f} "
            f"{orbit.damping_ratio:13.5f} {orbit.radial:10.4f} {orbit.polar:10.4f}"
        )
    lines.append(f"  followed to {family.orbits[-1].energy:.4g} J: {family.ended}")
    return lines


def _curve(curve: ResponseCurve) -> list[str]:
    widest = max(curve.responses, key=lambda one: one.radial)
    lost = [one for one in curve.responses if not one.stable]
    lines = [
        f"response to motors of {curve.dz2:g} rad: largest z2 {widest.radial:.4f} rad at "
        f"{widest.freq:.4f} Hz",
        f"  followed from {curve.responses[0].freq:.4g} to {curve.responses[-1].freq:.4g} Hz: "
        f"{curve.ended}",
    ]
    if lost:
        freq = [one.freq for one in lost]
        lines.append(
            f"  not stable in parts between {min(freq):.4g} and {max(freq):.4g} Hz, with z2 of "
            f"{min(one.radial for one in lost):.3g} to {max(one.radial for one in lost):.3g} rad"
        )
    return lines


def _ridden(cycles: tuple[Response, ...], threshold: float, ended: str) -> list[str]:
    lines = [
        f"bang-bang at {threshold:g} N m   dz2 [rad]   freq [Hz]   z2 [rad]   z1 [rad]   "
        "largest multiplier"
    ]
    for cycle in _some(cycles):
        size = abs(cycle.multipliers[0])
        lines.append(
            f"{'':<22} {cycle.dz2:10.4f} {cycle.freq:11.5f} {cycle.radial:10.4f} "
            f"{cycle.polar:10.4f} {size:12.4f}{'' if cycle.stable else '  not stable'}"
        )
    lines.append(f"  ended: {ended}")
    return lines
