"""Recordings as tables of other libraries, and as the short table that a notebook shows."""

from collections.abc import Mapping, Sequence
from html import escape
from typing import Any

import numpy as np
import pyarrow as pa

from legbench.errors import MissingExtraError
from legbench.recording.layout import TIME
from legbench.recording.stream import carrying
from legbench.signals import Floats

Rows = Sequence[tuple[str, str]]
"""Label and text of each row of a table for people."""


def arrow_table(
    columns: Mapping[str, np.ndarray], units: Mapping[str, str], manifest: Mapping[str, Any]
) -> pa.Table:
    """Return columns (n,) as an Arrow table with each column's unit and the manifest as metadata.

    Args:
        columns: values by name; a negative whole number of one byte means unknown and is null.
        units: unit by name of a column.
        manifest: what the table carries, as the samples of a run do.
    """
    arrays, fields = [], []
    for name, values in columns.items():
        unknown = values < 0 if values.dtype == np.int8 else None
        arrays.append(pa.array(values, mask=unknown))
        unit = {b"unit": units[name].encode()} if name in units else None
        fields.append(pa.field(name, arrays[-1].type, metadata=unit))
    return pa.table(arrays, schema=pa.schema(fields, metadata=carrying(manifest)))


def pandas_frame(table: pa.Table, time: Floats) -> Any:
    """Return a table of samples as a pandas DataFrame whose index `t` is the time (n,) [s].

    Raises:
        MissingExtraError: pandas is not installed.
    """
    timed = table.drop_columns([TIME]).append_column("t", pa.array(time))
    try:
        return timed.to_pandas().set_index("t")
    except ImportError as error:
        raise MissingExtraError(
            "pandas is not installed; a DataFrame needs it: pip install pandas, or take "
            "to_arrow(), which needs nothing more"
        ) from error


def as_text(rows: Rows) -> str:
    """Return a table as aligned lines."""
    width = max(len(label) for label, _ in rows)
    return "\n".join(f"{label:<{width}}  {text}" for label, text in rows)


def as_html(rows: Rows) -> str:
    """Return a table as HTML, with every text escaped."""
    cells = "".join(
        f"<tr><th style='text-align:left'>{escape(label)}</th>"
        f"<td style='text-align:left'>{escape(text)}</td></tr>"
        for label, text in rows
    )
    return f"<table>{cells}</table>"
