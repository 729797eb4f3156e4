"""Other runs in a print figure: drawn over a run's planes, and how far apart they are over time."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from legbench.kinematics import ModalConvention, joint_to_modal, joint_to_polar
from legbench.metrics.compare import differences, first_touchdown
from legbench.metrics.source import Recorded
from legbench.signals import Floats
from legbench.viz import style
from legbench.viz.colouring import colouring_of
from legbench.viz.print._matplotlib import Axes
from legbench.viz.print.off_data import legend_beside
from legbench.viz.print.thinning import draw_line, peaks, plane_stride, stride

Dashes = tuple[float, tuple[float, ...]]

LEAST = 1e-15
"""Smaller differences are drawn as large as this: zero has no logarithm [rad]."""
DECADES = 5
"""Decades shown below the largest difference, as every change of sign dips to zero."""

DIFFERENCES = (
    ("(d) difference over time, radial mode", r"$|\Delta z_2|$ [rad]"),
    ("(e) difference over time, joints", r"$|\Delta q|$ [rad]"),
)
"""Title and axis of the panels in the second row."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Look:
    """Colour and dashes in which another run is drawn."""

    colour: tuple[float, float, float]
    dashes: Dashes


LOOKS = (
    Look(colour=(0.10, 0.10, 0.12), dashes=(0.0, (4.0, 2.0))),
    Look(colour=(0.45, 0.20, 0.50), dashes=(0.0, (1.2, 1.2))),
    Look(colour=(0.15, 0.45, 0.25), dashes=(0.0, (6.0, 1.5, 1.2, 1.5))),
)
"""Looks of the other runs in turn; the fourth has the first again."""


def look_of(place: int) -> Look:
    """Look of the other run at a place in the order given."""
    return LOOKS[place % len(LOOKS)]


def planes_of(
    recording: Recorded, convention: ModalConvention, rows: slice = slice(None)
) -> tuple[Floats, Floats, Floats]:
    """Points of some rows in the three planes, polar, joint and modal (n, 2) each."""
    joint, shank = recording["joint_pos"][rows], recording.description.design.shank.length
    rate = joint_to_modal(recording["joint_vel"][rows], convention)[:, 1]
    radial = np.stack([joint_to_modal(joint, convention)[:, 1], rate], axis=-1)
    return joint_to_polar(joint, shank), joint, radial


def draw_other(
    panels: Sequence[Axes], other: Recorded, convention: ModalConvention, place: int
) -> None:
    """Draw those rows of another run over the planes that its own figure would highlight."""
    stretches, look = colouring_of(other).stretches, look_of(place)
    first, stop = (stretches[0].first, stretches[-1].stop + 1) if stretches else (0, None)
    shown = slice(first, stop, plane_stride(other.time[first:stop]))
    for panel, points in zip(panels, planes_of(other, convention, shown), strict=True):
        x, y = points.T
        draw_line(
            panel,
            x,
            y,
            color=look.colour,
            linestyle=look.dashes,
            linewidth=0.8,
            zorder=4,
            rasterized=True,
        )


def draw_differences(
    panels: Sequence[Axes], recording: Recorded, others: Sequence[Recorded]
) -> None:
    """Draw |dz2| and |dq| over time on logarithmic axes, and the first touchdowns.

    Raises:
        RecordingError: the runs have no time in common.
    """
    largest = np.full(2, LEAST)
    for place, other in enumerate(others):
        apart, dashes = differences(recording, other), look_of(place).dashes if place else "-"
        tops = [np.fmax.reduce(np.abs(each), axis=None) for each in (apart.z2, apart.joint)]
        largest = np.fmax(largest, tops)
        for panel, values, colour, name in (
            (panels[0], apart.z2, look_of(place).colour, "$z_2$"),
            (panels[1], apart.joint[:, 0], style.unit(style.FIRST), "$q_1$"),
            (panels[1], apart.joint[:, 1], style.unit(style.SECOND), "$q_2$"),
        ):
            size = np.maximum(np.abs(values), LEAST)
            rows = peaks(size, stride(len(size)))
            draw_line(
                panel,
                apart.time[rows],
                size[rows],
                color=colour,
                linestyle=dashes,
                linewidth=0.8,
                label="_" if place else name,
                rasterized=True,
            )
        _draw_landing(panels, first_touchdown(recording, other), "" if place else "first touchdown")
    for panel, (title, label), top in zip(panels, DIFFERENCES, largest.tolist(), strict=True):
        panel.set_title(title, loc="left")
        panel.set_xlabel("$t$ [s]")
        panel.set_ylabel(label)
        panel.set_yscale("log")
        panel.set_ylim(10.0**-DECADES * top, 3.0 * top)
        panel.grid(alpha=0.25, linewidth=0.5)
        panel.margins(x=0.0)
    legend_beside(panels[1])


def _draw_landing(panels: Sequence[Axes], landing: float, name: str) -> None:
    if not np.isfinite(landing):
        return
    for panel in panels:
        panel.axvline(landing, color="0.3", linewidth=0.8, linestyle=(0, (1, 2)))
        panel.annotate(
            name,
            (landing, 0.03),
            xycoords=("data", "axes fraction"),
            xytext=(3, 0),
            textcoords="offset points",
            fontsize=7.5,
            color="0.3",
        )
