"""Writing a run: one row a cycle from the control loop, at a few microseconds a row."""

import shutil
import sys
from collections.abc import Mapping
from contextlib import ExitStack, suppress
from datetime import UTC, datetime
from pathlib import Path
from types import TracebackType
from typing import Any, Self, final

from legbench.errors import ConfigError, PlantFault, RecordingError
from legbench.interrupts import shielded
from legbench.recording.abstract_disk import AbstractDisk, AbstractLog
from legbench.recording.archive import write_archive
from legbench.recording.description import layout_of
from legbench.recording.disk import Disk
from legbench.recording.events import encode_event
from legbench.recording.files import append_to, lock
from legbench.recording.layout import (
    CLOSING,
    COMPLETE,
    EVENTS,
    FAULT,
    INTERRUPTED,
    STREAM,
    run_name,
)
from legbench.recording.manifest import Manifest, new_manifest, write_manifest
from legbench.recording.process_disk import ProcessDisk
from legbench.recording.rows import BATCH_ROWS, RowBlock, RowLayout
from legbench.recording.stream import WholeBatches, schema_for
from legbench.signals import Command, Observation
from legbench.writing import reason


@final
class RunWriter:
    """Writes one run folder; call it from one thread, close it or use it in a `with`.

    Rows go to the operating system in batches of 50, from the loop itself or, for a loop in real
    time, which must not wait for the disk, from a process of their own. A process that dies loses
    at most 50 rows (at 1 kHz: 50 ms), a power cut costs about one second.

    Attributes:
        path: the run folder.
    """

    def __init__(self, path: Path, manifest: Manifest, disk: AbstractDisk) -> None:
        """Join the parts; `create` is the way to make a run."""
        self.path = path
        self._manifest = manifest
        self._disk = disk
        self._block = RowBlock(RowLayout(layout_of(manifest)))
        self._handed = 0
        self._closed = False
        self._told = False

    @classmethod
    def create(
        cls,
        parent: Path,
        manifest: Mapping[str, Any],
        *,
        name: str | None = None,
        created: datetime | None = None,
        realtime: bool = False,
    ) -> Self:
        """Start a run in a fresh folder `<parent>/<UTC time>_<name>`, with -2, -3 if taken.

        Args:
            parent: folder of the runs, made if need be.
            manifest: what ran on what; `manifest.OWN_KEYS` are filled in here.
            name: a hint in the folder's name, such as the controller and the plant.
            created: the moment of the start, now by default.
            realtime: write from a process of its own, so that a loop in real time never waits
                for the disk; on Linux alone.

        Raises:
            RecordingError: the folder cannot be written.
            ConfigError: the manifest names a key that is filled in here.
        """
        start = (created or datetime.now(UTC)).astimezone(UTC)
        stem = run_name(start, name)
        full = new_manifest(manifest, id=stem, created=start.isoformat(timespec="seconds"))
        try:
            run = _fresh_folder(parent, stem)
            full["id"] = run.name
            return cls(run, full, _open(run, full, realtime=realtime))
        except OSError as error:
            raise RecordingError(
                f"cannot write a run in {parent}: {reason(error)};"
                " choose a folder that you can write to with --out"
            ) from error

    @property
    def rows(self) -> int:
        """Number of rows that were appended so far."""
        return self._handed + self._block.count

    def append(
        self, command: Command, observation: Observation, cycle_us: float, late_us: float
    ) -> None:
        """Remember one cycle of one leg: arrays of shape (2,), copied.

        Args:
            command: what the controller asked for, computed from `observation`.
            observation: what the plant showed.
            cycle_us: wall time that the cycle took [us].
            late_us: wall time past the cycle's deadline [us].

        Raises:
            RecordingError: the disk has failed or is a minute behind, or the run is closed.
            ConfigError: the arrays are not those of one leg.
        """
        if self._closed or self._disk.kept.error is not None:
            raise self._refusal()
        self._block.put(command, observation, cycle_us, late_us)
        if self._block.count == BATCH_ROWS:
            self._hand_over()
            if self._disk.lagging:
                raise self._refusal()

    def event(self, time: float, name: str, **detail: Any) -> None:
        """Remember that `name` happened at plant time `time` [s], with any detail.

        Raises:
            RecordingError: the run is closed.
        """
        if self._closed:
            raise self._refusal()
        self._disk.event(encode_event(time, name, detail))

    def log(self, name: str) -> AbstractLog:
        """Begin a log of lines beside the rows, such as raw frames, in the file `name`.

        Writing to it never waits: lines go the way of the rows, and with a process for them every
        line that was written is kept even if this process dies. Close it before the run.

        Raises:
            RecordingError: there can be no such file, or the run is closed.
        """
        if self._closed:
            raise self._refusal()
        try:
            return self._disk.log(append_to(self.path / name))
        except OSError as error:
            raise RecordingError(f"{self.path / name}: {reason(error)}") from error

    def close(self, status: str = COMPLETE, cause: str | None = None) -> None:
        """End the run: write what waits, make the archive, say in `run.json` how it ended.

        Whatever fails, the rows already on disk stay readable. A second call does nothing. No
        signal gets in between: a ^C that comes meanwhile is raised when the run is closed.

        Args:
            status: "complete", "interrupted" or "fault"; a run that lost rows is a fault.
            cause: a short name of why it ended, None if it came to its end.

        Raises:
            RecordingError: rows or events were lost or `run.json` was not updated, and no
                `append` has said so yet.
            ConfigError: the status is none of the three.
        """
        if self._closed:
            return
        if status not in CLOSING:
            raise ConfigError(f"a run cannot end as {status!r}; choose from {', '.join(CLOSING)}")
        with shielded():
            self._closed = True
            if self._block.count:
                self._hand_over()
            self._disk.finish()
            try:
                self._note_end(status, cause)
                problem = self._settle()
            finally:
                self._disk.close()
        if problem is not None and not self._told:
            raise RecordingError(problem)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        if error is None:
            self.close()
            return
        fault = _fault_in(error)
        if fault is not None:
            self.close(FAULT, fault.cause)
        elif isinstance(error, KeyboardInterrupt | GeneratorExit):
            # The second where a generator that writes a run is given up for an interruption.
            error.add_note(f"{self.path} holds {self.rows} rows")
            self.close(INTERRUPTED, type(error).__name__)
        else:
            self.close(FAULT, type(error).__name__)

    def _hand_over(self) -> None:
        self._handed += self._block.count
        self._disk.take(self._block)

    def _refusal(self) -> RecordingError:
        """Return why no row can be added; from then on the caller knows."""
        if self._closed:
            return RecordingError(f"{self.path} is closed; a new run needs a new RunWriter")
        self._told = True
        if self._disk.kept.error is not None:
            return RecordingError(self._loss(reason(self._disk.kept.error)))
        return RecordingError(self._loss("the disk is too slow, 60 s of rows wait for it"))

    def _loss(self, why: str) -> str:
        return (
            f"{self.path}: recording failed: {why}; {self._disk.kept.rows} rows are safe on disk;"
            f" make room, then `legbench recover {self.path}`, or record elsewhere with --out"
        )

    def _note_end(self, status: str, cause: str | None) -> None:
        kept = self._disk.kept
        lost = self._handed - kept.rows
        if kept.error is not None:
            status = FAULT if status == COMPLETE else status
            cause = cause or "recording"
            self._manifest |= {"recording_error": reason(kept.error), "rows_lost": lost}
        if kept.events_error is not None:
            self._manifest["events_error"] = reason(kept.events_error)
        self._manifest |= {"status": status, "cause": cause, "rows": kept.rows}
        self._manifest["duration"] = kept.last - kept.first

    def _settle(self) -> str | None:
        """Make the archive and update `run.json`; return what the caller must hear, if anything.

        The stream goes last, so at every moment one whole copy of the samples is there.
        """
        stream = self.path / STREAM
        archived = False
        try:
            batches = WholeBatches(stream)
            rows = write_archive(self.path, batches, self._manifest)
            archived = rows == self._disk.kept.rows
            if not archived:
                told = f"{rows} of {self._disk.kept.rows} rows could be read back"
                self._manifest["archive_error"] = f"{told}: {batches.tear}"
        except OSError as error:
            self._manifest["archive_error"] = reason(error)
        try:
            write_manifest(self.path, self._manifest)
            if archived:
                stream.unlink()
        except OSError as error:
            return self._loss(f"run.json was not updated: {reason(error)}")
        why = self._manifest.get("recording_error")
        if why is not None:
            return self._loss(why)
        if (why := self._manifest.get("events_error")) is not None:
            return (
                f"{self.path}: events were lost: {why}; its {self._disk.kept.rows} rows are whole"
            )
        return None


def _fault_in(error: BaseException) -> PlantFault | None:
    """The fault that ended a run, also where a ^C came while it was dealt with."""
    link: BaseException | None = error
    while link is not None and not isinstance(link, PlantFault):
        link = link.__context__
    return link


def _fresh_folder(parent: Path, stem: str) -> Path:
    """Make a folder that was not there before; raises OSError."""
    parent.mkdir(parents=True, exist_ok=True)
    attempt = 1
    while True:
        run = parent / (stem if attempt == 1 else f"{stem}-{attempt}")
        with suppress(FileExistsError):
            run.mkdir()
            return run
        attempt += 1


def _open(run: Path, manifest: Manifest, *, realtime: bool) -> AbstractDisk:
    """Create the files of `run`, locked, or remove the folder and raise OSError."""
    with ExitStack() as undo:
        undo.callback(shutil.rmtree, run, ignore_errors=True)
        samples = append_to(run / STREAM)
        undo.callback(samples.close)
        lock(samples.fd, run)
        events = append_to(run / EVENTS)
        undo.callback(events.close)
        write_manifest(run, manifest)
        kind = ProcessDisk if realtime and sys.platform == "linux" else Disk
        disk = kind(samples, events, schema_for(manifest))
        undo.pop_all()
    return disk
