"""Pictures of a run's model at given rows."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import final

import mujoco
import numpy as np

from legbench.kinematics import leg_points
from legbench.recording.reader import Recording
from legbench.signals import Floats, Ints
from legbench.viz.drafts import require_rows
from legbench.viz.facts import facts_of
from legbench.viz.film.offscreen import Image, OffScreen
from legbench.viz.hip import hip_of
from legbench.viz.pose import PosedModel
from legbench.viz.run_model import model_of

CAMERA = "side"
SAMPLES = 4
"""Samples of a pixel where edges are smooth."""
CALM = 0.5
"""Time over which the hip is averaged for the camera to follow smoothly [s]."""


ABOVE, BELOW = 0.10, 0.06
"""Room over the highest hip, for the trunk, and under the lowest foot [m]."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Size:
    """Size of an image [pixels]; both sides are even, as video encoders require."""

    width: int
    height: int


@final
class Film:
    """A run's model, ready to be photographed from the side.

    Raises:
        RecordingError: the run has no rows.
        FormatError: its manifest describes no model that can be drawn.
    """

    def __init__(self, recording: Recording) -> None:
        require_rows(recording)
        facts = facts_of(recording.description)
        self._posed = PosedModel(model_of(recording.description))
        self._camera = self._posed.model.camera(CAMERA).id
        self._hip = self._posed.hip(hip_of(recording, facts))
        self._joint = recording["joint_pos"]
        self._time = recording.time
        self._start = self._frame(leg_points(self._joint, facts.run.design.lengths))

    def shoot(
        self, rows: Ints, size: Size, *, follow: bool = True, smooth: bool = True
    ) -> Iterator[Image]:
        """Images of the rows, one after the other; the camera moves along, or stays amid them.

        Args:
            rows: rows to show.
            size: size of each image.
            follow: whether the camera follows the hip.
            smooth: draw edges smoothly, for which the time of three plain images is needed.

        Raises:
            MissingExtraError: the machine has no OpenGL that works.
        """
        model, data = self._posed.model, self._posed.data
        # A buffer larger than the image would be cleared and resolved as a whole.
        model.vis.global_.offwidth, model.vis.global_.offheight = size.width, size.height
        model.vis.quality.offsamples = SAMPLES if smooth else 0
        path = self._start + self._ahead(rows, follow)[:, None] * [1.0, 0.0, 0.0]
        scene = mujoco.MjvScene(model, maxgeom=200)
        option, perturb, camera = mujoco.MjvOption(), mujoco.MjvPerturb(), mujoco.MjvCamera()
        camera.type, camera.fixedcamid = mujoco.mjtCamera.mjCAMERA_FIXED, self._camera
        with OffScreen(model, size.width, size.height) as screen:
            qpos = self._posed.positions(self._hip[rows], self._joint[rows])
            for place, eye in zip(qpos, path, strict=True):
                model.cam_pos[self._camera] = eye
                self._posed.pose(place)
                mujoco.mj_camlight(model, data)
                everything = mujoco.mjtCatBit.mjCAT_ALL.value
                mujoco.mjv_updateScene(model, data, option, perturb, camera, everything, scene)
                scene.flags[mujoco.mjtRndFlag.mjRND_SHADOW] = False
                yield screen.draw(scene)

    def _frame(self, points: Floats) -> Floats:
        """Camera position (3,) from which every height that trunk and leg reach is seen [m]."""
        model, data = self._posed.model, self._posed.data
        mujoco.mj_kinematics(model, data)
        mujoco.mj_camlight(model, data)
        heights = self._hip[:, 1:] + points[..., 1]
        low, high = heights.min() - BELOW, heights.max() + ABOVE
        half_angle = 0.5 * np.radians(model.cam_fovy[self._camera])
        distance = 0.5 * (high - low) / np.tan(half_angle)
        backwards = data.cam_xmat[self._camera].reshape(3, 3)[:, 2]
        return np.array([0.0, 0.0, 0.5 * (low + high)]) + distance * backwards

    def _ahead(self, rows: Ints, follow: bool) -> Floats:
        """Forward position (m,) of the camera, which follows the averaged hip or stays put [m]."""
        forward = self._hip[:, 0]
        if not follow:
            return np.full(len(rows), forward[rows].mean())
        sums = np.concatenate([[0.0], np.cumsum(forward)])
        half = 0.5 * CALM
        first = np.searchsorted(self._time, self._time[rows] - half)
        stop = np.searchsorted(self._time, self._time[rows] + half, side="right")
        return (sums[stop] - sums[first]) / (stop - first)
