"""Design + setup + linkage -> `mujoco.MjSpec`."""

import mujoco
import numpy as np

from legbench.design import LegDesign, Segment
from legbench.design.rig import AXIAL_SHARE, TRUNK_COM_HEIGHT, TRUNK_INERTIA
from legbench.design.setup import SetupKind
from legbench.design.statics import GRAVITY
from legbench.errors import ConfigError
from legbench.mjcf import look, sensors
from legbench.mjcf.ground import add_world
from legbench.mjcf.linkage import (
    HINGE_AXIS,
    add_bars,
    add_friction,
    add_reduced,
    linear_damping,
)
from legbench.mjcf.numerics import apply_numerics
from legbench.mjcf.options import BuildOptions, Linkage, LinkageKind, Numerics
from legbench.mjcf.pose import BENT, hip_height, rest_qpos


def build_spec(design: LegDesign, options: BuildOptions) -> mujoco.MjSpec:
    """The leg as an editable MuJoCo specification; `spec.compile()` makes the model.

    Coordinates: x forward, y to the left, z up, motion in the x-z plane. Joints `hip` = q1,
    `knee` = q2 - q1, `ankle` = q1 - q2; `trunk_x`, `trunk_z` where the trunk moves. Actuators
    `motor_1`, `motor_2` take motor positions [rad] and act through the series springs.

    Raises:
        ConfigError: the bars outweigh the trunk, no step, bar or boom suits the leg, or MuJoCo
            refuses a mass or an inertia.
    """
    spec = _assembled(design, options, dry=any(options.friction), seen=True)
    model = _compiled(spec, design)
    spec.add_key(name="bent", qpos=rest_qpos(model, design, BENT).tolist(), ctrl=BENT.tolist())
    return spec


def bare_model(
    design: LegDesign, options: BuildOptions, *, dry: bool | None = None
) -> mujoco.MjModel:
    """Compile a model that moves to the bit as that of `build_spec`, and cannot be looked at.

    Without textures, geoms to see and keyframe it takes a hundredth of the memory.

    Args:
        design: the leg.
        options: setup, linkage, ground, numerics, friction.
        dry: whether joints have dry friction, be it zero: models of one batch have the same parts.

    Raises:
        ConfigError: as `build_spec`.
    """
    dry = any(options.friction) if dry is None else dry
    return _compiled(_assembled(design, options, dry=dry, seen=False), design)


def _assembled(design: LegDesign, options: BuildOptions, *, dry: bool, seen: bool) -> mujoco.MjSpec:
    setup, numerics = options.setup, options.numerics.fitted([design], options.linkage)
    setup.check_boom(design)
    spec = mujoco.MjSpec()
    spec.modelname = f"{design.name}_{setup.kind}_{options.linkage.kind}"
    spec.compiler.degree = False
    apply_numerics(spec, numerics)
    spec.option.enableflags |= int(mujoco.mjtEnableBit.mjENBL_ENERGY)
    flat = setup.kind is SetupKind.HFTS
    spec.option.gravity = GRAVITY * np.array([0.0, 1.0, 0.0] if flat else [0.0, 0.0, -1.0])
    if seen:
        look.add_scenery(spec)

    height = hip_height(design, BENT)
    _add_trunk(spec, design, options, height)
    _add_segments(spec, design, numerics)
    if options.linkage.kind is LinkageKind.BARS:
        add_bars(spec, design, options.linkage, numerics)
    else:
        add_reduced(spec, design, numerics)
    _add_springs(spec, design, options.linkage.kind)
    if dry:
        add_friction(spec, options.friction, numerics)
    if seen:
        look.dress(spec, design, options.linkage)
    add_world(spec, setup, options.ground, numerics, seen=seen)
    sensors.add_sensors(spec, setup.kind, bars=options.linkage.kind is LinkageKind.BARS)
    if seen:
        look.add_camera(spec, 0.6 * height)
    return spec


