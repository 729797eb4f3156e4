"""Files that appear whole or not at all."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np

from legbench.errors import RecordingError
from legbench.metrics.source import Recorded
from legbench.writing import put_in_place, reason


@contextmanager
def draft_of(path: Path) -> Iterator[Path]:
    """Yield a draft file with `path`'s suffix, which replaces `path` if no exception is raised.

    The folder is made if need be.

    Raises:
        RecordingError: nothing can be written there.
    """
    draft = path.with_name(f".{path.stem}.draft{path.suffix}")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        # The draft is made anew: whatever lies there, such as a link, is not written through.
        draft.unlink(missing_ok=True)
        draft.touch(exist_ok=False)
    except OSError as error:
        raise RecordingError(f"cannot write {path}: {reason(error)}") from error
    try:
        yield draft
        put_in_place(draft, path)
    except RecordingError:
        raise
    except OSError as error:
        raise RecordingError(f"cannot write {path}: {reason(error)}") from error
    finally:
        draft.unlink(missing_ok=True)


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
