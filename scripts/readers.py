"""The other side of `check_readers.py`: reads its files with libraries that know no legbench.

PYTHON scripts/readers.py FOLDER
"""

import sys
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import duckdb  # type: ignore[import-not-found]
import fastparquet  # type: ignore[import-not-found]
import numpy as np
import pandas as pd  # type: ignore[import-not-found]
import polars as pl  # type: ignore[import-not-found]

Columns = Mapping[str, Any]


def of_polars(frame: pl.DataFrame) -> Columns:
    """Columns of a polars frame."""
    return {name: frame[name].to_numpy() for name in frame.columns}


def of_pandas(frame: pd.DataFrame) -> Columns:
    """Columns of a pandas frame."""
    return {name: frame[name].to_numpy() for name in frame.columns}


PARQUET: dict[str, Callable[[Path], Columns]] = {
    "pandas": lambda path: of_pandas(pd.read_parquet(path, engine="pyarrow")),
    "polars": lambda path: of_polars(pl.read_parquet(path)),
    "DuckDB": lambda path: duckdb.sql(f"select * from '{path}'").fetchnumpy(),
    "fastparquet": lambda path: of_pandas(fastparquet.ParquetFile(str(path)).to_pandas()),
}
CSV: dict[str, Callable[[Path], Columns]] = {
    "pandas": lambda path: of_pandas(pd.read_csv(path)),
    "polars": lambda path: of_polars(pl.read_csv(path, infer_schema_length=None)),
    "DuckDB": lambda path: duckdb.sql(f"select * from '{path}'").fetchnumpy(),
}
STREAMS: dict[str, Callable[[Path], int]] = {
    "polars": lambda path: pl.read_ipc_stream(path).height,
    "pandas": lambda path: len(pd.read_feather(path)),
}


def differs(found: Columns, wanted: Columns, bound: float) -> str | None:
    """Name of the first column that is not as it should be; an unknown contact is null there."""
    for name, values in wanted.items():
        cells = np.ma.filled(np.ma.asarray(found[name]).astype(np.float64), np.nan)
        close = np.abs(cells - values) <= bound * np.abs(values)
        if not np.all(close | ~np.isfinite(values)):
            return name
    return None


def with_torques(found: Columns, stiffness: Any) -> Columns:
    """Columns that a campaign has kept, with the torques that it leaves out (docs/recording.md)."""
    pairs = zip("12", stiffness, strict=True)
    torques = {
        f"spring_torque_{joint}": k * (found[f"motor_pos_{joint}"] - found[f"joint_pos_{joint}"])
        for joint, k in pairs
    }
    return {**found, **torques}


def main(folder: Path) -> int:
    """Compare; 1 if a library reads anything else than what was recorded."""
    wanted = dict(np.load(folder / "run.npz"))
    in_seconds = {"t [s]": wanted["t_ns"] / 1e9}
    failed = 0
    kept = dict(np.load(folder / "kept.npz"))
    stiffness = kept.pop("stiffness")
    for name, read in PARQUET.items():
        for file in ("run.parquet", "table.parquet"):
            wrong = differs(read(folder / file), wanted, 0.0)
            failed += wrong is not None
            print(f"{'ok' if wrong is None else f'WRONG in {wrong}':<8} {file}, {name}: exact")
        try:
            wrong = differs(read(folder / "samples.parquet"), wanted, 0.0)
            torques = with_torques(read(folder / "kept/samples.parquet"), stiffness)
            wrong = wrong or differs(torques, kept, 0.0)
        except Exception as error:  # what a library raises is its own choice, and the news
            print(f"         samples.parquet, {name}: cannot: {str(error).splitlines()[0][:80]}")
        else:
            read_so = "wrongly" if wrong else "exactly, with and without torques"
            print(f"         samples.parquet, {name}: reads it {read_so}")
    for name, read in CSV.items():
        found = read(folder / "run.csv")
        bare = {title.rsplit(" [", 1)[0]: values for title, values in found.items()}
        wrong = differs(bare, {k: v for k, v in wanted.items() if k != "t_ns"}, 1e-15)
        wrong = wrong or differs(found, in_seconds, 1e-15)
        failed += wrong is not None
        print(f"{'ok' if wrong is None else f'WRONG in {wrong}':<8} run.csv, {name}: to 1e-15")
    for name, count in STREAMS.items():
        for file in ("boundary", "torn"):
            try:
                told = f"{count(folder / f'{file}.arrows')} of 200 rows"
            except Exception as error:  # as above
                told = f"cannot: {str(error).splitlines()[0][:80]}"
            print(f"         {file}.arrows, {name}: {told}")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1])))
