"""Observations and commands, which plant and controller exchange, and the columns of a recording.

Every array has the leg's components last; a batch adds one leading dimension, nothing else
changes. Angles are absolute in the plane of motion, measured from straight down, positive
forward: `q1` is the thigh (and the foot, parallel to it), `q2` the shank.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]
Ints = NDArray[np.int64]
MEASURED = ("motor_pos", "joint_pos", "spring_torque")
"""Signals that a plant may not know, being not a number then: drives with one encoder a joint."""
REST = 0
"""Code of the phase at rest, which every controller that is built in declares."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Truth:
    """Quantities that only a simulation knows; `(..., 2)` are (forward, up) in the plane of motion.

    The contact force is that of the plant's last internal step, one substep before `time`:
    a solver reports a force over a step, not at an instant.
    """

    trunk_pos: Floats
    """Position of the hip in the world (..., 2) [m]."""
    trunk_vel: Floats
    """Velocity of the hip in the world (..., 2) [m/s]."""
    foot_pos: Floats
    """Position of the foot tip in the world (..., 2) [m]."""
    contact_force: Floats
    """Force of the ground on the foot (..., 2) [N]."""
    contact: Bools
    """Whether the foot touches the ground (...)."""
    energy: Floats
    """Gravitational potential and kinetic energy of all bodies (..., 2) [J]."""
    loop_gap: Floats
    """Opening of the thigh-side and foot-side bar loops (..., 2) [m]."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Observation:
    """Observation of a plant at `time`: the effect of the command given before that time."""

    time: float
    """Plant time since reset [s]."""
    motor_pos: Floats
    """Measured motor positions (..., 2) [rad]."""
    joint_pos: Floats
    """Measured link angles q1, q2 (..., 2) [rad]."""
    joint_vel: Floats
    """Velocities of the links (..., 2) [rad/s]."""
    spring_torque: Floats
    """Torque of the series springs on the links, stiffness only (..., 2) [N m]."""
    applied_pos: Floats
    """Command as the lowest layer let it through, before the servo (..., 2) [rad]."""
    truth: Truth | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Command:
    """Command of a controller to the motors over the next period."""

    motor_pos: Floats
    """Desired motor positions (..., 2) [rad]."""
    phase: Ints
    """Code of the controller's phase (...)."""
    signals: Floats | None = None
    """Values of the controller's own signals, components in the order of its description
    (..., n); none if it declares none."""

    @classmethod
    def holding(cls, motor_pos: Floats) -> "Command":
        """Return the command to stay at `motor_pos` (..., 2) [rad], at rest."""
        phase = np.full(motor_pos.shape[:-1], REST, dtype=np.int64)
        return cls(motor_pos=motor_pos, phase=phase)


@dataclass(frozen=True, slots=True)
class Signal:
    """One recorded quantity: its columns are `name` or `name_<component>`."""

    name: str
    components: tuple[str, ...]
    unit: str
    doc: str

    @property
    def columns(self) -> tuple[str, ...]:
        """Column names on disk, one a component."""
        if not self.components:
            return (self.name,)
        return tuple(f"{self.name}_{component}" for component in self.components)


JOINTS = ("1", "2")
PLANE = ("x", "z")

SIGNALS: tuple[Signal, ...] = (
    Signal("command_pos", JOINTS, "rad", "motor positions that the controller asked for"),
    Signal("applied_pos", JOINTS, "rad", "the command that went to the servo, one row later"),
    Signal("motor_pos", JOINTS, "rad", "measured motor positions"),
    Signal("joint_pos", JOINTS, "rad", "measured link angles q1, q2"),
    Signal("joint_vel", JOINTS, "rad/s", "link velocities"),
    Signal("spring_torque", JOINTS, "N m", "torque of the series springs on the links"),
    Signal("phase", (), "-", "Phase of the controller"),
    Signal("trunk_pos", PLANE, "m", "hip in the world (simulation only)"),
    Signal("trunk_vel", PLANE, "m/s", "velocity of the hip (simulation only)"),
    Signal("foot_pos", PLANE, "m", "foot tip in the world (simulation only)"),
    Signal("contact_force", PLANE, "N", "ground on foot (simulation only)"),
    Signal("contact", (), "-", "1 where the foot touches the ground (simulation only)"),
    Signal("energy", ("potential", "kinetic"), "J", "gravity and motion (simulation only)"),
    Signal("loop_gap", ("thigh", "foot"), "m", "opening of the bar loops (simulation only)"),
    Signal("cycle_us", (), "us", "wall time of the cycle before this row, waiting included"),
    Signal("late_us", (), "us", "wall time past the cycle's deadline (0 in virtual time)"),
)
