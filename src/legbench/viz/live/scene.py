"""The run's MuJoCo model in 3-D: each shape once, each body's pose over time."""

from typing import Any, final

import mujoco
import numpy as np

from legbench.viz.facts import Facts
from legbench.viz.hip import hip_of
from legbench.viz.live._rerun import rr, rrb
from legbench.viz.live.leg2d import FREQ
from legbench.viz.pose import PosedModel
from legbench.viz.run_model import model_of
from legbench.viz.style import Colours
from legbench.viz.trace import Thinner, TracedRows

PATH, VIEW = "/scene/model", "/scene/view"
"""Entity paths of the model, and of the frame that follows the hip and shows it."""
PLANE_HALF = (0.4, 0.15, 5e-4)
"""Half sides of the part of an endless plane that is drawn [m]."""
PLANE_COLOUR = (96, 100, 108, 255)
"""Colour of planes, whose texture gives none."""
DARKEST = 0.27
"""Lowest value of a colour channel [0 to 1], so that black parts show on a dark ground."""
HIDDEN_GROUP = 3
"""First group of geoms that are for the collision alone, by MuJoCo's convention."""

Shape = rr.Boxes3D | rr.Capsules3D | rr.Cylinders3D | rr.Ellipsoids3D


@final
class ModelScene:
    """Publishes the bodies of a run's model.

    Raises:
        FormatError: the run describes no model that can be drawn.
    """

    def __init__(self, stream: rr.RecordingStream, facts: Facts) -> None:
        self._stream = stream
        self._facts = facts
        self._thinner = Thinner(FREQ)
        self._posed = PosedModel(model_of(facts.run))
        stream.log("/scene", rr.ViewCoordinates.RIGHT_HAND_Z_UP, static=True)
        _draw_shapes(stream, self._posed.model)

    def push(self, trace: TracedRows) -> None:
        """Add poses of some of these rows."""
        kept = self._thinner.pick(trace.time)
        if len(kept) == 0:
            return
        posed = self._posed
        hip = hip_of(trace.rows, self._facts)[kept]
        bodies = range(1, posed.model.nbody)
        places = np.empty((len(kept), posed.model.nbody, 3), dtype=np.float32)
        turns = np.empty((len(kept), posed.model.nbody, 4), dtype=np.float32)
        for row, qpos in enumerate(posed.positions(hip, trace.joint[kept])):
            posed.pose(qpos)
            places[row], turns[row] = posed.data.xpos, posed.data.xquat
        index = [rr.TimeColumn("t", duration=trace.time[kept])]
        ahead = np.pad(hip[:, :1], ((0, 0), (0, 2)))
        self._stream.send_columns(VIEW, index, rr.Transform3D.columns(translation=ahead))
        for body in bodies:
            moved = rr.Transform3D.columns(
                translation=places[:, body], quaternion=turns[:, body][:, [1, 2, 3, 0]]
            )
            self._stream.send_columns(_body_path(posed.model, body), index, moved)


def _body_path(model: mujoco.MjModel, body: int) -> str:
    return f"{PATH}/{model.body(body).name}"


def _draw_shapes(stream: rr.RecordingStream, model: mujoco.MjModel) -> None:
    for geom in range(model.ngeom):
        shape = _shape(model, geom)
        if shape is None or model.geom_group[geom] >= HIDDEN_GROUP:
            continue
        body = int(model.geom_bodyid[geom])
        path = f"{_body_path(model, body)}/{model.geom(geom).name or f'geom_{geom}'}"
        quaternion = model.geom_quat[geom][[1, 2, 3, 0]]
        place = rr.Transform3D(translation=model.geom_pos[geom], quaternion=quaternion)
        stream.log(path, place, static=True)
        stream.log(path, shape, static=True)


def _colour(model: mujoco.MjModel, geom: int) -> Colours:
    material = int(model.geom_matid[geom])
    rgba = model.geom_rgba[geom] if material < 0 else model.mat_rgba[material]
    return np.round(255.0 * np.maximum(rgba, DARKEST)).astype(np.uint8)


def _shape(model: mujoco.MjModel, geom: int) -> Shape | None:
    """The geom in its own frame; none for meshes and height fields, which no leg has."""
    x, y, z = model.geom_size[geom]
    looks: dict[str, Any] = {"colors": [_colour(model, geom)], "fill_mode": "solid"}
    kinds = mujoco.mjtGeom
    match kinds(model.geom_type[geom]):
        case kinds.mjGEOM_BOX:
            return rr.Boxes3D(half_sizes=[[x, y, z]], **looks)
        case kinds.mjGEOM_PLANE:
            return rr.Boxes3D(half_sizes=[PLANE_HALF], colors=[PLANE_COLOUR], fill_mode="solid")
        case kinds.mjGEOM_SPHERE:
            return rr.Ellipsoids3D(half_sizes=[[x, x, x]], **looks)
        case kinds.mjGEOM_ELLIPSOID:
            return rr.Ellipsoids3D(half_sizes=[[x, y, z]], **looks)
        case kinds.mjGEOM_CYLINDER:
            return rr.Cylinders3D(lengths=[2.0 * y], radii=[x], **looks)
        case kinds.mjGEOM_CAPSULE:
            return rr.Capsules3D(
                lengths=[2.0 * y], radii=[x], translations=[[0.0, 0.0, -y]], **looks
            )
    return None


def scene_view(room: tuple[float, float]) -> rrb.Spatial3DView:
    """The model from the side and a little above, as far away as the two heights ask."""
    centre, distance = 0.5 * (room[0] + room[1]), 1.5 * (room[1] - room[0])
    eye = rrb.EyeControls3D(
        position=(0.35 * distance, -0.9 * distance, centre + 0.25 * distance),
        look_target=(0.0, 0.0, centre),
        eye_up=(0.0, 0.0, 1.0),
    )
    return rrb.Spatial3DView(
        origin=VIEW,
        contents="/scene/**",
        name="model",
        eye_controls=eye,
        line_grid=rrb.LineGrid3D(visible=False),
    )
