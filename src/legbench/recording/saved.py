"""A recording that was kept in memory, as a run folder that is whole or not there.

Such recordings are many, those of a campaign, and are packed tighter than that of a single run.
"""

import shutil
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Final

import pyarrow as pa
from pyarrow import parquet

from legbench.errors import RecordingError
from legbench.recording.archive import GROUP_ROWS, column_encodings
from legbench.recording.archive_columns import LONG_ROWS
from legbench.recording.derived import DERIVED, FORMULA, TORQUE, derivable
from legbench.recording.events import encode_event
from legbench.recording.layout import ARCHIVE, EVENTS
from legbench.recording.manifest import write_manifest
from legbench.recording.reader import Recording
from legbench.recording.sealed import seal
from legbench.recording.stream import schema_for
from legbench.writing import put_in_place, reason

LEVEL: Final = 13
"""Level of zstd; a recording of 8 s is 4 % smaller than at its usual level for 20 ms more, and at
level 19 it would be one more percent for 90 ms."""


def save_recording(recording: Recording, path: Path) -> None:
    """Write a recording as the run folder `path`, at once; an older one there is replaced.

    Raises:
        RecordingError: it cannot be written; what is at `path` is what it was before.
    """
    draft = path.with_name(f".{path.name}.draft")
    try:
        shutil.rmtree(draft, ignore_errors=True)
        draft.mkdir(parents=True)
        left_out = _left_out(recording)
        manifest = {**recording.manifest, "id": path.name}
        manifest |= {DERIVED: {TORQUE: FORMULA}} if left_out else {}
        write_manifest(draft, manifest)
        events = [dict(event) for event in recording.events]
        lines = [encode_event(event.pop("time"), event.pop("name"), event) for event in events]
        (draft / EVENTS).write_bytes(b"".join(lines))
        _write_samples(replace(recording, manifest=manifest), left_out, draft / ARCHIVE)
        if path.exists():
            shutil.rmtree(path)
        draft.rename(path)
    except (OSError, pa.ArrowException) as error:
        with suppress(OSError):
            shutil.rmtree(draft)
        raise RecordingError(f"{path} was not written: {reason(error)}") from error


def _left_out(recording: Recording) -> tuple[str, ...]:
    """Columns that need not be written; those of a long run are never all in memory."""
    if len(recording.time) > LONG_ROWS:
        return ()
    return derivable(recording.columns, recording.described)


def _write_samples(recording: Recording, left_out: Sequence[str], path: Path) -> None:
    table = recording.to_arrow().cast(schema_for(recording.manifest)).drop_columns([*left_out])
    draft = path.with_name(f".{path.name}.draft")
    parquet.write_table(
        table,
        str(draft),
        row_group_size=GROUP_ROWS,
        compression="zstd",
        compression_level=LEVEL,
        use_dictionary=False,
        column_encoding=column_encodings(table.schema),
        write_page_checksum=True,
    )
    with draft.open("r+b") as file:
        seal(file)
    put_in_place(draft, path)
