"""Recordings of a campaign's runs, each a run folder that is named by its experiment's hash."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

from legbench.recording.reader import Recording
from legbench.recording.saved import save_recording

RECORDS: Final = "records"
"""Folder of the recordings in that of the campaign."""


def write_record(
    recording: Recording, folder: Path, experiment: str, tables: Mapping[str, Any]
) -> None:
    """Write the recording of an experiment under its hash, whole or not at all.

    Args:
        recording: what the run left.
        folder: where recordings are kept.
        experiment: hash of the experiment.
        tables: the experiment's tables, which say where its guests are found, as a run that is kept
            in memory does not.

    Raises:
        RecordingError: it cannot be written.
    """
    manifest = {**recording.manifest, "experiment": dict(tables)}
    save_recording(replace(recording, manifest=manifest), folder / experiment)
