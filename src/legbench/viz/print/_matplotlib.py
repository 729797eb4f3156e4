"""Import of matplotlib, an optional dependency; figures are objects without window or state."""

from contextlib import AbstractContextManager
from typing import Any

from legbench.errors import MissingExtraError

try:
    import matplotlib as mpl
    from matplotlib.axes import Axes
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.cm import ScalarMappable
    from matplotlib.collections import LineCollection
    from matplotlib.colors import BoundaryNorm, ListedColormap
    from matplotlib.figure import Figure
    from matplotlib.lines import Line2D
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
    "ScalarMappable",
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


def styled() -> AbstractContextManager[None]:
    """The look of every figure, whatever the user's own matplotlib settings are."""
    return mpl.rc_context({**mpl.rcParamsDefault, **STYLE})
