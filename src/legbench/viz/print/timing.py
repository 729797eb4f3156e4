"""Distributions of wake-up latency and exchange time."""

from pathlib import Path

import numpy as np

from legbench.signals import Floats
from legbench.viz.print._matplotlib import Figure, styled
from legbench.viz.print.off_data import legend_beside
from legbench.viz.print.save import save_figure


def draw_timing(late_us: Floats, exchange_us: Floats, path: Path) -> None:
    """Draw the share of cycles that took longer than a time, for both, one value a cycle [us].

    Raises:
        ConfigError: the file's suffix is not .png, .svg or .pdf.
        RecordingError: the file cannot be written.
    """
    with styled():
        _draw(late_us, exchange_us, path)


def _draw(late_us: Floats, exchange_us: Floats, path: Path) -> None:
    figure = Figure(figsize=(7.0, 4.0), layout="constrained")
    axes = figure.subplots()
    for values, label in ((late_us, "wake-up"), (exchange_us, "exchange")):
        ordered = np.sort(values)
        share = 1.0 - np.arange(len(ordered)) / len(ordered)
        axes.step(ordered, share, where="post", label=label)
    axes.set_yscale("log")
    axes.set_xlabel("time [us]")
    axes.set_ylabel("share of cycles that took longer")
    axes.grid(alpha=0.3)
    legend_beside(axes)
    save_figure(figure, path)
