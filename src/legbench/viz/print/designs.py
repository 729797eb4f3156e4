"""A leg on paper, to scale, and the course of its search.

Both draw on panels that are handed in: any matplotlib Axes is one.
"""

from typing import Any, Protocol

import numpy as np

from legbench.design import LegDesign, Segment
from legbench.design.dependent import INFEASIBLE
from legbench.design.requirements import VARIABLES, Bounds
from legbench.kinematics import leg_points
from legbench.signals import Floats
from legbench.synthesis.manufacture import shown
from legbench.synthesis.trace import Trace
from legbench.viz.print.bars import CRANK, draw_bars

PAGE = (297.0, 210.0)
"""Width and height of the page, A4 landscape [mm]."""
LEG_SPACE = 150.0
"""Height on the page that the leg may take [mm]."""
SCALES = (1.0, 2.0, 5.0, 10.0, 20.0)
"""Scales 1 : n to choose from, by their n."""
HIP = (62.0, 182.0)
"""Position of the leg's hip on the page [mm]."""
SEGMENTS_AT = (134.0, 192.0, 250.0)
"""Horizontal positions of the single segments on the page [mm]."""
SEGMENTS_TOP = 160.0
BODY = 7.0
"""Width of a segment on the page [mm]."""

INK = (0.13, 0.13, 0.15)
THIN = (0.45, 0.45, 0.48)
SHADES = ((0.85, 0.87, 0.92), (0.90, 0.86, 0.83), (0.85, 0.91, 0.86))
LEG_MARK = (0.78, 0.16, 0.12)
NAMES = ("thigh", "shank", "foot")
LINES = ("#4269d0", "#e06c3c", "#3ca951", "#a463b8", "#8a6d3b", "#d04f86", "#3aa3a8")


class Panel(Protocol):
    """Protocol of the methods of a matplotlib Axes that a page needs."""

    def plot(self, *args: Any, **kwargs: Any) -> Any:
        """Draw lines."""
        ...

    def fill(self, *args: Any, **kwargs: Any) -> Any:
        """Draw polygons."""
        ...

    def text(self, x: float, y: float, s: str, **kwargs: Any) -> Any:
        """Write text."""
        ...

    def annotate(self, text: str, xy: tuple[float, float], **kwargs: Any) -> Any:
        """Draw arrows and their labels."""
        ...

    def set(self, **kwargs: Any) -> Any:
        """Set limits and labels."""
        ...

    def set_axis_off(self) -> None:
        """Hide the frame."""
        ...


def scale_of(design: LegDesign) -> float:
    """The `n` of 1 : n at which the whole leg fits the page."""
    height = 2e3 * design.shank.length
    return next((scale for scale in SCALES if height / scale <= LEG_SPACE), SCALES[-1])


def draw_leg(panel: Panel, design: LegDesign, half_angle: float) -> None:
    """Draw a whole page: the leg standing at `half_angle` [rad], and each segment with its numbers.

    The panel has to fill a page of `PAGE` for the scale to be true.
    """
    scale = scale_of(design)
    per_metre = 1e3 / scale
    panel.set_axis_off()
    panel.set(xlim=(0.0, PAGE[0]), ylim=(0.0, PAGE[1]), aspect="equal")
    _draw_assembly(panel, design, half_angle, per_metre)
    for index, (name, segment) in enumerate(zip(NAMES, design.segments, strict=True)):
        _draw_segment(panel, name, index, segment, per_metre)
    _draw_words(panel, design, half_angle, scale)


