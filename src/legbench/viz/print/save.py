"""Saving of print figures as files."""

from io import StringIO
from pathlib import Path

from legbench.errors import ConfigError
from legbench.viz.drafts import draft_of
from legbench.viz.print._matplotlib import PlainFigure, styled

SUFFIXES = (".png", ".svg", ".pdf")
DPI = 200
"""Resolution of a .png, and of rasterised parts in vector files [1/inch]."""


def check_suffix(path: Path) -> str:
    """Kind of file that a figure is to be written as, such as `.png`.

    Raises:
        ConfigError: no figure can be written as this.
    """
    kind = path.suffix.lower()
    if kind not in SUFFIXES:
        known = ", ".join(SUFFIXES)
        raise ConfigError(f"a figure cannot be written as {path.name!r}; choose from {known}")
    return kind


def save_figure(figure: PlainFigure, path: Path, dpi: int = DPI) -> Path:
    """Write a figure as .png, .svg or .pdf, the same bytes every time; make its folder if need be.

    Raises:
        ConfigError: any other suffix.
        RecordingError: nothing can be written there.
    """
    kind = check_suffix(path)
    undated = {".png": {"Software": None}, ".svg": {"Date": None}, ".pdf": {"CreationDate": None}}
    with draft_of(path) as draft, styled():
        figure.savefig(draft, format=kind[1:], dpi=dpi, metadata=undated[kind])
    return path


def svg_text(figure: PlainFigure) -> str:
    """A figure as the text of an SVG on no ground and without metadata; in the style around it."""
    unsigned = {"Date": None, "Creator": None, "Format": None, "Type": None}
    with StringIO() as stream:
        figure.savefig(stream, format="svg", transparent=True, metadata=unsigned)
        return stream.getvalue()
