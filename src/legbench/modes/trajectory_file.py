"""Orbits as trajectories in a Parquet file, in a file of its own since pyarrow loads slowly."""

from pathlib import Path

import numpy as np
import pyarrow as pa
from pyarrow import parquet

from legbench.errors import UnwritableError
from legbench.modes.trajectory import COLUMNS, OrbitPath
from legbench.writing import reason, write_whole


def write_paths(paths: list[OrbitPath], path: Path) -> None:
    """Write trajectories as one Parquet table, a row an instant, written whole or not at all.

    Raises:
        UnwritableError: it cannot be written.
    """
    rows = np.vstack([one.rows for one in paths])
    counts = [len(one.rows) for one in paths]
    columns: dict[str, pa.Array] = {
        "family": pa.array(np.repeat([one.family for one in paths], counts)),
        "orbit": pa.array(np.repeat([one.index for one in paths], counts)),
        "energy": pa.array(np.repeat([one.energy for one in paths], counts)),
        "period": pa.array(np.repeat([one.period for one in paths], counts)),
        "stable": pa.array(
            [one.stable for one, count in zip(paths, counts, strict=True) for _ in range(count)],
            type=pa.bool_(),
        ),
    }
    columns |= {name: pa.array(rows[:, place]) for place, name in enumerate(COLUMNS)}
    sink = pa.BufferOutputStream()
    parquet.write_table(pa.table(columns), sink, write_page_checksum=True)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        write_whole(path, sink.getvalue().to_pybytes())
    except OSError as error:
        raise UnwritableError(
            f"cannot write {path}: {reason(error)}; name a folder that you can write"
        ) from error
