"""The leg in motion as a stick figure in the manner of Fig. 2: x forward, z up, metres."""

from typing import final

import numpy as np

from legbench.kinematics import direction, leg_points
from legbench.signals import Floats
from legbench.viz import style
from legbench.viz.facts import Facts
from legbench.viz.hip import GROUNDED, hip_of
from legbench.viz.live._rerun import rr, rrb
from legbench.viz.trace import Thinner, TracedRows

FREQ = 100.0
"""Rate at which the stick figure is drawn [Hz]."""
PATH, VIEW = "/leg/plane", "/leg/view"
"""Entity paths of the drawing, and of the frame that follows the hip and shows it."""
TRUNK_HALF = (0.055, 0.02)
"""Half width and half height of the trunk [m]."""
TRUNK_LINE = 0.003
"""Radius of the trunk's outline [m]."""
FORCE_SCALE = 0.003
"""Length of the arrow that shows the contact force [m/N]."""
FORCE_MAX = 80.0
"""Largest force that the arrow shows to scale, as impacts peak at hundreds of newtons [N]."""
SEGMENT, BAR, JOINT, TIP = 0.0045, 0.0018, 0.0055, 0.0065
"""Radii of segments, bars, joints and foot tip [m]."""


def bar_points(joint: Floats, lengths: tuple[float, float, float], arm: float) -> list[Floats]:
    """The two bars in the hip's frame, green then black: end points and pivots (n, 3, 2) [m]."""
    thigh, shank = direction(joint[:, 0]), direction(joint[:, 1])
    hip = np.zeros_like(thigh)
    green = [hip, arm * shank, arm * shank + lengths[0] * thigh]
    stub = (lengths[0] + arm) * thigh
    black = [lengths[0] * thigh, stub, stub + lengths[1] * shank]
    return [np.stack(points, axis=1) for points in (green, black)]


def trunk_lines() -> list[list[list[float]]]:
    """The outline of the trunk and its mount, in the hip's frame [m]."""
    width, height = TRUNK_HALF
    low, high = 0.012, 0.012 + 2.0 * height
    box = [[-width, low], [width, low], [width, high], [-width, high], [-width, low]]
    return [box, [[0.0, 0.0], [0.0, low]]]


