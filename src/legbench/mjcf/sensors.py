"""The truth that the model reports, and where it stands in MuJoCo's sensor array."""

from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np

from legbench.design.setup import SetupKind
from legbench.signals import Bools, Floats

SITE = mujoco.mjtObj.mjOBJ_SITE
GEOM = mujoco.mjtObj.mjOBJ_GEOM
FOUND_AND_FORCE = 0b11
"""Contact sensor fields: bit `mjCONDATA_FOUND`, bit `mjCONDATA_FORCE`."""
NET_FORCE = 3
"""Reduction of the contact sensor: one force, in world axes."""
LOOPS = {
    "gap_thigh": ("loop_thigh_shank", "loop_thigh_bar_thigh"),
    "gap_foot": ("loop_foot_foot", "loop_foot_bar_shank"),
}


def add_sensors(spec: mujoco.MjSpec, kind: SetupKind, *, bars: bool) -> None:
    """Add the sensors; position and velocity ones describe the state, forces the last step.

    None of them is for energy: after RK4 the sensor of the kinetic energy still shows the last
    intermediate stage. The plants read the energy of the state, which the model computes too.
    """

    def add(name: str, kind: mujoco.mjtSensor, **target: Any) -> None:
        spec.add_sensor(name=name, type=kind, **target)

    add("trunk_pos", mujoco.mjtSensor.mjSENS_FRAMEPOS, objtype=SITE, objname="hip")
    add("foot_pos", mujoco.mjtSensor.mjSENS_FRAMEPOS, objtype=SITE, objname="tip")
    add("trunk_vel", mujoco.mjtSensor.mjSENS_FRAMELINVEL, objtype=SITE, objname="hip")
    for name, (segment, bar) in LOOPS.items() if bars else ():
        frame = {"objtype": SITE, "objname": segment, "reftype": SITE, "refname": bar}
        add(name, mujoco.mjtSensor.mjSENS_FRAMEPOS, **frame)
    if kind is SetupKind.JUMP:
        pair = {"objtype": GEOM, "objname": "ground", "reftype": GEOM, "refname": "tip"}
        reading = [FOUND_AND_FORCE, NET_FORCE, 1]
        add("contact", mujoco.mjtSensor.mjSENS_CONTACT, **pair, intprm=reading)
    if kind is SetupKind.FFS:
        add("pin_force", mujoco.mjtSensor.mjSENS_FORCE, objtype=SITE, objname="pin")


@dataclass(frozen=True, slots=True, kw_only=True)
class SensorLayout:
    """Slices of the sensor array; vectors in the plane are every other entry of (x, y, z)."""

    trunk_pos: slice
    trunk_vel: slice
    foot_pos: slice
    force: slice
    """Force of the ground on the foot; a slice of zeros where nothing touches."""
    found: int | None
    """Index of the contact sensor's flag; none where the setup decides about contact."""
    always_contact: bool
    gaps: slice | None

    @classmethod
    def of(cls, model: mujoco.MjModel) -> "SensorLayout":
        """Look the sensors up once."""
        address = {
            model.sensor(index).name: int(model.sensor_adr[index]) for index in range(model.nsensor)
        }

        def plane(start: int) -> slice:
            return slice(start, start + 3, 2)

        found = address.get("contact")
        pinned = "pin_force" in address
        if found is not None:
            force = plane(found + 1)
        elif pinned:
            force = plane(address["pin_force"])
        else:
            force = slice(0, 0)
        gaps = address.get("gap_thigh")
        return cls(
            trunk_pos=plane(address["trunk_pos"]),
            trunk_vel=plane(address["trunk_vel"]),
            foot_pos=plane(address["foot_pos"]),
            force=force,
            found=found,
            always_contact=pinned,
            gaps=None if gaps is None else slice(gaps, gaps + 6),
        )

    def views(self, values: Floats) -> "SensorViews":
        """The quantities in a sensor array (..., n) that changes in place."""
        legs = values.shape[:-1]
        gaps = np.zeros((*legs, 6)) if self.gaps is None else values[..., self.gaps]
        held = np.full(legs, 1.0 if self.always_contact else 0.0)
        return SensorViews(
            trunk_pos=values[..., self.trunk_pos],
            trunk_vel=values[..., self.trunk_vel],
            foot_pos=values[..., self.foot_pos],
            force=np.zeros((*legs, 2)) if self.force.stop == 0 else values[..., self.force],
            found=held if self.found is None else values[..., self.found],
            gap_x=gaps[..., 0::3],
            gap_z=gaps[..., 2::3],
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class SensorViews:
    """Views of a live sensor array, sliced once: slicing in the loop costs as much as copying."""

    trunk_pos: Floats
    """(..., 2) [m]"""
    trunk_vel: Floats
    """(..., 2) [m/s]"""
    foot_pos: Floats
    """(..., 2) [m]"""
    force: Floats
    """Ground on foot (..., 2) [N]; zeros where no ground is."""
    found: Floats
    """Positive where the foot is held by the ground (...)."""
    gap_x: Floats
    """Opening of both loops, forward (..., 2) [m]; zeros where there are no bars."""
    gap_z: Floats
    """Opening of both loops, upward (..., 2) [m]."""

    @property
    def contact(self) -> Bools:
        """Whether the foot is held by the ground (...)."""
        # One leg's is compared as a number: an array without dimensions costs five times as much.
        return self.found[()] > 0.0
