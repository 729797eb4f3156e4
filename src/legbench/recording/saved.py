"""A recording that was kept in memory, as a run folder that is whole or not there."""

import shutil
from contextlib import suppress
from pathlib import Path

import pyarrow as pa
from pyarrow import parquet

from legbench.errors import RecordingError
from legbench.recording.archive import GROUP_ROWS, column_encodings
from legbench.recording.events import encode_event
from legbench.recording.layout import ARCHIVE, EVENTS
from legbench.recording.manifest import write_manifest
from legbench.recording.reader import Recording
from legbench.recording.stream import schema_for
from legbench.writing import put_in_place, reason


def save_recording(recording: Recording, path: Path) -> None:
    """Write a recording as the run folder `path`, at once; an older one there is replaced.

    Raises:
        RecordingError: it cannot be written; what is at `path` is what it was before.
    """
    draft = path.with_name(f".{path.name}.draft")
    try:
        shutil.rmtree(draft, ignore_errors=True)
        draft.mkdir(parents=True)
        write_manifest(draft, {**recording.manifest, "id": path.name})
        events = [dict(event) for event in recording.events]
        lines = [encode_event(event.pop("time"), event.pop("name"), event) for event in events]
        (draft / EVENTS).write_bytes(b"".join(lines))
        _write_samples(recording, draft / ARCHIVE)
        if path.exists():
            shutil.rmtree(path)
        draft.rename(path)
    except (OSError, pa.ArrowException) as error:
        with suppress(OSError):
            shutil.rmtree(draft)
        raise RecordingError(f"{path} was not written: {reason(error)}") from error


def _write_samples(recording: Recording, path: Path) -> None:
    table = recording.to_arrow().cast(schema_for(recording.manifest))
    draft = path.with_name(f".{path.name}.draft")
    parquet.write_table(
        table,
        str(draft),
        row_group_size=GROUP_ROWS,
        compression="zstd",
        use_dictionary=False,
        column_encoding=column_encodings(table.schema),
    )
    put_in_place(draft, path)
