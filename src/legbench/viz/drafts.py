"""Files that appear whole or not at all, and runs that have something to draw."""

import numpy as np

from legbench.errors import RecordingError
from legbench.metrics.source import Recorded
from legbench.writing import draft_of

__all__ = ["draft_of", "require_rows"]


def require_rows(recording: Recorded) -> None:
    """Check that there is something to draw.

    Raises:
        RecordingError: the run ended before its first row, or knows no link angles.
    """
    if len(recording.time) == 0:
        raise RecordingError(f"{recording.path} has no rows: there is nothing to draw")
    if not np.isfinite(recording["joint_pos"]).any():
        raise RecordingError(
            f"{recording.path} knows no link angle in any row, as of drives with one encoder that "
            "send no torque: there is no leg to draw; its columns are in samples.parquet"
        )
