"""Design that has the identified parameters, with the smallest change of what was designed.

Recordings show nine combinations; masses, centres of mass and inertias of the segments are more.
Of all legs with the identified combinations the one is taken that is nearest to the design, each
mass and inertia measured by its own size and each centre of mass by the length of its segment.
"""

from dataclasses import replace
from typing import Any, Final

import numpy as np

from legbench import __version__
from legbench.analytic.terms import Bars, floating_terms
from legbench.design import LegDesign, Segment
from legbench.design.statics import GRAVITY
from legbench.design.toml import design_to_mapping, tables_to_toml
from legbench.errors import ConfigError, DesignError
from legbench.identify.base import base_of
from legbench.identify.outcome import Identification
from legbench.identify.parameters import GROUPS, INDEX, PARAMETERS
from legbench.signals import Floats

NAMES: Final = ("thigh", "shank", "foot")
"""Segments in their order."""
STEPS: Final = 50
"""Most steps towards the identified combinations [-]."""
EXACT: Final = 1e-13
"""Share of the first moments and inertias to which they are met [-]."""
DIFFERENCE: Final = 1e-7
"""Step of the differences by which combinations are differentiated [-]; they are polynomials of
the third degree at most."""


def written_back(design: LegDesign, outcome: Identification, bars: Bars | None = None) -> LegDesign:
    """Leg that has what was identified, nearest to its design.

    Raises:
        ConfigError: nothing was identified, or no leg near the design has these combinations.
    """
    values = outcome.values
    if values is None:
        raise ConfigError("nothing was identified, so there is no design to write")
    found = replace(
        design,
        stiffness=(float(values[INDEX["k1"]]), float(values[INDEX["k2"]])),
        damping=(float(values[INDEX["d1"]]), float(values[INDEX["d2"]])),
    )
    inertial = {*GROUPS["inertia"], "mass"} & {each.name for each in outcome.estimates}
    mass = float(values[INDEX["mass"]])
    if not inertial and abs(mass - design.total_mass) < 1e-9:
        return found
    target = np.array([*(values[INDEX[name]] for name in GROUPS["inertia"]), mass])
    return _nearest(found, target, bars)


def _nearest(design: LegDesign, target: Floats, bars: Bars | None) -> LegDesign:
    """Leg with some combinations (6,), nearest to a design, by Newton's method on the constraints.

    Each step solves `min |x| s.t. h(x_k) + A (x - x_k) = target` for the relative changes x.
    """
    change: Floats = np.zeros(10)
    for _ in range(STEPS):
        now = _combined(design, change, bars)
        if np.all(np.abs(now - target) <= EXACT * np.abs(target)):
            break
        steps = DIFFERENCE * np.eye(10)
        slope = np.stack(
            [
                (_combined(design, change + step, bars) - _combined(design, change - step, bars))
                / (2.0 * DIFFERENCE)
                for step in steps
            ],
            axis=1,
        )
        size = np.abs(target)
        right = (target - now + slope @ change) / size
        found = np.linalg.lstsq(slope / size[:, np.newaxis], right, rcond=None)[0]
        change = np.asarray(found, dtype=np.float64)
    try:
        return _changed(design, change)
    except DesignError as error:
        raise ConfigError(
            f"no leg near design '{design.name}' has the identified inertias: {error}"
        ) from None


def _parts(design: LegDesign, change: Floats) -> list[tuple[float, float, float]]:
    """Mass, centre of mass and inertia of the segments after a relative change (10,)."""
    found = []
    for place, segment in enumerate(design.segments):
        mass, com, inertia = change[3 * place : 3 * place + 3].tolist()
        found.append(
            (
                segment.mass * (1.0 + mass),
                segment.com + com * segment.length,
                segment.inertia * (1.0 + inertia),
            )
        )
    return found


def _combined(design: LegDesign, change: Floats, bars: Bars | None) -> Floats:
    """Combinations (6,) of a leg after a relative change: J1, J2, B, s1, s2 and the mass.

    They are summed from the segments alone, since a step may pass legs that no design admits.
    """
    l1, l2, _ = design.lengths
    (m1, c1, i1), (m2, c2, i2), (m3, c3, i3) = _parts(design, change)
    along = l1 + c3
    own = np.array(
        [
            i1 + m1 * c1**2 + m2 * l1**2 + i3 + m3 * along**2,
            i2 + m2 * c2**2 + m3 * l2**2,
            m2 * l1 * c2 + m3 * along * l2,
            m1 * c1 + m2 * l1 + m3 * along,
            m2 * c2 + m3 * l2,
            design.trunk_mass * (1.0 + float(change[9])) + m1 + m2 + m3,
        ]
    )
    if bars is None:
        return own
    without, within = (base_of(floating_terms(design, GRAVITY, each)) for each in (None, bars))
    own[:5] += [within[name] - without[name] for name in GROUPS["inertia"]]
    return own


def _changed(design: LegDesign, change: Floats) -> LegDesign:
    parts = zip(NAMES, design.segments, _parts(design, change), strict=True)
    segments: dict[str, Any] = {
        name: Segment(mass=mass, length=segment.length, com=com, inertia=inertia)
        for name, segment, (mass, com, inertia) in parts
    }
    return replace(design, trunk_mass=design.trunk_mass * (1.0 + float(change[9])), **segments)


def design_text(design: LegDesign, outcome: Identification) -> str:
    """Design file of an identified leg, with where its numbers come from as comments."""
    lines = [f"# Identified by legbench {__version__} from the runs {', '.join(outcome.runs)}."]
    if not outcome.trusted:
        lines.append("# NOT TO BE TRUSTED:")
        lines += [f"#   {reason}" for reason in outcome.reasons]
    lines += [
        f"# {each.name} = {each.value:.8g} {PARAMETERS[each.name].unit}, 95 % interval "
        f"{each.low:.8g} to {each.high:.8g}"
        for each in outcome.estimates
    ]
    free = {each.name for each in outcome.estimates}
    if free & {*GROUPS["inertia"], "mass"}:
        lines.append(
            "# Masses, centres of mass and inertias of the segments were not measured one by one: "
            "they are the smallest\n# change of the design that has the identified J1, J2, B, s1 "
            "and s2."
        )
    else:
        lines.append("# Masses, centres of mass and inertias are those of the design.")
    return "\n".join(lines) + "\n" + tables_to_toml(design_to_mapping(design))
