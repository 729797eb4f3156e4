"""Parquet that every reader opens: plain encoding, Snappy, no newer feature of the format."""

from pathlib import Path

from pyarrow import parquet

from legbench.export.content import Progress, as_json, described
from legbench.recording.archive import GROUP_ROWS
from legbench.recording.export import arrow_table
from legbench.recording.reader import Recording
from legbench.recording.stream import carrying


def write_parquet(recording: Recording, path: Path, progress: Progress) -> None:
    """Write the columns of a run bit for bit; the time is whole nanoseconds, unknown contact null.

    A field's metadata has its `unit`; the file's has `phases` (name by code), `units`, and the
    manifest under `legbench`.

    Raises:
        OSError: the file cannot be written.
    """
    about = {name.encode(): as_json(each) for name, each in described(recording).items()}
    metadata = carrying(recording.manifest) | about
    units, done = recording.layout.units, 0
    # A slice alone would keep the whole column.
    none = {name: values[:0].copy() for name, values in recording.columns.items()}
    empty = arrow_table(none, units, {})
    with parquet.ParquetWriter(
        str(path),
        empty.schema.with_metadata(metadata),
        version="1.0",
        compression="snappy",
        use_dictionary=False,
        data_page_version="1.0",
        write_page_checksum=True,
    ) as writer:
        for part in recording.windows(GROUP_ROWS):
            writer.write_table(arrow_table(part.columns, units, {}))
            done += len(part.time)
            progress(done, len(recording.time))
