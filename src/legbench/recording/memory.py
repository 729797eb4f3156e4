"""A run that is kept in memory: rows and events as a `RunWriter` takes them, without a folder."""

from collections.abc import Mapping
from datetime import UTC, datetime
from pathlib import Path
from types import MappingProxyType
from typing import Any, final

import numpy as np

from legbench.recording.columns import Column
from legbench.recording.description import layout_of
from legbench.recording.events import Event
from legbench.recording.layout import COMPLETE, TIME, run_name
from legbench.recording.manifest import new_manifest, plain
from legbench.recording.reader import Recording, described
from legbench.recording.rows import BATCH_ROWS, RowBlock, RowLayout
from legbench.signals import Command, Floats, Observation


@final
class MemoryRun:
    """Takes one row a cycle and gives a `Recording` in the end; nothing survives the process."""

    def __init__(self, manifest: Mapping[str, Any], *, name: str | None = None) -> None:
        """Begin a run now.

        Args:
            manifest: what ran on what, as `RunWriter.create` takes it.
            name: a hint in the run's name.

        Raises:
            ConfigError: the manifest names a key that is filled in here.
            FormatError: it declares signals that no run can have.
        """
        start = datetime.now(UTC)
        self._id = run_name(start, name)
        created = start.isoformat(timespec="seconds")
        self._manifest = new_manifest(manifest, id=self._id, created=created)
        self._layout = layout_of(self._manifest)
        self._block: RowBlock | None = None  # takes 25 KiB, and whole rows need none
        self._parts: list[Floats] = []
        self._events: list[Event] = []

    @property
    def rows(self) -> int:
        """Number of rows that were appended so far."""
        waiting = 0 if self._block is None else self._block.count
        return sum(part.shape[1] for part in self._parts) + waiting

    def append(
        self, command: Command, observation: Observation, cycle_us: float, late_us: float
    ) -> None:
        """Remember one cycle; raises ConfigError if the arrays are not those of one leg."""
        if self._block is None:
            self._block = RowBlock(RowLayout(self._layout))
        self._block.put(command, observation, cycle_us, late_us)
        if self._block.count == BATCH_ROWS:
            self._take(self._block)

    def extend(self, columns: Floats) -> None:
        """Remember whole rows (columns with time, rows), laid out as `RowBlock.columns` does."""
        self._parts.append(columns)

    def event(self, time: float, name: str, **detail: Any) -> None:
        """Remember that `name` happened at plant time `time` [s], with any detail."""
        self._events.append(plain({"time": time, "name": name, **detail}))

    def close(self, status: str = COMPLETE, cause: str | None = None) -> None:
        """Say how the run ended, as `RunWriter.close`."""
        self._manifest |= {"status": status, "cause": cause, "rows": self.rows}

    def recording(self) -> Recording:
        """Return the run as `load` would return it; its path is a name, no folder."""
        if self._block is not None and self._block.count:
            self._take(self._block)
        names = (TIME, *self._layout.names)
        values = np.concatenate([np.empty((len(names), 0)), *self._parts], axis=1)
        nanoseconds = np.rint(1e9 * values[0]).astype(np.int64)
        columns = {TIME: nanoseconds} | {
            column.name: _stored(column, row)
            for column, row in zip(self._layout.columns, values[1:], strict=True)
        }
        for column in columns.values():
            column.flags.writeable = False
        time = nanoseconds / 1e9
        duration = float(time[-1] - time[0]) if len(time) else 0.0
        path = Path(self._id)
        manifest = {**self._manifest, "duration": duration}
        return Recording(
            path=path,
            manifest=manifest,
            described=described(manifest, path),
            time=time,
            columns=MappingProxyType(columns),
            events=tuple(self._events),
        )

    def _take(self, block: RowBlock) -> None:
        self._parts.append(block.columns())
        block.count = 0


def _stored(column: Column, row: Floats) -> np.ndarray:
    """Return the values of a column (n,) as its file would keep them; an unknown contact is -1."""
    if not column.small:
        return row.copy()
    return np.where(np.isnan(row), -1.0, row).astype(np.int8)
