"""The optimal leg to the last bit: Table I's ratios put through the design conditions.

Table II is this leg rounded to grams and millimetres, and a rounded leg is matched only nearly.
"""

import numpy as np

from legbench.design import LegDesign, Limits, Segment

RATIOS = {"rest": 0.95, "l1": 0.4837, "c1": 0.15, "c2": 0.5, "c3": 0.15, "i2": 1 / 16, "i3": 0.5}
SYSTEM_MASS, LEG_MASS, LEG_COM = 1.0, 0.363, 0.068
REST_LENGTH, LEG_STIFFNESS = 0.253, 905.0


def exact_design(*, damping: float = 0.0, limits: Limits | None = None) -> LegDesign:
    """Solve eqs. (5), (7), (9) and the biological conditions for the ratios."""
    l2 = REST_LENGTH / RATIOS["rest"] / 2.0
    l1 = RATIOS["l1"] * l2
    l3 = l2 - l1
    c1, c2, c3 = RATIOS["c1"] * l1, RATIOS["c2"] * l2, RATIOS["c3"] * l3
    conditions = np.array(
        [[1.0, 1.0, 1.0], [c1, l1 + c2, l1 + l2 + c3], [-c1, -(l1 - c2), l3 - c3]]
    )
    m1, m2, m3 = np.linalg.solve(conditions, [LEG_MASS, LEG_MASS * LEG_COM, 0.0]).tolist()
    i2, i3 = RATIOS["i2"] * m2 * l2**2, RATIOS["i3"] * m3 * l3**2
    i1 = (
        2.0 * c1 * m1 * l3
        + m2 * l2**2
        - 2.0 * c2 * m2 * l2
        + 2.0 * c1 * m1 * l1
        - (m2 + m3) * l3**2
        + 2.0 * c3 * m3 * l3
        + m2 * c2**2
        + i2
        - m1 * c1**2
        - m3 * c3**2
        - i3
    )
    stiffness = LEG_STIFFNESS * 2.0 * l2**2 * (1.0 - RATIOS["rest"] ** 2)
    return LegDesign(
        name="exact",
        trunk_mass=SYSTEM_MASS - LEG_MASS,
        thigh=Segment(mass=m1, length=l1, com=c1, inertia=i1),
        shank=Segment(mass=m2, length=l2, com=c2, inertia=i2),
        foot=Segment(mass=m3, length=l3, com=c3, inertia=i3),
        stiffness=(stiffness, stiffness),
        damping=(damping, damping),
        limits=limits or Limits(),
    )
