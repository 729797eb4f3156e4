"""The two ways of coupling the segments: physical parallel bars, or the constraint they make.

`bars` are the paper's leg. A crank at the hip turns with q2; a bar as long as the thigh joins
it to the shank (green in Fig. 1). An extension of the thigh past the knee and a bar as long as
the shank hold the foot parallel to the thigh (black in Fig. 1). Cranks lie along the segments,
so the angle of both parallelograms is the knee angle q2 - q1.
"""

import mujoco
import numpy as np

from legbench.design import LegDesign
from legbench.design.rig import AXIAL_SHARE
from legbench.mjcf.options import Linkage, Numerics

HINGE_AXIS = (0.0, -1.0, 0.0)
"""A positive angle swings a hanging segment forward (+x)."""


def linear_damping(coefficient: float) -> list[float]:
    """MuJoCo's damping polynomial of a viscous damper [N m s/rad]."""
    return [coefficient, 0.0, 0.0]


def _rod(body: mujoco.MjsBody, density: float, length: float) -> None:
    """Give a body the mass of a thin rod hanging from its origin."""
    body.explicitinertial = True
    body.mass = density * length
    body.ipos = np.array([0.0, 0.0, -0.5 * length])
    inertia = body.mass * length**2 / 12.0
    body.inertia = inertia * np.array([1.0, 1.0, AXIAL_SHARE])


def add_bars(spec: mujoco.MjSpec, design: LegDesign, linkage: Linkage, numerics: Numerics) -> None:
    """Add crank and bars to the bodies trunk, thigh, shank and foot, and close both loops."""
    trunk, thigh = spec.body("trunk"), spec.body("thigh")
    arm, density = linkage.crank_length, linkage.density(design)
    l1, l2, _ = design.lengths

    crank = trunk.add_body(name="crank")
    crank.add_joint(name="crank", axis=HINGE_AXIS, damping=linear_damping(design.damping[1]))
    _rod(crank, density, arm)
    along_thigh = crank.add_body(name="bar_thigh", pos=[0.0, 0.0, -arm])
    along_thigh.add_joint(name="bar_thigh", axis=HINGE_AXIS)
    _rod(along_thigh, density, l1)

    along_shank = thigh.add_body(name="bar_shank", pos=[0.0, 0.0, -(l1 + arm)])
    along_shank.add_joint(name="bar_shank", axis=HINGE_AXIS)
    _rod(along_shank, density, l2)

    _close(spec, "loop_thigh", (along_thigh, l1), (spec.body("shank"), arm), numerics)
    _close(spec, "loop_foot", (along_shank, l2), (spec.body("foot"), arm), numerics)


def _close(
    spec: mujoco.MjSpec,
    name: str,
    bar: tuple[mujoco.MjsBody, float],
    segment: tuple[mujoco.MjsBody, float],
    numerics: Numerics,
) -> None:
    """Pin a point of a bar to a point of a segment, both given as distances down the body."""
    sites = []
    for body, distance in (bar, segment):
        site = body.add_site(
            name=f"{name}_{body.name}", pos=[0.0, 0.0, -distance], size=[0.003] * 3
        )
        site.group = 3
        sites.append(site.name)
    connect_sites(spec, name, sites[0], sites[1], numerics)


def connect_sites(
    spec: mujoco.MjSpec, name: str, first: str, second: str, numerics: Numerics
) -> None:
    """Hold two sites together by a `connect` constraint, and measure the gap that remains."""
    spec.add_equality(
        name=name,
        type=mujoco.mjtEq.mjEQ_CONNECT,
        objtype=mujoco.mjtObj.mjOBJ_SITE,
        name1=first,
        name2=second,
        solref=numerics.loop_solref,
        solimp=numerics.loop_solimp,
    )


def add_reduced(spec: mujoco.MjSpec, design: LegDesign, numerics: Numerics) -> None:
    """Couple ankle to knee, and make the tendon on which spring 2 acts."""
    spec.add_equality(
        name="parallel_foot",
        type=mujoco.mjtEq.mjEQ_JOINT,
        name1="ankle",
        name2="knee",
        data=[0.0, -1.0] + [0.0] * 8 + [1.0, 0.0],
        solref=numerics.loop_solref,
        solimp=numerics.loop_solimp,
    )
    tendon = spec.add_tendon(name="q2", damping=linear_damping(design.damping[1]))
    tendon.wrap_joint("hip", 1.0)
    tendon.wrap_joint("knee", 1.0)


def add_friction(spec: mujoco.MjSpec, friction: tuple[float, float], numerics: Numerics) -> None:
    """Add Coulomb friction on q1 and q2 [N m], as hard as the loops.

    Friction on q2 acts on a tendon along hip and knee, which is the shank's absolute angle: on the
    crank of the bars, which weighs next to nothing, it would be lost in the softness of the loop.
    """
    hip = spec.joint("hip")
    hip.frictionloss = friction[0]
    hip.solref_friction = np.array(numerics.loop_solref)
    hip.solimp_friction = np.array(numerics.loop_solimp)
    tendon = spec.add_tendon(name="q2_friction", frictionloss=friction[1])
    tendon.solref_friction = np.array(numerics.loop_solref)
    tendon.solimp_friction = np.array(numerics.loop_solimp)
    tendon.wrap_joint("hip", 1.0)
    tendon.wrap_joint("knee", 1.0)
