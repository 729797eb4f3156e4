"""Names of logs of raw frames."""

from pathlib import Path
from typing import Final

SUFFIXES: Final = (".log", ".asc", ".blf", ".trc", ".csv")
"""Formats by the suffix of a file: candump's, Vector's text and binary, PEAK's, python-can's table;
each may be packed, as `.log.gz`."""


def is_log(path: Path) -> bool:
    """Whether there is a file that has the name of a log of raw frames."""
    name = path.with_suffix("") if path.suffix.lower() == ".gz" else path
    return path.is_file() and name.suffix.lower() in SUFFIXES
