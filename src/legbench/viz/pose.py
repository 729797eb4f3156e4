"""Poses of a run's own MuJoCo model from recorded joint angles."""

from typing import final

import mujoco
import numpy as np

from legbench.signals import Floats


@final
class PosedModel:
    """A run's model, moved by its recorded angles; no physics runs."""

    def __init__(self, model: mujoco.MjModel) -> None:
        self.model = model
        self.data = mujoco.MjData(model)
        self._places = {
            self.model.joint(index).name: int(self.model.jnt_qposadr[index])
            for index in range(self.model.njnt)
        }

    def hip(self, recorded: Floats) -> Floats:
        """Hip path (n, 2) that the model can take [m]: constant if its trunk is fixed."""
        if any(name in self._places for name in ("trunk_x", "boom_yaw")):
            return recorded
        return np.tile(self.model.body("trunk").pos[[0, 2]], (len(recorded), 1))

    def positions(self, hip: Floats, joint: Floats) -> Floats:
        """MuJoCo's qpos (n, nq) for a hip path [m] and joint angles [rad], each (n, 2)."""
        knee = joint[:, 1] - joint[:, 0]
        angles = {
            "hip": joint[:, 0],
            "knee": knee,
            "ankle": -knee,
            "crank": joint[:, 1],
            "bar_thigh": -knee,
            "bar_shank": knee,
            **self._trunk(hip),
        }
        qpos = np.tile(self.model.qpos0, (len(joint), 1))
        for name, values in angles.items():
            if name in self._places:
                qpos[:, self._places[name]] = values
        return qpos

    def pose(self, qpos: Floats) -> None:
        """Put the model into one posture (nq,): `data.xpos`, `data.geom_xpos` and so on."""
        self.data.qpos[:] = qpos
        mujoco.mj_kinematics(self.model, self.data)

    def _trunk(self, hip: Floats) -> dict[str, Floats]:
        """Joint values, by name, that put the trunk's hip there, on slides or on a boom."""
        shift = hip - self.model.body("trunk").pos[[0, 2]]
        if "boom_yaw" not in self._places:
            return {"trunk_x": shift[:, 0], "trunk_z": shift[:, 1]}
        radius = float(np.linalg.norm(self.model.joint("boom_yaw").pos))
        roll = np.arcsin(shift[:, 1] / radius)
        return {"boom_roll": roll, "boom_yaw": -np.arcsin(shift[:, 0] / (radius * np.cos(roll)))}