@final
class Leg2D:
    """Publisher of the leg's stick figure."""

    def __init__(self, stream: rr.RecordingStream, facts: Facts) -> None:
        self._stream = stream
        self._facts = facts
        self._thinner = Thinner(FREQ)
        flip = rr.Transform3D(mat3x3=np.diag([1.0, -1.0, 1.0]))
        stream.log(PATH, flip, static=True)
        self._draw_trunk()
        if facts.run.setup.kind in GROUNDED:
            self._draw_ground()
        for name, colour, radius, order in (
            ("segments", style.SEGMENT, SEGMENT, 10),
            ("bar_green", style.BAR_GREEN, BAR, 12),
            ("bar_black", style.BAR_BLACK, BAR, 8),
        ):
            looks = rr.LineStrips2D.from_fields(
                colors=[colour], radii=[radius], draw_order=float(order)
            )
            stream.log(f"{PATH}/{name}", looks, static=True)
        joints = rr.Points2D.from_fields(colors=[style.GREY], radii=[JOINT], draw_order=20)
        stream.log(f"{PATH}/joints", joints, static=True)
        tip = rr.Points2D.from_fields(radii=[TIP], draw_order=25)
        stream.log(f"{PATH}/tip", tip, static=True)
        force = rr.Arrows2D.from_fields(colors=[style.FORCE], radii=[0.002], draw_order=30)
        stream.log(f"{PATH}/force", force, static=True)

    def push(self, trace: TracedRows) -> None:
        """Add drawings of some of these rows."""
        kept = self._thinner.pick(trace.time)
        if len(kept) == 0:
            return
        hip, joint = hip_of(trace.rows, self._facts)[kept], trace.joint[kept]
        points = hip[:, None] + leg_points(joint, self._facts.run.design.lengths)
        index = [rr.TimeColumn("t", duration=trace.time[kept])]
        self._send(index, "segments", points)
        if self._facts.run.crank_length is not None:
            bars = bar_points(joint, self._facts.run.design.lengths, self._facts.run.crank_length)
            for name, bar in zip(("bar_green", "bar_black"), bars, strict=True):
                self._send(index, name, hip[:, None] + bar)
        ahead = np.pad(hip[:, :1], ((0, 0), (0, 2)))
        self._stream.send_columns(VIEW, index, rr.Transform3D.columns(translation=ahead))
        moved = rr.Transform3D.columns(translation=np.pad(hip, ((0, 0), (0, 1))))
        self._stream.send_columns(f"{PATH}/trunk", index, moved)
        joints = rr.Points2D.columns(positions=points[:, :3].reshape(-1, 2))
        joints = joints.partition(np.full(len(kept), 3))
        self._stream.send_columns(f"{PATH}/joints", index, joints)
        colours = style.stance_colours(trace.stance[kept])
        tip = rr.Points2D.columns(positions=points[:, 3], colors=colours)
        self._stream.send_columns(f"{PATH}/tip", index, tip)
        self._send_force(index, points[:, 3], trace.rows["contact_force"][kept])

    def _send(self, index: list[rr.TimeColumn], name: str, points: Floats) -> None:
        strips = rr.LineStrips2D.columns(strips=points.astype(np.float32))
        self._stream.send_columns(f"{PATH}/{name}", index, strips)

    def _send_force(self, index: list[rr.TimeColumn], tip: Floats, force: Floats) -> None:
        if not np.isfinite(force).all():
            return
        size = np.linalg.norm(force, axis=1, keepdims=True)
        arrow = FORCE_SCALE * force * np.minimum(1.0, FORCE_MAX / np.maximum(size, FORCE_MAX))
        arrows = rr.Arrows2D.columns(origins=tip, vectors=arrow)
        self._stream.send_columns(f"{PATH}/force", index, arrows)

    def _draw_trunk(self) -> None:
        looks = rr.LineStrips2D(
            trunk_lines(), colors=[style.TRUNK], radii=[TRUNK_LINE], draw_order=9
        )
        self._stream.log(f"{PATH}/trunk/box", looks, static=True)

    def _draw_ground(self) -> None:
        ends = np.arange(-1.0, 1.001, 0.02)
        hatches = [[[x, 0.0], [x - 0.012, -0.012]] for x in ends]
        lines = [[[-1.0, 0.0], [1.0, 0.0]], *hatches]
        radii = [0.0012] + [0.0005] * len(hatches)
        ground = rr.LineStrips2D(lines, colors=[style.GREY], radii=radii, draw_order=1)
        self._stream.log(f"{PATH}/ground", ground, static=True)


def leg_room(facts: Facts, hip: Floats, *, live: bool) -> tuple[float, float]:
    """Lowest and highest point that pictures show [m], from the hip's path (n, 2) so far."""
    reach = sum(facts.run.design.lengths)
    if facts.run.setup.kind not in GROUNDED:
        return float(hip[:, 1].min()) - 1.15 * reach, float(hip[:, 1].max()) + 0.3 * reach
    usual = (1.7 if live and facts.run.jumps else 1.3) * reach
    return -0.12 * reach, max(usual, float(hip[:, 1].max()) + 0.3 * reach)


def leg_view(room: tuple[float, float]) -> rrb.Spatial2DView:
    """The stick figure, seen from beside the hip, between two heights."""
    low, high = room
    half = 0.32 * (high - low)
    return rrb.Spatial2DView(
        origin=VIEW,
        contents="/leg/**",
        name="leg",
        visual_bounds=rrb.VisualBounds2D(x_range=(-half, half), y_range=(-high, -low)),
    )
