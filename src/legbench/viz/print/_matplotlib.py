"""Import of matplotlib, an optional dependency; figures are objects without window or state."""

from contextlib import AbstractContextManager
from io import BytesIO
from typing import Any, final

from legbench.errors import MissingExtraError

try:
    import matplotlib as mpl
    from matplotlib import rc_context
    from matplotlib.axes import Axes
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.cm import ScalarMappable
    from matplotlib.collections import LineCollection
    from matplotlib.colors import BoundaryNorm, ListedColormap
    from matplotlib.figure import Figure as PlainFigure
    from matplotlib.lines import Line2D
    from matplotlib.patches import Rectangle
except ImportError as error:
    raise MissingExtraError(
        "matplotlib is not installed; figures need it: pip install 'legbench[viz]'"
    ) from error

__all__ = [
    "Axes",
    "BoundaryNorm",
    "Figure",
    "FigureCanvasAgg",
    "Line2D",
    "LineCollection",
    "ListedColormap",
    "PlainFigure",
    "Rectangle",
    "ScalarMappable",
    "rc_context",
    "styled",
]

STYLE: dict[Any, Any] = {
    "axes.labelsize": 10.0,
    "axes.spines.right": False,
    "axes.spines.top": False,
    "axes.titlesize": 10.5,
    "axes.unicode_minus": True,
    "font.family": "DejaVu Sans",
    "font.size": 9.0,
    "mathtext.fontset": "dejavusans",
    "pdf.fonttype": 42,
    "svg.fonttype": "none",
    "svg.hashsalt": "legbench",
}


SCREEN_DPI = 110
"""Dots of a figure that a notebook shows [1/inch]."""


@final
class Figure(PlainFigure):
    """Figure of matplotlib that a notebook shows by itself, in the look of every figure here."""

    def _repr_png_(self) -> bytes:
        """Return the figure as a PNG."""
        with styled(), BytesIO() as stream:
            FigureCanvasAgg(self).print_figure(stream, format="png", dpi=SCREEN_DPI)
            return stream.getvalue()


def styled() -> AbstractContextManager[None]:
    """The look of every figure, whatever the user's own matplotlib settings are."""
    return mpl.rc_context({**mpl.rcParamsDefault, **STYLE})
