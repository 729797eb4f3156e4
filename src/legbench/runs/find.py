"""Run folders below a folder, and the stamps by which a changed one is told from a known one."""

import os
from pathlib import Path
from typing import Final

from legbench.errors import RecordingError
from legbench.recording.layout import ARCHIVE, EVENTS, RUN, STREAM
from legbench.writing import reason

FILES: Final = (RUN, ARCHIVE, STREAM)
"""Files of which a run folder has at least one."""
STAMPED: Final = (*FILES, EVENTS)
"""Files whose change changes what is known of a run."""

Stamp = list[int]
"""Time of change [ns] and size [bytes] of each stamped file, -1 for one that is not there."""


def find_runs(directory: Path) -> dict[str, Stamp]:
    """Stamps of all runs below a folder, by their paths within it, in the order of these.

    Folders inside a run folder are not looked into, symbolic links not followed. What may not be
    read is left out, but for the folder itself.

    Raises:
        RecordingError: there is no such folder, or it cannot be read.
    """
    try:
        os.listdir(directory)
    except OSError as error:
        raise RecordingError(f"cannot list runs in {directory}: {reason(error)}") from None
    found: dict[str, Stamp] = {}
    for folder, below, files in os.walk(directory):
        if any(name in files for name in FILES):
            found[os.path.relpath(folder, directory)] = _stamp(folder, set(files))
            below.clear()
    return dict(sorted(found.items()))


def _stamp(folder: str, files: set[str]) -> Stamp:
    stamp: Stamp = []
    for name in STAMPED:
        told = (-1, -1)
        if name in files:
            try:
                status = os.stat(os.path.join(folder, name))
                told = (status.st_mtime_ns, status.st_size)
            except OSError:
                told = (-1, -1)  # gone since: the run has been closed or removed
        stamp += told
    return stamp
