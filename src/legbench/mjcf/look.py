"""What the leg looks like: visual geoms, colours, light, camera. None of it moves anything."""

import mujoco
import numpy as np

from legbench.design import LegDesign
from legbench.mjcf.options import Linkage, LinkageKind

GREY, BLUE, GREEN, BLACK, ORANGE = "segment", "trunk", "bar_green", "bar_black", "servo"
BAR_SIDE = 0.014
"""How far the bars run beside the segments; seen only, hinges stay in the plane [m]."""
TIP_BALL = 0.007
"""Radius of the ball that is seen at the tip [m]: more than the 6 mm of the foot's round end, whose
surface would else lie in that of the ball, and the two fight for every pixel."""
MATERIALS = {
    GREY: (0.80, 0.80, 0.82, 1.0),
    BLUE: (0.16, 0.36, 0.62, 1.0),
    GREEN: (0.20, 0.62, 0.32, 1.0),
    BLACK: (0.12, 0.12, 0.14, 1.0),
    ORANGE: (0.87, 0.50, 0.18, 1.0),
    "tip": (0.15, 0.15, 0.15, 1.0),
}


def add_scenery(spec: mujoco.MjSpec) -> None:
    """Materials, light, sky and the size of the off-screen buffer."""
    for name, rgba in MATERIALS.items():
        spec.add_material(name=name, rgba=rgba, specular=0.2, shininess=0.2)
    spec.add_texture(
        name="sky",
        type=mujoco.mjtTexture.mjTEXTURE_SKYBOX,
        builtin=mujoco.mjtBuiltin.mjBUILTIN_GRADIENT,
        rgb1=[0.93, 0.95, 0.98],
        rgb2=[0.72, 0.78, 0.86],
        width=256,
        height=1536,
    )
    spec.add_texture(
        name="tiles",
        type=mujoco.mjtTexture.mjTEXTURE_2D,
        builtin=mujoco.mjtBuiltin.mjBUILTIN_CHECKER,
        mark=mujoco.mjtMark.mjMARK_EDGE,
        rgb1=[0.86, 0.87, 0.88],
        rgb2=[0.82, 0.83, 0.85],
        markrgb=[0.70, 0.72, 0.75],
        width=256,
        height=256,
    )
    tiles = spec.add_material(name="ground", texrepeat=[10, 10], texuniform=True, specular=0.0)
    tiles.textures[mujoco.mjtTextureRole.mjTEXROLE_RGB] = "tiles"
    spec.worldbody.add_light(
        name="sun",
        type=mujoco.mjtLightType.mjLIGHT_DIRECTIONAL,
        pos=[0.0, -1.0, 2.0],
        dir=[0.25, 0.6, -1.0],
        diffuse=[0.5, 0.5, 0.5],
        castshadow=False,
    )
    spec.stat.extent = 0.4
    visual = spec.visual
    visual.headlight.ambient = np.full(3, 0.30, dtype=np.float32)
    visual.headlight.diffuse = np.full(3, 0.35, dtype=np.float32)
    getattr(visual, "global").offwidth = 1920
    getattr(visual, "global").offheight = 1080
    visual.quality.shadowsize = 2048


def dress(spec: mujoco.MjSpec, design: LegDesign, linkage: Linkage) -> None:
    """Give every body of the leg something to see, and the foot its rubber ball."""
    add_trunk_box(spec.body("trunk"))
    names = ("thigh", "shank", "foot")
    for name, length in zip(names, design.lengths, strict=True):
        add_capsule(spec.body(name), name, length, 0.006, GREY)
    add_servo(spec.body("thigh"), "servo_thigh", 0.0)
    add_servo(spec.body("shank"), "servo_shank", 0.0)
    if linkage.kind is LinkageKind.BARS:
        arm, (l1, l2, _) = linkage.crank_length, design.lengths
        rods = (
            ("crank", arm, BAR_SIDE, GREEN),
            ("bar_thigh", l1, BAR_SIDE, GREEN),
            ("bar_shank", l2, -BAR_SIDE, BLACK),
        )
        for name, length, side, colour in rods:
            add_capsule(spec.body(name), f"{name}_rod", length, 0.003, colour, side=side)
        thigh = spec.body("thigh")
        add_capsule(thigh, "thigh_extension", arm, 0.003, GREY, start=l1, side=-BAR_SIDE)
    _visual(
        spec.body("foot").add_geom(
            name="tip_ball",
            type=mujoco.mjtGeom.mjGEOM_SPHERE,
            pos=spec.site("tip").pos.tolist(),
            size=[TIP_BALL, 0.0, 0.0],
            material="tip",
        )
    )


def add_camera(spec: mujoco.MjSpec, height: float) -> None:
    """The `side` camera: looks along +y at the leg, follows nothing, sees a hop."""
    spec.worldbody.add_camera(
        name="side",
        pos=[0.0, -0.80, height],
        xyaxes=[1.0, 0.0, 0.0, 0.0, 0.05, 1.0],
        fovy=40.0,
    )


def add_capsule(
    body: mujoco.MjsBody,
    name: str,
    length: float,
    radius: float,
    material: str,
    *,
    start: float = 0.0,
    side: float = 0.0,
) -> None:
    """A capsule hanging down the body from `start` over `length` [m], `side` out of the plane."""
    _visual(
        body.add_geom(
            name=name,
            type=mujoco.mjtGeom.mjGEOM_CAPSULE,
            fromto=[0.0, side, -start, 0.0, side, -(start + length)],
            size=[radius, 0.0, 0.0],
            material=material,
        )
    )


def add_servo(body: mujoco.MjsBody, name: str, distance: float) -> None:
    """A servo: a short cylinder across the plane, `distance` [m] down the body."""
    _visual(
        body.add_geom(
            name=name,
            type=mujoco.mjtGeom.mjGEOM_CYLINDER,
            fromto=[0.0, -0.011, -distance, 0.0, 0.011, -distance],
            size=[0.012, 0.0, 0.0],
            material=ORANGE,
        )
    )


def add_trunk_box(body: mujoco.MjsBody) -> None:
    """The trunk above the hip."""
    _visual(
        body.add_geom(
            name="trunk_box",
            type=mujoco.mjtGeom.mjGEOM_BOX,
            pos=[0.0, 0.0, 0.032],
            size=[0.055, 0.03, 0.02],
            material=BLUE,
        )
    )


def add_tip(spec: mujoco.MjSpec, radius: float) -> None:
    """The foot tip: the sphere of `radius` [m] that touches."""
    foot, end = spec.body("foot"), spec.site("tip").pos.tolist()
    sphere = mujoco.mjtGeom.mjGEOM_SPHERE
    tip = foot.add_geom(name="tip", type=sphere, pos=end, size=[radius, 0.0, 0.0], group=3)
    tip.contype, tip.conaffinity, tip.mass = 0, 0, 0.0


def add_table(spec: mujoco.MjSpec) -> None:
    """The upright plane behind a leg whose motion plane lies flat in the real setup."""
    table = spec.worldbody.add_geom(
        name="table",
        type=mujoco.mjtGeom.mjGEOM_PLANE,
        size=[2.0, 2.0, 0.1],
        pos=[0.0, 0.05, 0.0],
        quat=[np.sqrt(0.5), np.sqrt(0.5), 0.0, 0.0],
        material="ground",
    )
    table.contype, table.conaffinity = 0, 0


def _visual(geom: mujoco.MjsGeom) -> None:
    geom.contype, geom.conaffinity, geom.group, geom.mass = 0, 0, 1, 0.0
