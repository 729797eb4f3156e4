"""Reading an .rrd file back: rerun's reading interface changes often, so it is used here alone."""

from pathlib import Path
from typing import Any

import numpy as np
from rerun.chunk import RrdReader


def _chunks(path: Path) -> dict[str, list[Any]]:
    chunks: dict[str, list[Any]] = {}
    for chunk in RrdReader(path).stream():
        batch = chunk.to_record_batch()
        chunks.setdefault(str(chunk.entity_path), []).append(batch)
    return chunks


def temporal(path: Path) -> dict[str, dict[str, Any]]:
    """Entity -> {"t": times [s], component: list of rows}, everything on the timeline t."""
    entities: dict[str, dict[str, Any]] = {}
    for entity, batches in _chunks(path).items():
        parts = [batch for batch in batches if "t" in batch.schema.names]
        if not parts:
            continue
        found = entities.setdefault(entity, {"t": np.zeros(0)})
        for batch in parts:
            nanoseconds = batch.column("t").cast("int64").to_numpy()
            found["t"] = np.concatenate([found["t"], nanoseconds / 1e9])
            for name in batch.schema.names:
                if ":" in name:
                    component = name.rsplit(":", 1)[1]
                    found.setdefault(component, []).extend(batch.column(name).to_pylist())
    return entities


def static(path: Path) -> dict[str, dict[str, Any]]:
    """Entity -> {component: value}, everything that holds at all times, as logged last."""
    entities: dict[str, dict[str, Any]] = {}
    for entity, batches in _chunks(path).items():
        for batch in (batch for batch in batches if "t" not in batch.schema.names):
            for name in batch.schema.names:
                rows = batch.column(name).to_pylist() if ":" in name else []
                known = [row for row in rows if row is not None]
                if known:
                    entities.setdefault(entity, {})[name.rsplit(":", 1)[1]] = known[-1]
    return entities
