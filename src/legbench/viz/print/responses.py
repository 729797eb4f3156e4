"""Pictures of damped modes, of responses to moving motors, and of what bang-bang rides."""

from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path

import numpy as np

from legbench.modes.damped import DampedFamily
from legbench.modes.family import Family
from legbench.modes.linear import RADIAL as RADIAL_AXIS
from legbench.modes.response import Response, ResponseCurve
from legbench.modes.ridden import RiddenCurve
from legbench.modes.scene import Scene
from legbench.viz.print._matplotlib import Axes, Figure, styled
from legbench.viz.print.modes import COLOURS, DPI, GREY
from legbench.viz.print.off_data import legend_below
from legbench.viz.print.save import save_figure

CURVES = ("#26a69a", "#5c6bc0", "#8d6e63", "#ec407a", "#78909c")
RIDDEN = "#c62828"


def plot_responses(
    scene: Scene,
    families: Sequence[Family],
    damped: Sequence[DampedFamily],
    curves: Sequence[ResponseCurve],
    ridden: RiddenCurve | None,
    path: Path,
) -> None:
    """Amplitude over frequency of motors, leg and bang-bang; damping over amplitude below."""
    wide = bool(curves) or ridden is not None
    count = int(wide) + int(bool(damped))
    with styled():
        figure = Figure(figsize=(5.6 * count, 4.2), layout="constrained")
        panels = list(np.ravel(figure.subplots(1, count, squeeze=False)))
        if wide:
            _draw_responses(panels.pop(0), families, curves, ridden)
        if damped:
            _draw_damping(panels.pop(0), damped)
        title = f"{scene.design.name}, {scene.kind}, rest at z2 = {RADIAL_AXIS @ scene.rest:.3g}"
        figure.suptitle(f"{title} rad, damped")
        save_figure(figure, path, DPI)


def _draw_responses(
    axes: Axes,
    families: Sequence[Family],
    curves: Sequence[ResponseCurve],
    ridden: RiddenCurve | None,
) -> None:
    for family in families:
        if family.mode.name == "radial":
            ends = [(orbit.start, orbit.end) for orbit in family.orbits]
            axes.plot(
                [1.0 / orbit.period for orbit in family.orbits],
                [0.5 * abs(float((one - other) @ RADIAL_AXIS)) for one, other in ends],
                lw=1.0,
                ls="--",
                color=GREY,
                label="undamped mode",
            )
    for index, curve in enumerate(curves):
        colour = CURVES[index % len(CURVES)]
        _draw(axes, curve.responses, colour, f"motors of {curve.dz2:g} rad")
    if ridden is not None:
        label = f"bang-bang, {ridden.cycles[0].dz2:.2g} to {ridden.cycles[-1].dz2:.2g} rad"
        _draw(axes, ridden.cycles, RIDDEN, label)
    axes.plot([], [], lw=1.2, ls=":", color=GREY, label="not stable")
    axes.set(xlabel="frequency [Hz]", ylabel="amplitude of $z_2$ [rad]", title="radial response")
    legend_below(axes, 2)


def _draw(axes: Axes, responses: Sequence[Response], colour: str, label: str) -> None:
    """A curve of responses, dotted where they are not stable."""
    for first, last in pairwise(responses):
        stable = first.stable and last.stable
        axes.plot(
            [first.freq, last.freq],
            [first.radial, last.radial],
            lw=1.5 if stable else 1.2,
            ls="-" if stable else ":",
            color=colour,
        )
    axes.plot([], [], lw=1.5, color=colour, label=label)


def _draw_damping(axes: Axes, damped: Sequence[DampedFamily]) -> None:
    for family in damped:
        width = [getattr(orbit, family.name) for orbit in family.orbits]
        axes.plot(
            width,
            [100.0 * orbit.damping_ratio for orbit in family.orbits],
            "o-",
            ms=3,
            color=COLOURS[family.name],
            label=family.name,
        )
    axes.set(
        xlabel="amplitude of $z_2$ (radial), $z_1$ (polar) [rad]",
        ylabel="damping ratio [%]",
        title="damped modes",
    )
    # Room above, for a ratio that hardly changes.
    largest = max(orbit.damping_ratio for family in damped for orbit in family.orbits)
    axes.set_ylim(0.0, 120.0 * largest or 1.0)
    legend_below(axes, 2)
