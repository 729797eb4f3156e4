"""Requirements of a quadruped's leg by body mass: the paper's leg, scaled as mammals scale.

    y(M) = y(4 kg) (M / 4 kg)^b

The values at 4 kg are those of section III-B; the exponents b are published regressions over
mammals. `docs/design.md` names what each was measured on.
"""

import math

from legbench.design.requirements import PAPER, Requirements
from legbench.errors import DesignError

REFERENCE_MASS = 4.0
"""Body mass for which the paper states its values [kg]."""
LEGS = 4
"""Number of legs, each of which carries its share of the body (section III-B)."""

LEG_MASS_EXPONENT = 1.0
"""Limb mass, 44 species: Kilbourne and Hoffman 2013, doi 10.1371/journal.pone.0078392."""
LEG_LENGTH_EXPONENT = 0.40
"""Limb length, the same study; mammals' legs grow faster than geometric similarity."""
LEG_COM_EXPONENT = 1.0 / 3.0
"""Centre of mass of the hind limb, the same study: geometric similarity."""
STIFFNESS_EXPONENT = 0.67
"""Leg spring of trotting and hopping animals, 0.1 to 140 kg: Farley, Glasheen and McMahon 1993,
J. exp. Biol. 185, 71-86."""
MASS_RANGE = (0.1, 140.0)
"""Body masses that the stiffness regression covers [kg]."""


def quadruped(body_mass: float) -> Requirements:
    """Requirements for one leg of a quadruped of `body_mass` [kg].

    Damping is not biological: it keeps the damping ratio of the radial oscillation, d ~ l^2
    sqrt(k m).

    Raises:
        DesignError: a mass outside the range of the regressions.
    """
    low, high = MASS_RANGE
    if not (math.isfinite(body_mass) and low <= body_mass <= high):
        raise DesignError(
            f"body mass is {body_mass:g} kg; the published scaling covers {low:g} to {high:g} kg: "
            "outside it, write a requirements file"
        )
    size = body_mass / REFERENCE_MASS
    length = size**LEG_LENGTH_EXPONENT
    stiffness = size**STIFFNESS_EXPONENT
    return Requirements(
        name="quadruped" if body_mass == REFERENCE_MASS else f"quadruped_{body_mass:g}kg",
        total_mass=body_mass / LEGS,
        leg_mass=PAPER.leg_mass * size**LEG_MASS_EXPONENT,
        leg_com=PAPER.leg_com * size**LEG_COM_EXPONENT,
        relaxed_length=PAPER.relaxed_length * length,
        leg_stiffness=PAPER.leg_stiffness * stiffness,
        damping=PAPER.damping * length**2 * math.sqrt(stiffness * size),
    )
