"""Distributions of wake-up latency and exchange time."""

from pathlib import Path

import numpy as np

from legbench.errors import RecordingError
from legbench.signals import Floats
from legbench.viz.print._matplotlib import Figure, FigureCanvasAgg, styled


def draw_timing(late_us: Floats, exchange_us: Floats, path: Path) -> None:
    """Draw the share of cycles that took longer than a time, for both, one value a cycle [us].

    Raises:
        RecordingError: the file cannot be written.
    """
    with styled():
        _draw(late_us, exchange_us, path)


def _draw(late_us: Floats, exchange_us: Floats, path: Path) -> None:
    figure = Figure(figsize=(7.0, 4.0), layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.subplots()
    for values, label in ((late_us, "wake-up"), (exchange_us, "exchange")):
        ordered = np.sort(values)
        share = 1.0 - np.arange(len(ordered)) / len(ordered)
        axes.step(ordered, share, where="post", label=label)
    axes.set_yscale("log")
    axes.set_xlabel("time [us]")
    axes.set_ylabel("share of cycles that took longer")
    axes.grid(alpha=0.3)
    axes.legend()
    try:
        figure.savefig(path)
    except (OSError, ValueError) as error:
        raise RecordingError(f"cannot draw {path}: {error}") from None
