"""Recordings of runs, written so that a crash costs at most 50 rows.

`writer.RunWriter` writes a run folder, `reader.load` reads it, `repair.recover` makes whole what
a crash tore. A run folder holds

- `run.json`, the manifest: what ran, on what, how it ended;
- `samples.arrows` while the run is written, `samples.parquet` once it is closed;
- `events.jsonl`, one line a rare event;
- logs of the plant, such as `bus.log`, that grow beside the rows.

Importing this package costs nothing: pyarrow comes with the modules above.
"""
