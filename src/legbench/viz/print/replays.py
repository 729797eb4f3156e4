"""Print figure of a replay: recorded signals under replayed ones, and their difference."""

from collections.abc import Sequence

import numpy as np

from legbench.replay.comparison import Replayed
from legbench.signals import SIGNALS
from legbench.viz import style
from legbench.viz.force_axis import force_axis
from legbench.viz.print._matplotlib import Axes, Figure, FigureCanvasAgg, styled
from legbench.viz.print.off_data import legend_beside

WIDTH_INCH, ROW_INCH = 10.0, 1.75
"""Width of the figure, and height of the row of each signal [inch]."""
LEFT_OUT = frozenset({"trunk_vel", "foot_pos", "contact", "energy", "loop_gap"})
"""Signals that follow from those that are drawn."""
COLOURS = tuple(map(style.unit, style.COMPONENTS))
DARK = (0.10, 0.10, 0.12)
"""Colour of what was replayed."""


def replay_figure(signals: Replayed, title: str) -> Figure:
    """Draw every signal over time, one row each: on the left both, on the right the difference.

    Args:
        signals: what was recorded and what was replayed.
        title: title of the figure.
    """
    groups = _groups(signals)
    with styled():
        figure = Figure(figsize=(WIDTH_INCH, ROW_INCH * len(groups) + 0.6), layout="constrained")
        FigureCanvasAgg(figure)
        panels = figure.subplots(len(groups), 2, sharex=True, squeeze=False)
        for (left, right), (name, columns) in zip(panels.tolist(), groups.items(), strict=True):
            unit = signals.units[columns[0]]
            left.set_ylabel(f"{name} [{unit}]")
            right.set_ylabel(f"[{unit}]")
            _draw(left, right, signals, columns)
            if name == "contact_force":
                _limit_force(left, signals, columns)
        for panel in panels[-1]:
            panel.set_xlabel("$t$ [s]")
        panels[0, 0].set_title("recorded in colour, replayed dashed", loc="left")
        panels[0, 1].set_title("replayed minus recorded", loc="left")
        figure.suptitle(title, fontsize=10.5)
    return figure


def _groups(signals: Replayed) -> dict[str, list[str]]:
    """Columns that are drawn by the name of their signal."""
    known = {column: signal.name for signal in SIGNALS for column in signal.columns}
    groups: dict[str, list[str]] = {}
    for column in signals.recorded:
        own, _, component = column.rpartition("_")
        name = known.get(column, own if len(component) == 1 and own else column)
        groups.setdefault(name, []).append(column)
    return {name: columns for name, columns in groups.items() if name not in LEFT_OUT}


def _limit_force(panel: Axes, signals: Replayed, columns: Sequence[str]) -> None:
    """Show the forces of stance, and say what impacts reach beyond them."""
    force = np.stack([signals.recorded[column] for column in columns], axis=-1)
    axis = force_axis(force, force[:, -1] > 0.0)
    if axis is not None:
        panel.set_ylim(axis.low, axis.high)
        panel.set_title(axis.words, loc="right", fontsize=8.0)


def _draw(left: Axes, right: Axes, signals: Replayed, columns: Sequence[str]) -> None:
    for place, column in enumerate(columns):
        colour = COLOURS[place % len(COLOURS)]
        recorded = np.asarray(signals.recorded[column], dtype=np.float64)
        replayed = np.asarray(signals.replayed[column], dtype=np.float64)
        left.plot(signals.time, recorded, color=colour, linewidth=1.6, rasterized=True)
        dashes = (0.0, (3.0, 2.0 + place))
        left.plot(
            signals.time, replayed, color=DARK, linestyle=dashes, linewidth=0.8, rasterized=True
        )
        right.plot(
            signals.time,
            replayed - recorded,
            color=colour,
            linewidth=0.9,
            label=column,
            rasterized=True,
        )
    legend_beside(right)
    for panel in (left, right):
        panel.grid(alpha=0.25, linewidth=0.5)
        panel.margins(x=0.0)
