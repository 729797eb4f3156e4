"""The table of a campaign: its columns, how it is made of measured rows, and how it is read."""

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, Final

import pyarrow as pa

from legbench.campaign.rows import KINDS, Row
from legbench.errors import ConfigError, FormatError, RecordingError
from legbench.experiment.toml_text import toml_value
from legbench.recording.sealed import UNREADABLE, opened
from legbench.writing import reason

TABLE: Final = "table.parquet"
TABLE_FORMAT: Final = 1
"""Version of the table and of its shards; it rises when an older reader would misread them."""
FORMAT_KEY: Final = b"legbench campaign table"
"""Key of the metadata under which a table and a shard tell their format."""
PROVENANCE_KEY: Final = b"legbench provenance"
"""Key of the metadata under which a table tells versions, processor and mathematics library."""

ALWAYS: Final = (
    "setup.kind",
    "controller.kind",
    "controller.settings.z2",
    "controller.settings.dz2",
    "design.name",
    "seed",
)
"""Settings that every table has as columns, whether they vary or not."""

TEXTS: Final = ("experiment", "row", "status", "cause", "numerics")
UNITS: Final = {
    "start": "s",
    "length": "s",
    "rating": "1",
    "rating_motor": "1",
    "rating_equilibrium": "1",
    "amplitude": "rad",
    "polar_max": "rad",
    "foot_clearance": "m",
    "trunk_excursion": "m",
    "drift": "m",
    "foot_travel": "m",
    "apex": "m",
    "hop_freq": "Hz",
    "energy_residual": "1",
    "loop_gap_max": "m",
}
"""Measured column -> its unit."""

MEASURED: Final = pa.schema(
    [
        pa.field("experiment", pa.string(), nullable=False),
        pa.field("row", pa.string(), nullable=False),
        pa.field("index", pa.int32(), nullable=False),
        *(pa.field(name, pa.string()) for name in ("status", "cause", "numerics")),
        *(
            pa.field(name, pa.float64(), nullable=False, metadata={"unit": unit})
            for name, unit in UNITS.items()
        ),
    ]
)
"""Columns that are measured: those of a shard, and of the table without its settings."""


def measured_table(rows: Iterable[Row]) -> pa.Table:
    """Return measured rows as a table with the columns `MEASURED`; a number left out is NaN."""
    kept = list(rows)
    columns = [
        pa.array(
            [row.get(field.name, None if field.name in TEXTS else float("nan")) for row in kept],
            type=field.type,
        )
        for field in MEASURED
    ]
    return pa.Table.from_arrays(columns, schema=MEASURED)


def whole_table(
    measured: pa.Table,
    settings: Mapping[str, Mapping[str, Any]],
    trials: Mapping[str, int],
    axes: Sequence[str],
    provenance: bytes,
) -> pa.Table:
    """Return the table of a campaign, sorted by experiment, kind of row and index.

    Args:
        measured: rows of all experiments, in any order.
        settings: hash -> value by dotted key.
        trials: hash -> number of the trial of its cell.
        axes: dotted keys that vary; they become columns, with those of `ALWAYS`.
        provenance: JSON of versions and machine.
    """
    order = pa.array([KINDS.index(kind) for kind in measured["row"].to_pylist()], pa.int8())
    keyed = measured.append_column("order", order)
    keys = [("experiment", "ascending"), ("order", "ascending"), ("index", "ascending")]
    ordered = keyed.sort_by(keys).drop_columns(["order"]).combine_chunks()
    hashes: list[str] = ordered["experiment"].to_pylist()
    arrays = [ordered[name] for name in ("experiment", "row", "index")]
    fields = [ordered.field(name) for name in ("experiment", "row", "index")]
    arrays.append(pa.array([trials[each] for each in hashes], pa.int32()))
    fields.append(pa.field("trial", pa.int32()))
    for key in (*axes, *(name for name in ALWAYS if name not in axes)):
        values = {each: found.get(key) for each, found in settings.items()}
        column = _axis([values[each] for each in hashes], _kind(values.values()))
        arrays.append(column)
        fields.append(pa.field(key, column.type))
    rest = MEASURED.names[3:]
    arrays += [ordered[name] for name in rest]
    fields += [ordered.field(name) for name in rest]
    metadata = {FORMAT_KEY: str(TABLE_FORMAT).encode(), PROVENANCE_KEY: provenance}
    return pa.Table.from_arrays(arrays, schema=pa.schema(fields, metadata=metadata))


def _kind(values: Iterable[Any]) -> pa.DataType:
    """Type that holds all values of a setting."""
    kinds = {type(value) for value in values if value is not None}
    if kinds == {bool}:
        return pa.bool_()
    if kinds == {int}:
        return pa.int64()
    return pa.float64() if kinds and kinds <= {int, float} else pa.string()


def _axis(values: list[Any], kind: pa.DataType) -> pa.Array:
    """Column of a setting; a list, or a value among others of another type, as its TOML text."""
    if kind != pa.string():
        return pa.array(values, kind)
    texts = [v if v is None or isinstance(v, str) else toml_value(v) for v in values]
    return pa.array(texts, kind)


def read_table(folder: Path | str) -> pa.Table:
    """Read the table of the campaign in `folder`, or the file of such a table.

    Raises:
        ConfigError: the campaign has no table, or has not come to its end.
        FormatError: another version wrote it.
        RecordingError: it is damaged.
    """
    path = Path(folder)
    path = path / TABLE if path.is_dir() else path
    if not path.is_file():
        raise ConfigError(
            f"{path} is not there: name the folder of a campaign that has come to its end, or go on"
            " with legbench campaign"
        )
    try:
        with opened(path) as file:
            table = file.read()
    except UNREADABLE as error:
        raise RecordingError(
            f"{path} is damaged: {reason(error)}; move it away and go on with legbench campaign, "
            "which makes it anew of the campaign's shards"
        ) from error
    found = (table.schema.metadata or {}).get(FORMAT_KEY, b"none").decode()
    if found != str(TABLE_FORMAT):
        raise FormatError(
            f"{path} has format {found}; this legbench reads {TABLE_FORMAT}: use the legbench that "
            "wrote it, or run the campaign again in a new folder"
        )
    return table
