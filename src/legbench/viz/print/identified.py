"""Figure of an identification: intervals of the estimates, and what the fit leaves of each run."""

from collections.abc import Sequence
from typing import Final

import numpy as np

from legbench.identify.adequacy import ROWS
from legbench.identify.outcome import Estimate, Identification
from legbench.identify.staged import IdentificationTask
from legbench.identify.trial import FitTrial
from legbench.signals import Floats
from legbench.viz.print._matplotlib import Axes, Figure, styled

COLOURS: Final = ("#1f5fa8", "#c8622d")
"""Colours of q1 and q2."""


def identified_figure(task: IdentificationTask, outcome: Identification) -> Figure:
    """Draw estimates against the design, and residuals by run and joint.

    Residuals are means over `ROWS` rows, which noise hardly moves; bands are what noise and counts
    explain of them.
    """
    misfit, trials = outcome.misfit, task.trials
    runs = 0 if misfit is None else len(trials)
    with styled():
        figure = Figure(figsize=(8.0, 2.6 + 1.3 * runs), layout="constrained")
        verdict = "trusted" if outcome.trusted else "not to be trusted"
        figure.suptitle(f"{task.design.name}: {verdict}")
        axes = np.atleast_1d(
            figure.subplots(runs + 1, 1, height_ratios=[2.0, *([1.0] * runs)])
        ).tolist()
        _intervals(axes[0], outcome.estimates)
        if misfit is not None:
            for place, (trial, residuals) in enumerate(zip(trials, misfit.residuals, strict=True)):
                _residuals(axes[1 + place], trial, residuals, outcome)
            axes[-1].set_xlabel("time [s]")
    return figure


def _intervals(axes: Axes, estimates: Sequence[Estimate]) -> None:
    """Changes against the design with their intervals; parameters that were zero have none."""
    shown = [each for each in estimates if each.before > 0.0]
    for place, each in enumerate(shown):
        middle, low, high = (
            1e2 * (value / each.before - 1.0) for value in (each.value, each.low, each.high)
        )
        axes.plot([place, place], [low, high], color=COLOURS[0], linewidth=3.0, alpha=0.5)
        axes.plot([place], [middle], "o", color=COLOURS[0], markersize=4.0)
    axes.axhline(0.0, color="0.6", linewidth=0.8)
    axes.set_xticks(range(len(shown)), [each.name for each in shown])
    axes.set_ylabel("against the design [%]")


def _residuals(axes: Axes, trial: FitTrial, residuals: Floats, outcome: Identification) -> None:
    count = len(residuals) // ROWS
    times = trial.time[: count * ROWS].reshape(count, ROWS).mean(axis=1)
    known = [each for each in outcome.residuals if each.run == trial.name]
    for joint, colour in enumerate(COLOURS):
        own = residuals[: count * ROWS, joint].reshape(count, ROWS).mean(axis=1)
        axes.plot(times, 1e6 * own * trial.sigma[joint], color=colour, label=f"q{joint + 1}")
    band = max(np.hypot(each.allowed, 2.0 * each.sigma / np.sqrt(ROWS)) for each in known)
    axes.axhspan(-1e6 * band, 1e6 * band, color="0.9", zorder=0)
    axes.set_ylabel("left [urad]")
    axes.set_title(f"{trial.setup}: {trial.name}", loc="left", fontsize=8.0)
    axes.legend(loc="upper right", ncols=2, frameon=False)
