"""Rows of a run on drives in which a drive had not answered: they repeat its last answer."""

from typing import Final

import numpy as np

from legbench.recording.reader import Recording
from legbench.signals import Bools, Floats

DRIVES: Final = "can"
"""Kind of plant whose observations are answers, and whose time is that of a clock: an answer may be
missing, and a tick without SYNC leaves a gap."""


def unanswered(recording: Recording) -> Bools:
    """Rows in which each drive had not answered (n, 2); none of a run that was not on drives.

    Its positions and its velocity are those of the row before then; of a fresh answer the low-pass
    of the velocity makes another number, unless the link stands.
    """
    found = np.zeros(recording["joint_pos"].shape, dtype=np.bool_)
    if recording.description.plant != DRIVES:
        return found
    velocity = recording["joint_vel"]
    same = np.abs(velocity[1:]) > 0.0
    for values in (velocity, recording["joint_pos"], recording["motor_pos"]):
        same &= values[1:] == values[:-1]
    found[1:] = same
    return found


def between_answers(values: Floats, missing: Bools) -> Floats:
    """Positions (n, 2) with those that were not told put on a line between their neighbours [rad].

    Args:
        values: positions (n, 2) [rad].
        missing: those that repeat the row before (n, 2).
    """
    found, rows = values.copy(), np.arange(len(values))
    for axis in range(values.shape[1]):
        told = ~missing[:, axis]
        if not told.all():
            found[:, axis] = np.interp(rows, rows[told], values[told, axis])
    return found
