"""Legs as they come out of a workshop, scattered around their design."""

from dataclasses import replace

import numpy as np

from legbench.design import LegDesign, Segment
from legbench.signals import Floats
from legbench.synthesis.tolerance import FARTHEST, Tolerances


def scatter(design: LegDesign, tolerances: Tolerances, count: int, seed: int) -> list[LegDesign]:
    """`count` legs made of one design; the same seed draws the same errors for every design."""
    draws = np.random.default_rng(seed).standard_normal((count, 16))
    draws = np.clip(draws, -FARTHEST, FARTHEST)
    return [_made(design, tolerances, row) for row in draws]


def _made(design: LegDesign, tolerances: Tolerances, draw: Floats) -> LegDesign:
    """One leg from 16 standard normal numbers."""
    mass, com, inertia = draw[0:3], draw[3:6], draw[6:9]
    length, stiffness, damping = draw[9:11], draw[11:13], draw[13:15]
    thigh = design.thigh.length + tolerances.length * float(length[0])
    foot = design.foot.length + tolerances.length * float(length[1])
    segments = [
        Segment(
            mass=segment.mass * (1.0 + tolerances.mass * float(mass[index])),
            length=long,
            com=float(np.clip(segment.com + tolerances.com * float(com[index]), 0.0, long)),
            inertia=segment.inertia * (1.0 + tolerances.inertia * float(inertia[index])),
        )
        for index, (segment, long) in enumerate(
            zip(design.segments, (thigh, thigh + foot, foot), strict=True)
        )
    ]
    first, second = 1.0 + tolerances.stiffness * stiffness
    third, fourth = 1.0 + tolerances.damping * damping
    return replace(
        design,
        trunk_mass=design.trunk_mass * (1.0 + tolerances.mass * float(draw[15])),
        thigh=segments[0],
        shank=segments[1],
        foot=segments[2],
        stiffness=(design.stiffness[0] * float(first), design.stiffness[1] * float(second)),
        damping=(design.damping[0] * float(third), design.damping[1] * float(fourth)),
    )
