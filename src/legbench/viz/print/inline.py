"""Figures as SVG inside of a page: in its text colour, without size, prolog or metadata."""

import re
from collections.abc import Callable
from html import escape
from typing import Any, Final

from legbench.viz.print._matplotlib import Axes, Figure, FigureCanvasAgg, rc_context, styled
from legbench.viz.print.save import svg_text

INK: Final = "#010203"
"""Colour that stands for the page's text colour: nothing else is drawn in it."""
PAGE_STYLE: Final[dict[Any, Any]] = {
    "text.color": INK,
    "axes.edgecolor": INK,
    "axes.labelcolor": INK,
    "axes.labelsize": 9.0,
    "xtick.color": INK,
    "ytick.color": INK,
    "font.size": 8.5,
    "axes.linewidth": 0.7,
    "axes.grid": True,
    "axes.axisbelow": True,
    "grid.color": INK,
    "grid.alpha": 0.10,
    "grid.linewidth": 0.6,
}


def panel_svg(
    name: str, description: str, size: tuple[float, float], draw: Callable[[Axes], None]
) -> str:
    """Draw one panel as an SVG element that takes the width and text colour of its place.

    Args:
        name: name of the panel, unique on its page.
        description: what is to be seen, for those who hear the page.
        size: width and height [inch], whose ratio stays.
        draw: draws on the panel's axes.
    """
    with styled(), rc_context({**PAGE_STYLE, "svg.hashsalt": name}):
        figure = Figure(figsize=size, layout="constrained")
        FigureCanvasAgg(figure)
        draw(figure.add_subplot())
        text = svg_text(figure)
    return _inlined(text, description)


def _inlined(text: str, description: str) -> str:
    """Make a file of matplotlib an element of a page."""
    svg = text[text.index("<svg") :]
    svg = re.sub(r"\s*<metadata>.*?</metadata>", "", svg, flags=re.DOTALL)
    # The page gives the width, the viewBox the ratio.
    svg = re.sub(r' (width|height)="[0-9.]+pt"', "", svg, count=2)
    used = set(re.findall(r"#([\w-]+)", svg))
    svg = re.sub(r' id="([^"]+)"', lambda each: each[0] if each[1] in used else "", svg)
    svg = re.sub(r' d="([^"]*)"', _rounded, svg, flags=re.DOTALL)
    svg = svg.replace(INK, "currentColor")
    label = f'<svg role="img" aria-label="{escape(description, quote=True)}"'
    return svg.replace("<svg", label, 1).strip()


def _rounded(path: re.Match[str]) -> str:
    """Path with coordinates to a hundredth of a point, which no screen can tell apart."""
    text = re.sub(
        r"-?\d+\.\d+", lambda each: f"{float(each[0]):.2f}".rstrip("0").rstrip("."), path[1]
    )
    return f' d="{" ".join(text.split())}"'
