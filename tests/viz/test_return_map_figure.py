"""The picture of a return map: numbers on its axes can be told apart."""

from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from legbench.viz.print import hops

GAP = 0.08
"""Smallest distance between two numbers [in], about half a letter."""


@pytest.mark.parametrize(
    "heights",
    [
        [0.2505, 0.2565, 0.26255, 0.2658, 0.267, 0.267],
        [0.3, 0.31, 0.4],
        [0.25, 0.250012, 0.25003],
    ],
)
def test_numbers_below_a_return_map_do_not_touch(
    heights: list[float], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    boxes: list[Any] = []

    def drawn(figure: Figure, *_: object) -> None:
        canvas = FigureCanvasAgg(figure)
        canvas.draw()
        (axes,) = figure.axes
        low, high = axes.get_xlim()
        boxes.extend(
            label.get_window_extent(canvas.get_renderer())
            for place, label in zip(axes.get_xticks(), axes.get_xticklabels(), strict=True)
            if low <= place <= high
        )
        boxes.append(figure.dpi)

    monkeypatch.setattr(hops, "save_figure", drawn)
    pairs = np.column_stack([heights[:-1], heights[1:]])
    hops.plot_return(pairs, pairs[-1:], "leg", tmp_path / "return.png")
    dpi = boxes.pop()
    assert len(boxes) > 1
    for left, right in pairwise(boxes):
        assert right.x0 - left.x1 > GAP * dpi
