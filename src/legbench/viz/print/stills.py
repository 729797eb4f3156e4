"""Figure 7: stills of one jump, from lower apex to lower apex, drawn from the recorded angles."""

from dataclasses import dataclass
from typing import Final

import numpy as np

from legbench.kinematics import direction, leg_points
from legbench.metrics.analysis import analysed
from legbench.metrics.roles import STANCE
from legbench.metrics.source import Recorded
from legbench.signals import Floats
from legbench.viz import style
from legbench.viz.print._matplotlib import Axes, Figure, FigureCanvasAgg, Rectangle, styled

STILLS: Final = 8
"""Number of stills of one jump."""
CRANK: Final = 0.15
"""Length of the cranks of the drawn bars, as a share of the shank [-]."""
TRUNK: Final = (0.55, 0.22)
"""Width and height of the drawn trunk, as shares of the shank [-]."""
STILL_INCH: Final = (1.25, 2.0)
"""Width and height of one still [inch]."""
GROUND: Final = style.unit(style.GREY)


@dataclass(frozen=True, slots=True, kw_only=True)
class Still:
    """Pose of the leg at one instant of a jump."""

    time: float
    """Time since the lower apex before the jump [s]."""
    stance: bool
    joint: Floats
    """Link angles (2,) [rad]."""
    points: Floats
    """Hip, knee, ankle and foot tip in the world (4, 2) [m]."""


def stills_of(recording: Recorded, count: int = STILLS) -> tuple[Still, ...]:
    """Poses at equal times over the last complete jump of a run.

    None where there is no complete jump, or where the hip's height is not known, as on a real leg.
    """
    run = analysed(recording)
    jumps = run.gait.jumps
    if not len(jumps) or not np.isfinite(run["trunk_pos"]).all():
        return ()
    start, end = float(jumps.start[-1]), float(jumps.end[-1])
    times = np.linspace(start, end, count)
    rows = np.clip(np.searchsorted(run.time, times), 0, len(run.time) - 1)
    joint, hip = run["joint_pos"][rows], run["trunk_pos"][rows]
    points = hip[:, np.newaxis] + leg_points(joint, run.description.design.lengths)
    return tuple(
        Still(
            time=float(time - start),
            stance=bool(run.states[row] == STANCE),
            joint=angles,
            points=place,
        )
        for time, row, angles, place in zip(times, rows.tolist(), joint, points, strict=True)
    )


def draw_still(panel: Axes, still: Still, stills: tuple[Still, ...]) -> None:
    """Draw one pose with ground and path of the hip, at the scale of all stills of the jump."""
    hip, knee, ankle, tip = still.points
    shank = float(np.linalg.norm(ankle - knee))
    width, height = TRUNK[0] * shank, TRUNK[1] * shank
    hips = np.array([each.points[0] for each in stills])
    top = float(hips[:, 1].max()) + 1.3 * height
    panel.plot([hip[0] - shank, hip[0] + shank], [0.0, 0.0], color=GROUND, linewidth=1.0)
    for level in (hips[:, 1].min(), hips[:, 1].max()):
        ends = [hip[0] - 0.75 * shank, hip[0] + 0.75 * shank]
        panel.plot(ends, [level] * 2, color=GROUND, linewidth=0.5, linestyle=(0, (2, 3)))
    crank = CRANK * shank
    thigh, lower = direction(still.joint[0]), direction(still.joint[1])
    bars = (
        ([hip, hip + crank * lower, knee + crank * lower, knee], style.BAR_GREEN),
        ([knee, knee + crank * thigh, ankle + crank * thigh, ankle], style.BAR_BLACK),
    )
    for corners, colour in bars:
        panel.plot(*np.array(corners).T, color=style.unit(colour), linewidth=1.0, zorder=2)
    panel.plot(
        *still.points.T,
        color=style.unit(style.SEGMENT),
        linewidth=3.2,
        solid_capstyle="round",
        solid_joinstyle="round",
        zorder=3,
    )
    corner = (hip[0] - 0.5 * width, hip[1] - 0.15 * height)
    trunk = style.unit(style.TRUNK)
    panel.add_patch(Rectangle(corner, width, height, color=trunk, zorder=4))
    panel.plot(*still.points[:3].T, "o", color=GROUND, markersize=3.0, zorder=5)
    foot = style.unit(style.STANCE if still.stance else style.FLIGHT)
    panel.plot(*tip, "o", color=foot, markersize=5.5, zorder=5)
    panel.set_xlim(hip[0] - 0.85 * shank, hip[0] + 0.85 * shank)
    panel.set_ylim(-0.12 * shank, top)
    panel.set_aspect("equal", adjustable="box")
    panel.axis("off")


def stills_figure(recording: Recorded, count: int = STILLS) -> Figure | None:
    """All stills of a jump side by side; none where `stills_of` finds none."""
    stills = stills_of(recording, count)
    if not stills:
        return None
    with styled():
        figure = Figure(figsize=(STILL_INCH[0] * count, STILL_INCH[1]), layout="constrained")
        FigureCanvasAgg(figure)
        for place, still in enumerate(stills):
            panel = figure.add_subplot(1, count, place + 1)
            draw_still(panel, still, stills)
            panel.set_title(f"{1e3 * still.time:.0f} ms", fontsize=9.0)
    return figure
