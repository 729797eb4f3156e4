"""Recordings of a campaign's runs, each a run folder that is named by its experiment's hash."""

from pathlib import Path
from typing import Final

from legbench.recording.reader import Recording
from legbench.recording.saved import save_recording

RECORDS: Final = "records"
"""Folder of the recordings in that of the campaign."""


def write_record(recording: Recording, folder: Path, experiment: str) -> None:
    """Write the recording of an experiment under its hash, whole or not at all.

    Raises:
        RecordingError: it cannot be written.
    """
    save_recording(recording, folder / experiment)