def _add_trunk(
    spec: mujoco.MjSpec, design: LegDesign, options: BuildOptions, height: float
) -> None:
    setup = options.setup
    base = [0.0, 0.0, height] if not setup.trunk_moves or setup.boom_radius else [0.0, 0.0, 0.0]
    trunk = spec.worldbody.add_body(name="trunk", pos=base)
    trunk.explicitinertial = True
    trunk.mass = _trunk_mass(design, options.linkage)
    trunk.ipos = np.array([0.0, 0.0, TRUNK_COM_HEIGHT])
    trunk.inertia = np.array(TRUNK_INERTIA)
    trunk.add_site(name="hip", size=[0.004] * 3, group=3)
    if not setup.trunk_moves:
        return
    if setup.boom_radius:
        pivot = [0.0, -setup.boom_radius, 0.0]
        # A force c v at the end of an arm r turns the boom back by c r^2 omega.
        yaw, roll = (value * setup.boom_radius**2 for value in options.guide_damping)
        for name, axis, damping in (
            ("boom_yaw", [0.0, 0.0, 1.0], yaw),
            ("boom_roll", [1.0, 0.0, 0.0], roll),
        ):
            trunk.add_joint(name=name, pos=pivot, axis=axis, damping=linear_damping(damping))
        return
    forward, upward = options.guide_damping
    for name, axis, damping in (
        ("trunk_x", [1.0, 0.0, 0.0], forward),
        ("trunk_z", [0.0, 0.0, 1.0], upward),
    ):
        slide = trunk.add_joint(name=name, type=mujoco.mjtJoint.mjJNT_SLIDE, axis=axis)
        slide.damping = np.array(linear_damping(damping))


def _trunk_mass(design: LegDesign, linkage: Linkage) -> float:
    """What is left for the trunk, so that trunk, leg and bars weigh what the design says [kg]."""
    bars = linkage.mass(design)
    if bars >= design.trunk_mass:
        raise ConfigError(
            f"the bars weigh {bars:g} kg, which the trunk of {design.trunk_mass:g} kg is lightened "
            "by: take lighter bars, a heavier trunk, or linkage 'reduced'"
        )
    return design.trunk_mass - bars


def _add_segments(spec: mujoco.MjSpec, design: LegDesign, numerics: Numerics) -> None:
    parent, down = spec.body("trunk"), 0.0
    limits = {"hip": design.limits.hip, "knee": design.limits.knee, "ankle": None}
    names = ("thigh", "shank", "foot")
    for name, joint, segment in zip(names, limits, design.segments, strict=True):
        body = parent.add_body(name=name, pos=[0.0, 0.0, -down])
        hinge = body.add_joint(name=joint, axis=HINGE_AXIS)
        if joint == "hip":
            hinge.damping = np.array(linear_damping(design.damping[0]))
        if (span := limits[joint]) is not None:
            hinge.limited, hinge.range = mujoco.mjtLimited.mjLIMITED_TRUE, span
            hinge.solref_limit = np.array(numerics.stop_solref)
            hinge.solimp_limit = np.array(numerics.stop_solimp)
        _set_inertia(body, segment)
        parent, down = body, segment.length
    parent.add_site(name="tip", pos=[0.0, 0.0, -down], size=[0.004] * 3, group=3)


def _set_inertia(body: mujoco.MjsBody, segment: Segment) -> None:
    """A slender segment: the inertia about its own axis takes no part in planar motion."""
    body.explicitinertial = True
    body.mass = segment.mass
    body.ipos = np.array([0.0, 0.0, -segment.com])
    body.inertia = segment.inertia * np.array([1.0, 1.0, AXIAL_SHARE])


def _add_springs(spec: mujoco.MjSpec, design: LegDesign, kind: LinkageKind) -> None:
    """Series springs as position actuators: torque k (motor - link), no damping of their own."""
    second = (
        (mujoco.mjtTrn.mjTRN_JOINT, "crank")
        if kind is LinkageKind.BARS
        else (mujoco.mjtTrn.mjTRN_TENDON, "q2")
    )
    for index, (transmission, target) in enumerate(((mujoco.mjtTrn.mjTRN_JOINT, "hip"), second)):
        stiffness = design.stiffness[index]
        spec.add_actuator(
            name=f"motor_{index + 1}",
            trntype=transmission,
            target=target,
            gaintype=mujoco.mjtGain.mjGAIN_FIXED,
            gainprm=[stiffness] + [0.0] * 9,
            biastype=mujoco.mjtBias.mjBIAS_AFFINE,
            biasprm=[0.0, -stiffness] + [0.0] * 8,
        )


def _compiled(spec: mujoco.MjSpec, design: LegDesign) -> mujoco.MjModel:
    try:
        return spec.compile()
    except ValueError as error:
        why = " ".join(str(error).split())
        raise ConfigError(f"MuJoCo refuses the leg of design '{design.name}': {why}") from error
