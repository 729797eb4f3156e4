"""How every print figure becomes a file."""

from pathlib import Path

from legbench.errors import ConfigError
from legbench.viz.drafts import draft_of
from legbench.viz.print._matplotlib import PlainFigure, styled

SUFFIXES = (".png", ".svg", ".pdf")
DPI = 200
"""Dots of a .png, and of what is drawn as dots in the others [1/inch]."""


def save_figure(figure: PlainFigure, path: Path, dpi: int = DPI) -> Path:
    """Write a figure as .png, .svg or .pdf, the same bytes every time; make its folder if need be.

    Raises:
        ConfigError: any other suffix.
        RecordingError: nothing can be written there.
    """
    kind = path.suffix.lower()
    if kind not in SUFFIXES:
        known = ", ".join(SUFFIXES)
        raise ConfigError(f"a figure cannot be written as {path.name!r}; choose from {known}")
    undated = {".png": {"Software": None}, ".svg": {"Date": None}, ".pdf": {"CreationDate": None}}
    with draft_of(path) as draft, styled():
        figure.savefig(draft, format=kind[1:], dpi=dpi, metadata=undated[kind])
    return path
