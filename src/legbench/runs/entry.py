"""Everything that is known of one run as a flat row: figures first, then settings by dotted key."""

import json
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from legbench.errors import LegbenchError
from legbench.metrics.summary import Summary, summarise
from legbench.recording.reader import load
from legbench.strict_json import null_for_nan

Cell = float | str | bool | None
"""Value of a column in one run; none where the run does not show it."""
Row = dict[str, Cell]

PLANNED = "duration"
"""Setting that has the name of a figure, which it would hide."""
UNREADABLE = "unreadable"
"""Status of a run that cannot be read; its cause says why."""


def measure(run: Path) -> Row:
    """Figures and settings of the run in a folder; one that cannot be read says so and no more.

    A list of ratings is its mean, the two largest changes by the limits their maximum. Settings
    are those of the experiment, as its file names them, but for the duration that was wished,
    which is `planned_duration` beside the one that was reached.
    """
    try:
        recording = load(run)
        described = recording.description
        figures = _figures(summarise(recording))
    except LegbenchError as error:
        return {"status": UNREADABLE, "cause": str(error)}
    ending = {"torn": recording.torn, "rows": len(recording.time)}
    named = {
        "id": described.id,
        "created": described.created,
        "design": described.design.name,
        "plant": described.plant,
    }
    settings = dict(_flat(described.experiment))
    if PLANNED in settings:
        settings[f"planned_{PLANNED}"] = settings.pop(PLANNED)
    row = null_for_nan(named | ending | figures | settings)
    return {name: _cell(value) for name, value in row.items()}


def _figures(summary: Summary) -> dict[str, Any]:
    """Figures of a summary with one number in place of each list."""
    found = summary.to_json()
    del found["run"]
    found["warnings"] = len(found["warnings"])
    largest = ("limited_max",)
    for name, value in found.items():
        if isinstance(value, list):
            known = [each for each in value if each is not None]
            found[name] = max(known, default=None) if name in largest else _mean(known)
    rated = (found["rating_periods"], found["rating_stance"], found["rating_flight"])
    return found | {"rating": _mean([each for each in rated if each is not None])}


def _mean(values: list[float]) -> float | None:
    return sum(values) / len(values) if values else None


def _flat(entries: Mapping[str, Any], path: str = "") -> Iterator[tuple[str, Any]]:
    """Entries of tables within tables, by their dotted keys."""
    for key, value in entries.items():
        name = f"{path}.{key}" if path else key
        if isinstance(value, Mapping):
            yield from _flat(value, name)
        else:
            yield name, value


def _cell(value: Any) -> Cell:
    """Value as a table can hold it: a list becomes its JSON text."""
    if value is None or isinstance(value, bool | int | float | str):
        return value
    return json.dumps(value)
