"""CSV that a spreadsheet opens: one line a row, units in the header, nothing lost of a number."""

from pathlib import Path
from typing import Final

import numpy as np
import pyarrow as pa
from pyarrow import csv

from legbench.export.content import Progress, fields_of, phase_names, phases_of
from legbench.recording.layout import TIME
from legbench.recording.reader import Recording

SECONDS: Final = "t [s]"
PHASE_NAME: Final = "phase_name"


def write_csv(recording: Recording, path: Path, progress: Progress) -> None:
    """Write the rows of a run as text that reads back as the same numbers.

    The time comes first, in seconds; a number that is not known is an empty cell. The name of the
    phase follows its code. Numbers have as many digits as tell them from their neighbours, at most
    17.

    Raises:
        OSError: the file cannot be written.
    """
    fields = [field for field in fields_of(recording) if field.name != TIME]
    phases, done = phases_of(recording), 0
    titles = [SECONDS]
    for field in fields:
        titles += [field.titled, *([PHASE_NAME] if field.name == "phase" else [])]
    # Without rows the schema is that of numbers; the file is its header alone.
    writer = None
    try:
        for part in recording.windows():
            arrays = [pa.array(part.columns[TIME] / 1e9)]
            for field in fields:
                values = part.columns[field.name]
                arrays.append(_known(values))
                if field.name == "phase":
                    arrays.append(pa.array(phase_names(phases, values)))
            table = pa.table(arrays, names=titles)
            if writer is None:
                writer = csv.CSVWriter(str(path), table.schema)
            writer.write_table(table)
            done += len(part.time)
            progress(done, len(recording.time))
    finally:
        if writer is not None:
            writer.close()
    if writer is None:
        path.write_text(",".join(f'"{title}"' for title in titles) + "\n", encoding="utf-8")


def _known(values: np.ndarray) -> pa.Array:
    """Values with null in place of what is not known."""
    if values.dtype == np.int8:
        return pa.array(values, mask=values < 0)
    return pa.array(values, mask=np.isnan(values)) if values.dtype.kind == "f" else pa.array(values)
