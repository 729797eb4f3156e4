"""Messages made over memory that is filled anew, against pyarrow's own way from arrays."""

import io

import numpy as np
import pyarrow as pa
import pytest
from pyarrow import ipc

from legbench.recording.columns import ONE_LEG, SMALL_INTEGERS
from legbench.recording.layout import TIME
from legbench.recording.stream import BatchEncoder, encode_schema, schema_for
from legbench.signals import Floats

SCHEMA = schema_for({"plant": "sim"})


def rows(seed: int, count: int = 50, *, truth: bool = True) -> Floats:
    rng = np.random.default_rng(seed)
    columns = rng.normal(size=(1 + len(ONE_LEG.names), count))
    columns[0] = np.sort(rng.uniform(0.0, 100.0, count))
    for name in SMALL_INTEGERS:
        columns[1 + ONE_LEG.names.index(name)] = rng.integers(0, 9, count)
    if not truth:
        columns[1 + ONE_LEG.names.index("contact")] = np.nan
    return columns


def expected(columns: Floats) -> pa.RecordBatch:
    values: dict[str, pa.Array] = {TIME: pa.array(np.rint(columns[0] * 1e9).astype(np.int64))}
    for name, column in zip(ONE_LEG.names, columns[1:], strict=True):
        known = [None if np.isnan(value) else int(value) for value in column]
        values[name] = pa.array(known, pa.int8()) if name in SMALL_INTEGERS else pa.array(column)
    return pa.RecordBatch.from_pydict(values, schema=SCHEMA)


def read_back(*messages: bytes | memoryview) -> list[pa.RecordBatch]:
    stream = io.BytesIO(bytes(encode_schema(SCHEMA)) + b"".join(bytes(part) for part in messages))
    return list(ipc.open_stream(stream))


@pytest.mark.parametrize("truth", [True, False])
@pytest.mark.parametrize("count", [1, 7, 50])
def test_each_message_is_of_its_own_rows(count: int, truth: bool) -> None:
    batches = [rows(seed, count, truth=truth) for seed in range(3)]
    encoder = BatchEncoder(batches[0], SCHEMA)
    assert all(encoder.fits(columns) for columns in batches)
    messages = [bytes(encoder.encode(columns)) for columns in batches]
    for columns, found in zip(batches, read_back(*messages), strict=True):
        found.validate(full=True)
        assert found.equals(expected(columns))
        assert found.column("contact").null_count == (0 if truth else count)


def test_other_rows_or_other_nulls_do_not_fit() -> None:
    encoder = BatchEncoder(rows(0), SCHEMA)
    assert not encoder.fits(rows(1, 49))
    assert not encoder.fits(rows(1, truth=False))
    some = rows(1)
    some[1 + ONE_LEG.names.index("contact"), 3] = np.nan
    assert not encoder.fits(some)
    (found,) = read_back(BatchEncoder(some, SCHEMA).encode(some))
    assert found.column("contact").null_count == 1
    assert found.equals(expected(some))
