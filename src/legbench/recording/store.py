"""The files that a run grows by, synced once a second: rows, lines of events, and logs."""

import time
from typing import Final, final

import numpy as np
import pyarrow as pa

from legbench.recording.abstract_disk import Kept
from legbench.recording.files import Appender
from legbench.recording.log_file import LogFile
from legbench.recording.rows import BATCH_ROWS
from legbench.recording.stream import END_MARK, BatchEncoder
from legbench.signals import Floats

SYNC_EVERY: Final = 1.0
"""How much of a run a power cut may cost [s]."""


@final
class RunStore:
    """Appends to the samples and events of a run; used by one thread of one process alone.

    Attributes:
        kept: what has been written, and what has failed.
    """

    def __init__(self, samples: Appender, events: Appender, schema: pa.Schema) -> None:
        """Prepare for rows of `schema_for`; the opening of the stream has been written."""
        self.kept = Kept()
        self._samples, self._events, self._schema = samples, events, schema
        self._logs: list[LogFile] = []
        self._synced = time.monotonic()
        # The first call is slow: not while rows wait.
        nothing = np.zeros((len(schema), BATCH_ROWS))
        self._encoder = BatchEncoder(nothing, schema)
        self._encoder.encode(nothing)

    def write(self, columns: Floats) -> None:
        """Append a batch, unless one has failed.

        Args:
            columns: one row for each column of the schema, time first [s].
        """
        if self.kept.error is not None:
            return
        try:
            if not self._encoder.fits(columns):
                self._encoder = BatchEncoder(columns, self._schema)
            self._samples.append(self._encoder.encode(columns))
        except (OSError, pa.ArrowException) as error:
            self.kept.error = error
            return
        if self.kept.rows == 0:
            self.kept.first = float(columns[0, 0])
        self.kept.last = float(columns[0, -1])
        self.kept.rows += columns.shape[1]
        self._sync(every=SYNC_EVERY)

    def event(self, line: bytes) -> None:
        """Append one whole line to the events."""
        try:
            self._events.append(line)
        except OSError as error:
            self.kept.events_error = self.kept.events_error or error
        self._sync(every=SYNC_EVERY)

    def log(self, file: Appender) -> LogFile:
        """Begin a log in a file, which is synced with the others from now on."""
        log = LogFile(file)
        self._logs.append(log)
        return log

    def finish(self, *, end: bool = True) -> None:
        """Write the end mark, unless the run was cut off, and wait for the disk."""
        try:
            if end and self.kept.error is None:
                self._samples.append(END_MARK)
        except OSError as error:
            self.kept.error = error
        self._sync(every=0.0)

    def _sync(self, *, every: float) -> None:
        now = time.monotonic()
        if now - self._synced < every:
            return
        self._synced = now
        try:
            self._samples.sync()
        except OSError as error:
            self.kept.error = self.kept.error or error
        try:
            self._events.sync()
        except OSError as error:
            self.kept.events_error = self.kept.events_error or error
        for log in self._logs:
            log.sync()
