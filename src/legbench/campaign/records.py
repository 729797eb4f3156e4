"""Recordings of a campaign's runs, each a run folder that is named by its experiment's hash."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from types import MappingProxyType
from typing import Any, Final

import numpy as np

from legbench.recording.columns import PER_CYCLE
from legbench.recording.reader import Recording
from legbench.recording.saved import save_recording

RECORDS: Final = "records"
"""Folder of the recordings in that of the campaign."""


def write_record(
    recording: Recording, folder: Path, experiment: str, tables: Mapping[str, Any]
) -> None:
    """Write the recording of an experiment under its hash, whole or not at all.

    The wall times of cycles are left out, as zeros: in a batch they are those of all legs together.

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
    timeless = {name: np.zeros(len(recording.time)) for name in PER_CYCLE}
    columns = MappingProxyType({**recording.columns, **timeless})
    kept = replace(recording, manifest=manifest, columns=columns)
    save_recording(kept, folder / experiment)