def _draw_assembly(panel: Panel, design: LegDesign, half_angle: float, per_metre: float) -> None:
    points = leg_points(np.array([-half_angle, half_angle]), design.lengths)
    points = np.array(HIP) + per_metre * points
    x, y = HIP
    trunk = np.array([[-24.0, 7.0], [24.0, 7.0], [24.0, 18.0], [-24.0, 18.0]]) + HIP
    panel.fill(*trunk.T, facecolor=(0.80, 0.84, 0.90), edgecolor=INK, linewidth=0.8)
    panel.plot([x, x], [y, y + 7.0], color=INK, linewidth=1.2)
    panel.text(
        x, y + 12.5, f"trunk  {shown(design.trunk_mass, 'kg')}", ha="center", va="center", size=8
    )
    bars = draw_bars(panel, points, per_metre)
    for index in (2, 1, 0):
        _draw_body(panel, points[index], points[index + 1], SHADES[index])
    for pivot in bars:
        _draw_circle(panel, pivot, 0.9, "white")
    marks = []
    for index, segment in enumerate(design.segments):
        share = segment.com / segment.length
        mark = points[index] + share * (points[index + 1] - points[index])
        marks.append(mark)
        _draw_com(panel, mark, 2.4, INK)
    for index, name in enumerate(("hip", "knee", "ankle", "tip")):
        _draw_circle(panel, points[index], 1.3, "white")
        left = index == 1
        panel.text(
            float(points[index, 0]) + (-7.0 if left else 7.0),
            float(points[index, 1]) + (-5.0 if name == "tip" else 0.0),
            name,
            ha="right" if left else "left",
            va="center",
            size=8,
            color=THIN,
        )
    weights = np.array([segment.mass for segment in design.segments])
    centre = weights @ np.array(marks) / weights.sum()
    _draw_com(panel, centre, 2.9, LEG_MARK)
    panel.text(
        float(centre[0]) + 5.0,
        float(centre[1]),
        f"leg  {shown(design.leg_mass, 'kg')}",
        va="center",
        size=8,
        color=LEG_MARK,
    )
    tip = float(points[3, 1])
    panel.plot([x - 30.0, x + 30.0], [tip, tip], color=THIN, linewidth=0.8)
    length = float(y - tip) / per_metre
    _draw_dimension(panel, x + 36.0, y, tip, f"{1e3 * length:.1f}")


def _draw_segment(panel: Panel, name: str, index: int, segment: Segment, per_metre: float) -> None:
    x, top = SEGMENTS_AT[index], SEGMENTS_TOP
    bottom, com = top - per_metre * segment.length, top - per_metre * segment.com
    number = index + 1
    _draw_body(panel, np.array([x, top]), np.array([x, bottom]), SHADES[index])
    for end in (top, bottom):
        _draw_circle(panel, np.array([x, end]), 1.3, "white")
    _draw_com(panel, np.array([x, com]), 2.4, INK)
    _draw_dimension(panel, x + 12.0, top, bottom, f"$l_{number}$ {1e3 * segment.length:.2f}")
    _draw_dimension(panel, x - 11.0, top, com, f"$c_{number}$ {1e3 * segment.com:.2f}", left=True)
    panel.text(x, top + 20.0, name, ha="center", va="bottom", size=11, weight="bold")
    panel.text(x, top + 14.0, f"$m_{number}$ = {shown(segment.mass, 'kg')}", ha="center", size=9)
    inertia = f"$I_{number}$ = {shown(segment.inertia, 'kg m^2').replace('^2', '$^2$')}"
    panel.text(x, top + 8.5, inertia, ha="center", size=9)


def _draw_words(panel: Panel, design: LegDesign, half_angle: float, scale: float) -> None:
    first, second = design.stiffness
    low, high = design.damping
    lines = (
        f"springs  $k_1$ = {first:.3f},  $k_2$ = {second:.3f} N m/rad",
        f"damping  $d_1$ = {low:.4g},  $d_2$ = {high:.4g} N m s/rad",
        "inertias about the centres of mass; centres of mass from the upper joint; lengths in mm",
        f"green and black: the parallel bars, here on cranks of {1e3 * CRANK:g} mm, which are free",
        f"drawn at x1 = 0, q2 - q1 = {np.degrees(2.0 * half_angle):.1f} deg",
    )
    for row, line in enumerate(lines):
        panel.text(112.0, 46.0 - 6.5 * row, line, size=8.5, color=INK)
    panel.text(PAGE[0] - 12.0, 9.0, design.name, ha="right", size=13, weight="bold", color=INK)
    panel.text(112.0, 9.0, f"1 : {scale:g}", size=11, color=INK)
    span = 50.0
    panel.plot([132.0, 132.0 + span], [10.0, 10.0], color=INK, linewidth=2.0)
    panel.text(132.0 + span + 2.0, 10.0, f"{span * scale:g} mm", va="center", size=8, color=INK)
    frame = np.array([[5.0, 5.0], [292.0, 5.0], [292.0, 205.0], [5.0, 205.0], [5.0, 5.0]])
    panel.plot(*frame.T, color=THIN, linewidth=0.6)


