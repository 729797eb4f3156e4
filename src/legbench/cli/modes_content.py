"""Results of `legbench modes` as JSON."""

from dataclasses import asdict
from typing import Any

from legbench.cli.modes_found import ModesFound
from legbench.modes.brake import BrakeOrbit
from legbench.modes.branches import Branch
from legbench.modes.damped import DampedFamily
from legbench.modes.family import Family, Passing
from legbench.modes.monodromy import Monodromy
from legbench.modes.periodic import PeriodicOrbit
from legbench.modes.response import Response


def content_of(found: ModesFound) -> dict[str, Any]:
    """Everything that was found, as one JSON object."""
    scene = found.scene
    content: dict[str, Any] = {
        "design": scene.design.name,
        "setup": str(scene.kind),
        "rest": list(scene.rest),
        "motor": list(scene.motor),
        "strictness": asdict(found.strict),
        "reach": found.reach,
        "modes": {family.mode.name: _family(found, family) for family in found.families},
    }
    if found.damped:
        content["damped"] = {family.name: _damped(family) for family in found.damped}
    if found.curves:
        content["responses"] = [
            {
                "dz2": curve.dz2,
                "ended": curve.ended,
                "responses": [_response(one) for one in curve.responses],
            }
            for curve in found.curves
        ]
    if found.ridden is not None:
        content["bang_bang"] = {
            "threshold": found.ridden.threshold,
            "ended": found.ridden.ended,
            "cycles": [_response(one) for one in found.ridden.cycles],
        }
    return content


def _family(found: ModesFound, family: Family) -> dict[str, Any]:
    name = family.mode.name
    shown = found.shown.get(name)
    return {
        "freq": family.mode.freq,
        "shape": family.mode.shape.tolist(),
        "alignment": family.mode.alignment,
        "ended": family.ended,
        "warnings": list(family.warnings),
        "orbits": [_orbit(one) for one in family.orbits],
        "passings": [_passing(one) for one in family.passings],
        "branches": [_branch(one) for one in found.branches[name]],
        "shown": None if shown is None else _orbit(shown),
    }


def _orbit(orbit: BrakeOrbit) -> dict[str, Any]:
    return {
        "energy": orbit.energy,
        "period": orbit.period,
        "start": orbit.start.tolist(),
        "end": orbit.end.tolist(),
        "bend": orbit.bend,
        **_monodromy(orbit.monodromy),
    }


def _monodromy(matrix: Monodromy) -> dict[str, Any]:
    return {
        "multipliers": _complex(matrix.multipliers),
        "trace": matrix.trace,
        "determinant": matrix.determinant,
        "stable": matrix.stable,
    }


def _complex(values: tuple[complex, ...]) -> list[list[float]]:
    return [[value.real, value.imag] for value in values]


def _passing(passing: Passing) -> dict[str, Any]:
    return {
        "energy": passing.orbit.energy,
        "period": passing.orbit.period,
        "turns": passing.turns,
        "periods": passing.periods,
        "changes_stability": passing.changes,
        "stable_after": passing.stable_after,
    }


def _branch(branch: Branch) -> dict[str, Any]:
    return {
        "from_energy": branch.passing.orbit.energy,
        "periods": branch.passing.periods,
        "side": branch.side,
        "ended": branch.ended,
        "orbits": [_periodic(one) | _monodromy(one.monodromy) for one in branch.orbits],
    }


def _periodic(orbit: PeriodicOrbit) -> dict[str, Any]:
    return {
        "energy": orbit.energy,
        "period": orbit.period,
        "start": orbit.start.tolist(),
        "radial": orbit.radial,
        "polar": orbit.polar,
        "slowest": orbit.slowest,
        "brakes": orbit.brakes,
    }


def _damped(family: DampedFamily) -> dict[str, Any]:
    return {
        "damping": list(family.damping),
        "ended": family.ended,
        "orbits": [
            _periodic(one) | {"drive": -one.extra, "damping_ratio": one.damping_ratio}
            for one in family.orbits
        ],
    }


def _response(response: Response) -> dict[str, Any]:
    return {
        "freq": response.freq,
        "dz2": response.dz2,
        "folded": response.folded,
        "stretched": response.stretched,
        "start": response.start.tolist(),
        "radial": response.radial,
        "polar": response.polar,
        "multipliers": _complex(response.multipliers),
        "stable": response.stable,
    }
