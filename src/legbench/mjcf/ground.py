"""What a leg stands on, hangs over or lies on."""

import mujoco
import numpy as np

from legbench.design.rig import PIN_MASS
from legbench.design.setup import Setup, SetupKind
from legbench.mjcf.linkage import connect_sites
from legbench.mjcf.look import add_table, add_tip
from legbench.mjcf.options import Ground, Numerics

HANGING_CLEARANCE = 0.1
"""Gap between the ground and the foot of a leg that hangs from a fixed trunk [m]."""


def add_world(
    spec: mujoco.MjSpec, setup: Setup, ground: Ground, numerics: Numerics, *, seen: bool
) -> None:
    """Add ground or table, the foot tip, and the pin or the contact that holds it.

    What is not to be `seen` has no material, and no table.

    The ground lies one tip radius below zero: a tip height of zero touches at every foot angle.
    """
    add_tip(spec, ground.tip_radius)
    if setup.kind is SetupKind.HFTS:
        if seen:
            add_table(spec)
        return
    drop = HANGING_CLEARANCE if setup.kind is SetupKind.VFTS else 0.0
    spec.worldbody.add_geom(
        name="ground",
        type=mujoco.mjtGeom.mjGEOM_PLANE,
        size=[2.0, 2.0, 0.1],
        pos=[0.0, 0.0, -ground.tip_radius - drop],
        contype=0,
        conaffinity=0,
        material="ground" if seen else "",
    )
    if setup.kind is SetupKind.JUMP:
        _add_contact(spec, ground, numerics)
    if setup.kind is SetupKind.FFS:
        _add_pin(spec, setup, numerics)


def _add_contact(spec: mujoco.MjSpec, ground: Ground, numerics: Numerics) -> None:
    """Only the tip can touch the ground."""
    spec.add_pair(
        name="foot_on_ground",
        geomname1="ground",
        geomname2="tip",
        condim=3,
        friction=[ground.friction, ground.friction, 0.0, 0.0, 0.0],
        solref=numerics.contact_solref,
        solimp=numerics.contact_solimp,
    )


def _add_pin(spec: mujoco.MjSpec, setup: Setup, numerics: Numerics) -> None:
    """Hold the tip at the origin; on a boom the pin slides sideways, as the trunk's arc asks."""
    pin = spec.worldbody.add_body(name="pin")
    if setup.boom_radius:
        pin.explicitinertial, pin.mass = True, PIN_MASS
        pin.ipos, pin.inertia = np.zeros(3), np.full(3, 1e-7)
        pin.add_joint(name="pin_y", type=mujoco.mjtJoint.mjJNT_SLIDE, axis=[0.0, 1.0, 0.0])
    pin.add_site(name="pin", size=[0.004] * 3, group=3)
    connect_sites(spec, "foot_pin", "tip", "pin", numerics)
