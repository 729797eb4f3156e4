"""Reading a run: whatever state it was left in, as arrays by the name of the signal."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np
import pyarrow as pa

from legbench.errors import FormatError, LegbenchError, RecordingError
from legbench.recording.archive import read_archive
from legbench.recording.archive_columns import (
    LONG_ROWS,
    WINDOW_ROWS,
    ArchiveColumns,
    column_values,
    column_windows,
    spooled,
)
from legbench.recording.columns import ONE_LEG, Layout
from legbench.recording.derived import completed
from legbench.recording.description import RunDescription, describe
from legbench.recording.events import Event, read_events
from legbench.recording.export import Rows, arrow_table, as_html, as_text, pandas_frame
from legbench.recording.layout import ARCHIVE, COMPLETE, EVENTS, RUN, STREAM, TIME
from legbench.recording.manifest import Manifest, read_manifest
from legbench.recording.stream import WholeBatches, carried_manifest, schema_for
from legbench.signals import Floats
from legbench.writing import reason


class UnknownSignalError(LegbenchError, KeyError):
    """A signal that a run does not have."""

    def __str__(self) -> str:
        return str(self.args[0])


@dataclass(frozen=True, slots=True, kw_only=True, eq=False, repr=False)
class Recording:
    """What a run left; `recording["joint_pos"]` is a signal as one array."""

    path: Path
    """The run folder; the name alone of a run that was kept in memory."""
    manifest: Manifest
    """`run.json` as it is written, or the copy in the samples as of the start of the run; for
    provenance, since `description` says what it means."""
    described: RunDescription | FormatError
    """What the run says of itself, or why that cannot be understood: its rows can be read still."""
    time: Floats
    """Plant time since reset (n,) [s]."""
    columns: Mapping[str, np.ndarray]
    """Column on disk -> its values (n,), read-only; `contact` is -1 where unknown. Those of a long
    run are read from its file each time."""
    events: tuple[Event, ...]
    """What happened rarely, each with `time` [s] and `name`."""
    torn: str | None = None
    """What is missing or unreadable at the end, None for a run that was closed."""

    def __getitem__(self, name: str) -> np.ndarray:
        """Return the signal `name`, components last, as a new array.

        A pair is (n, 2) float64, `phase` (n,) int64, `contact` (n,) bool (False where
        unknown), "t" and "time" are the time (n,) [s].

        Raises:
            UnknownSignalError: the run has no such signal; lists those that it has.
        """
        if name in ("t", "time"):
            return self.time.copy()
        columns = self._columns_of(name)
        if any(column not in self.columns for column in columns):
            known = ", ".join(self.signals)
            raise UnknownSignalError(f"{self.path.name} has no signal {name!r}; it has {known}")
        if name == "contact":
            return self.columns[name] == 1
        if name == "phase":
            return self.columns[name].astype(np.int64)
        arrays = [self.columns[column] for column in columns]
        return arrays[0].copy() if len(arrays) == 1 else np.stack(arrays, axis=-1)

    @property
    def signals(self) -> tuple[str, ...]:
        """Names of the signals that this run has, "t" first."""
        names = [signal.name for signal in self.layout.signals]
        there = [name for name in names if all(c in self.columns for c in self._columns_of(name))]
        return ("t", *there)

    @property
    def description(self) -> RunDescription:
        """What the run says of itself.

        Raises:
            FormatError: its manifest describes no leg, or cannot be understood.
        """
        if isinstance(self.described, FormatError):
            raise self.described
        return self.described

    @property
    def layout(self) -> Layout:
        """Columns that the run declares."""
        return ONE_LEG if isinstance(self.described, FormatError) else self.described.layout

    @property
    def complete(self) -> bool:
        """Whether the run came to its end and nothing is missing."""
        return self.manifest.get("status") == COMPLETE and self.torn is None

    @property
    def has_truth(self) -> bool:
        """Whether every row has what only a simulation knows (False for an empty run)."""
        contact = self.columns.get("contact")
        return contact is not None and len(contact) > 0 and bool(np.all(contact >= 0))

    def windows(self, rows: int = WINDOW_ROWS) -> "Iterator[Recording]":
        """Yield consecutive parts of the run, at most `rows` rows each; the events are left out.

        The columns of a part are in memory; those of the parts before need not be any more.
        """
        first = 0
        for columns in column_windows(self.columns, rows):
            stop = first + len(columns[TIME])
            part = MappingProxyType(dict(columns))
            yield replace(self, time=self.time[first:stop], columns=part, events=())
            first = stop

    def to_arrow(self) -> pa.Table:
        """Return every column as an Arrow table: time as whole nanoseconds, unknown contact null.

        Each field's metadata has its unit, the table's has the manifest.
        """
        return arrow_table(self.columns, self.layout.units, self.manifest)

    def to_pandas(self) -> Any:
        """Return every column but the time as a pandas DataFrame; its index is the time `t` [s].

        Raises:
            MissingExtraError: pandas is not installed.
        """
        return pandas_frame(self.to_arrow(), self.time)

    def __repr__(self) -> str:
        """Return the run in a few lines: what ran, how long, how it ended."""
        return as_text(self._rows())

    def _repr_html_(self) -> str:
        """Return the same table for a notebook."""
        return as_html(self._rows())

    def _rows(self) -> Rows:
        span = f"{self.time[-1] - self.time[0]:.4g} s, " if len(self.time) else ""
        rows = [("run", self.path.name)]
        if isinstance(self.described, FormatError):
            rows.append(("not understood", str(self.described)))
        else:
            run = self.described
            rows += [
                ("leg", f"{run.title}, {run.setup.kind.value}"),
                ("controller", run.controller),
                ("ended", ": ".join(filter(None, (run.status or "unknown", run.cause)))),
            ]
        messages = [str(event["message"]) for event in self.events if "message" in event]
        rows += [("message", text) for text in messages]
        rows += [("rows", f"{span}{len(self.time)} rows"), ("signals", ", ".join(self.signals))]
        return [*rows, *([] if self.torn is None else [("torn", self.torn)])]

    def _columns_of(self, name: str) -> tuple[str, ...]:
        """Columns of a signal of one leg; the name itself for anything else."""
        signals = {signal.name: signal for signal in self.layout.signals}
        return self.layout.columns_of(signals[name])[0] if name in signals else (name,)


def load(path: Path | str) -> Recording:
    """Read the run in the folder `path`, or the run whose `run.json` or samples `path` is.

    A run that is being written or was torn gives its whole batches; one that ended before its
    first row gives empty arrays.

    Raises:
        RecordingError: `path` is no run folder, has no samples, or a file in it is damaged.
        FormatError: a newer version wrote it.
    """
    run = run_folder(Path(path))
    manifest = read_manifest(run)
    columns, schema, torn = _samples(run, manifest)
    if manifest is None:
        manifest = carried_manifest(schema, run)
    if TIME not in columns:
        raise RecordingError(f"the samples of {run} have no column {TIME}")
    told = described(manifest, run)
    columns = completed(columns, manifest, told)
    events, bad = read_events(run)
    if bad:
        torn = "; ".join(filter(None, (torn, f"{EVENTS} has {bad} unreadable lines")))
    return Recording(
        path=run,
        manifest=manifest,
        described=told,
        time=columns[TIME] / 1e9,
        columns=columns,
        events=tuple(events),
        torn=torn,
    )


def described(manifest: Manifest, run: Path) -> RunDescription | FormatError:
    """Parse the manifest of the folder `run`, or return why it cannot be."""
    try:
        return describe(manifest, run.name)
    except FormatError as error:
        # A new one: the frames of one that was raised would keep the run's columns alive.
        return FormatError(str(error))


def run_folder(path: Path) -> Path:
    """Return the folder of the run at `path`.

    Raises:
        RecordingError: there is no run; names those that lie below, if any.
    """
    run = path.parent if path.name in (RUN, ARCHIVE, STREAM) else path
    if any((run / name).is_file() for name in (RUN, ARCHIVE, STREAM)):
        return run
    if not run.exists():
        raise RecordingError(f"{path} does not exist")
    if not run.is_dir():
        raise RecordingError(f"{path} is a file, no run folder: a run has a {RUN}")
    inside = sorted(manifest.parent.name for manifest in run.glob(f"*/{RUN}"))
    hint = f"; it holds the runs {', '.join(inside[-5:])}" if inside else ""
    raise RecordingError(f"{run} is no run folder: it has no {RUN}{hint}")


def _samples(
    run: Path, manifest: Manifest | None
) -> tuple[Mapping[str, np.ndarray], pa.Schema, str | None]:
    """Return columns and schema of a run and what is missing, from the archive or the stream."""
    if (run / ARCHIVE).is_file():
        archive = ArchiveColumns(run / ARCHIVE)
        if archive.rows > LONG_ROWS:
            return archive, archive.schema, None
        return _in_memory(read_archive(run)), archive.schema, None
    try:
        stream = WholeBatches(run / STREAM)
    except FileNotFoundError as error:
        raise RecordingError(f"{run} has no samples: no {ARCHIVE}, no {STREAM}") from error
    except OSError as error:
        raise RecordingError(f"{run / STREAM} cannot be read: {reason(error)}") from error
    schema = stream.schema
    if schema is None:
        schema = schema_for(manifest if manifest is not None else carried_manifest(None, run))
    if stream.size > LONG_ROWS * _row_bytes(schema):
        columns = spooled(stream, manifest or carried_manifest(schema, run))
        return columns, schema, stream.tear
    return _in_memory(pa.Table.from_batches(list(stream), schema)), schema, stream.tear


def _in_memory(table: pa.Table) -> Mapping[str, np.ndarray]:
    return MappingProxyType({name: column_values(table[name]) for name in table.column_names})


def _row_bytes(schema: pa.Schema) -> int:
    return sum(field.type.bit_width for field in schema) // 8