def _draw_body(panel: Panel, start: Floats, end: Floats, shade: tuple[float, ...]) -> None:
    """Draw a segment as a bar with round ends."""
    along = (end - start) / np.linalg.norm(end - start)
    angle = np.arctan2(along[1], along[0])
    turn = np.linspace(0.5 * np.pi, 1.5 * np.pi, 24)
    first = np.stack([np.cos(angle + turn), np.sin(angle + turn)], axis=-1)
    outline = np.concatenate([start + 0.5 * BODY * first, end - 0.5 * BODY * first])
    panel.fill(*outline.T, facecolor=(*shade, 0.92), edgecolor=INK, linewidth=0.8)


def _draw_circle(panel: Panel, centre: Floats, radius: float, colour: Any) -> None:
    turn = np.linspace(0.0, 2.0 * np.pi, 40)
    panel.fill(
        centre[0] + radius * np.cos(turn),
        centre[1] + radius * np.sin(turn),
        facecolor=colour,
        edgecolor=INK,
        linewidth=0.8,
    )


def _draw_com(panel: Panel, centre: Floats, radius: float, colour: tuple[float, ...]) -> None:
    """Draw the quartered disc that marks a centre of mass."""
    _draw_circle(panel, centre, radius, "white")
    for begin in (0.0, np.pi):
        turn = np.linspace(begin, begin + 0.5 * np.pi, 14)
        wedge_x = np.concatenate([[0.0], np.cos(turn)])
        wedge_y = np.concatenate([[0.0], np.sin(turn)])
        panel.fill(
            centre[0] + radius * wedge_x, centre[1] + radius * wedge_y, color=colour, linewidth=0.0
        )


def _draw_dimension(
    panel: Panel, x: float, top: float, bottom: float, words: str, *, left: bool = False
) -> None:
    """Draw a vertical dimension line with its number beside it."""
    arrow = {"arrowstyle": "<->", "color": THIN, "linewidth": 0.7, "shrinkA": 0.0, "shrinkB": 0.0}
    for y in (top, bottom):
        panel.plot([x - 1.5, x + 1.5], [y, y], color=THIN, linewidth=0.7)
    panel.annotate("", (x, bottom), xytext=(x, top), arrowprops=arrow)
    panel.text(
        x + (-2.0 if left else 2.0),
        0.5 * (top + bottom),
        words,
        ha="right" if left else "left",
        va="center",
        size=8.5,
    )


def draw_trace(upper: Panel, lower: Panel, trace: Trace, bounds: Bounds) -> None:
    """Cost per evaluation above, and below the best candidate's variables between their bounds."""
    costs, points = trace.costs, trace.points
    exists = costs < INFEASIBLE
    count = np.arange(1, len(costs) + 1)
    best = np.minimum.accumulate(costs)
    lowest = float(best[-1])
    floor = 1e-12
    seen = exists & (costs > lowest + floor)
    if seen.any():
        floor = 0.5 * float((costs[seen] - lowest).min())
    upper.plot(
        count[seen],
        costs[seen] - lowest,
        linestyle="none",
        marker=".",
        markersize=1.6,
        color=(0.62, 0.66, 0.74),
        rasterized=True,
    )
    leading = best < INFEASIBLE
    upper.plot(count[leading], np.maximum(best[leading] - lowest, floor), color=INK, linewidth=1.2)
    share = float(exists.mean())
    upper.set(
        yscale="log",
        xlim=(0, len(costs)),
        ylabel=f"cost above {lowest:.6f}",
        title=f"{len(costs)} evaluations, {100 * share:.0f} % of them legs that can exist",
    )
    improving = np.flatnonzero(np.diff(best, prepend=np.inf) < 0.0)
    leader = improving[np.searchsorted(improving, np.arange(len(costs)), side="right") - 1]
    shares = (points[leader] - bounds.lower) / (bounds.upper - bounds.lower)
    for index, name in enumerate(VARIABLES):
        label = f"{name.replace('_', ' ')} {points[leader[-1], index]:.4g}"
        lower.plot(count, shares[:, index], color=LINES[index], linewidth=1.3, label=label)
    lower.set(
        xlim=(0, len(costs)),
        ylim=(-0.04, 1.04),
        xlabel="evaluation",
        ylabel="best candidate, lower to upper bound",
        yticks=[0.0, 0.5, 1.0],
        yticklabels=["lower", "middle", "upper"],
    )
