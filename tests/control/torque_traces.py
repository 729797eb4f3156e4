"""Observations of a leg whose springs somebody else pulls."""

import numpy as np

from legbench.control import AbstractController, LegTargets
from legbench.design import LegDesign
from legbench.signals import Command, Floats, Observation

PERIOD = 0.001


def seen(cycle: int, motor_pos: Floats, radial_torque: Floats | float) -> Observation:
    """What a plant shows at a cycle, spring torques along z2 alone (...) [N m]."""
    load = np.sqrt(0.5) * np.asarray(radial_torque, dtype=np.float64)
    torque = np.stack([-load, load], axis=-1)
    still = np.zeros_like(torque)
    return Observation(
        time=cycle * PERIOD,
        motor_pos=np.broadcast_to(motor_pos, torque.shape).copy(),
        joint_pos=still,
        joint_vel=still,
        spring_torque=torque,
        applied_pos=still,
    )


class Pulled:
    """A controller fed with torques; the motors are where it put them."""

    def __init__(self, controller: AbstractController, rest: Floats | float) -> None:
        self.controller = controller
        self._motor_pos, self._cycle = controller.start_motor_pos, 0
        controller.reset(seen(0, self._motor_pos, rest))

    def pull(self, radial_torque: Floats | float, cycles: int = 1) -> Command:
        """The last of so many commands under that torque."""
        command = Command.holding(self._motor_pos)
        for _ in range(cycles):
            command = self.controller.step(seen(self._cycle, self._motor_pos, radial_torque))
            self._motor_pos = command.motor_pos
            self._cycle += 1
        return command

    def phase(self, radial_torque: float, cycles: int = 1) -> int:
        return int(self.pull(radial_torque, cycles).phase)


def load_of_standing(targets: LegTargets, motor_pos: Floats) -> Floats:
    """Radial spring torque (...) of the leg at rest [N m]; negative."""
    link = targets.link_at_rest(motor_pos)
    designs = [targets.designs] if isinstance(targets.designs, LegDesign) else targets.designs
    stiffness = np.array([design.stiffness for design in designs]).reshape(link.shape)
    return targets.radial(stiffness * (motor_pos - link))
