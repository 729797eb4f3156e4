"""Models of legs in every setup, and the law of their motion from geometry alone."""

from dataclasses import replace
from pathlib import Path

import mujoco
import numpy as np

from legbench.design import LegDesign, load_design
from legbench.design.setup import Setup, SetupKind
from legbench.kinematics import leg_points
from legbench.mjcf import BuildOptions, Linkage, LinkageKind, build_spec, rest_qpos, to_xml
from legbench.signals import Floats

FOLDER = Path(__file__).parents[2] / "models"
MODELS_BY_NAME = {name: load_design(FOLDER / f"{name}.toml") for name in ("optimal", "prototype")}
SETUPS = {
    "hfts": Setup(kind=SetupKind.HFTS),
    "vfts": Setup(kind=SetupKind.VFTS),
    "ffs": Setup(kind=SetupKind.FFS),
    "boom": Setup(kind=SetupKind.FFS, boom_radius=1.2),
    "jump": Setup(kind=SetupKind.JUMP),
}
LINKAGES = {kind.value: kind for kind in LinkageKind}


def options(setup: str, linkage: str, bar_density: float | None = None) -> BuildOptions:
    links = Linkage(kind=LINKAGES[linkage])
    if bar_density is not None:
        links = replace(links, bar_density=bar_density)
    return BuildOptions(setup=SETUPS[setup], linkage=links)


def model_of(design: LegDesign, setup: str, linkage: str) -> mujoco.MjModel:
    return mujoco.MjModel.from_xml_string(to_xml(build_spec(design, options(setup, linkage))))


def posed(model: mujoco.MjModel, design: LegDesign, joint_pos: Floats) -> mujoco.MjData:
    data = mujoco.MjData(model)
    data.qpos[:] = rest_qpos(model, design, joint_pos)
    mujoco.mj_forward(model, data)
    return data


def postures(low: float = 0.2, high: float = 1.4, side: float = 0.5) -> list[Floats]:
    """Half angles and polar angles over the working range, hip limits left aside."""
    return [
        np.array([polar - half, polar + half])
        for half in np.linspace(low, high, 7)
        for polar in np.linspace(-side, side, 5)
    ]


def embedding(model: mujoco.MjModel, design: LegDesign, joint_pos: Floats) -> Floats:
    """How MuJoCo's velocities follow q1 and q2 (nv, 2), by central differences of `rest_qpos`."""
    step = 1e-5
    sides = step * np.eye(2)
    columns = [
        rest_qpos(model, design, joint_pos + side) - rest_qpos(model, design, joint_pos - side)
        for side in sides
    ]
    return np.stack(columns, axis=-1) / (2.0 * step)


def centres(design: LegDesign, joint_pos: np.ndarray) -> np.ndarray:
    """Centres of mass of thigh, shank and foot in the hip's frame (3, 2); takes complex angles."""
    l1, l2, _ = design.lengths
    c1, c2, c3 = (segment.com for segment in design.segments)
    thigh = leg_points(joint_pos, (c1, l2, 0.0))[1]
    shank = leg_points(joint_pos, (l1, c2, 0.0))[2]
    foot = leg_points(joint_pos, (l1, l2, c3))[3]
    return np.stack([thigh, shank, foot])


def slopes(design: LegDesign, joint_pos: Floats) -> Floats:
    """Derivatives of `centres` by q1 and q2 (3, 2, 2), by the complex step: exact."""
    tiny = 1e-30
    columns = [np.imag(centres(design, joint_pos + 1j * tiny * side)) / tiny for side in np.eye(2)]
    return np.stack(columns, axis=-1)


def mass_matrix(design: LegDesign, joint_pos: Floats) -> Floats:
    """Of the coordinates hip x, hip z, q1, q2 (4, 4), from the kinetic energy of rigid bodies."""
    slope = slopes(design, joint_pos)
    matrix = np.zeros((4, 4))
    matrix[:2, :2] += design.trunk_mass * np.eye(2)
    for segment, by_joint in zip(design.segments, slope, strict=True):
        jacobian = np.hstack([np.eye(2), by_joint])
        matrix += segment.mass * jacobian.T @ jacobian
    inertia = [segment.inertia for segment in design.segments]
    matrix[2, 2] += inertia[0] + inertia[2]
    matrix[3, 3] += inertia[1]
    return matrix
