"""Selection of runs from their table: those that fulfil a condition, in the order of a column."""

from collections.abc import Mapping, Sequence
from typing import Any

from legbench.runs.columns import column_named, names_in
from legbench.runs.where import parse_where

Rows = Sequence[Mapping[str, Any]]


def select(
    rows: Rows, *, where: str | None = None, sort: str | None = None, descending: bool = False
) -> list[Mapping[str, Any]]:
    """Return the rows that fulfil a condition, sorted by a column; rows without it come last.

    Args:
        rows: rows of `index.rows_of`.
        where: condition as `where.parse_where` takes it; none: every row.
        sort: figure or setting; none: the order in which they are.
        descending: largest first.

    Raises:
        ConfigError: the condition makes no sense, or no run has the figure or setting.
    """
    names = names_in(rows)
    chosen = (
        list(rows) if where is None or not names else list(filter(parse_where(where, names), rows))
    )
    if sort is None or not names:
        return chosen[::-1] if descending else chosen
    column = column_named(sort, names)
    known = [row for row in chosen if row.get(column) is not None]
    known.sort(key=lambda row: _key(row[column]), reverse=descending)
    return [*known, *(row for row in chosen if row.get(column) is None)]


def _key(value: Any) -> tuple[bool, Any]:
    """Numbers by size, then texts by their letters."""
    text = isinstance(value, str)
    return text, value
