"""Legends that cover no data: beside their panel, or below it."""

from typing import Any, Final

from legbench.viz.print._matplotlib import Axes

BELOW: Final = (0.5, -0.18)
"""Place of a legend under its panel and the title of its axis, in the panel's own units."""
SIZE: Final = 7.5
"""Size of the words [pt]."""


def legend_beside(panel: Axes, **looks: Any) -> None:
    """Write the legend of a panel to the right of it; `looks` are those of matplotlib's legend."""
    usual: dict[str, Any] = {"fontsize": SIZE, "frameon": False, "handlelength": 1.2}
    panel.legend(**(usual | looks), loc="upper left", bbox_to_anchor=(1.0, 1.0))


def legend_below(panel: Axes, columns: int, **looks: Any) -> None:
    """Write the legend of a panel below it, in so many columns."""
    usual: dict[str, Any] = {"fontsize": SIZE, "frameon": False}
    panel.legend(**(usual | looks), loc="upper center", bbox_to_anchor=BELOW, ncols=columns)
