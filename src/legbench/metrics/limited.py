"""How much of what a controller asked for the limits let through, from a recording alone."""

from typing import Any

import numpy as np

from legbench.metrics.source import Recorded


def limited_commands(recording: Recorded) -> dict[str, Any]:
    """Compare every wish with the command that went to the servo, which is in the next row.

    Returns:
        `limited_cycles`, how many wishes were changed, and `limited_max`, the largest change of
        each motor [rad]; nothing is changed in a run that only looks, which commands nothing.
    """
    wishes, applied = recording["command_pos"][:-1], recording["applied_pos"][1:]
    looks = recording.description.looks_only
    if looks or not len(wishes):
        return {"limited_cycles": 0, "limited_max": [0.0, 0.0]}
    limited, largest = np.zeros(len(wishes), dtype=np.bool_), []
    for wish, let_through in zip(wishes.T, applied.T, strict=True):
        change = np.abs(wish - let_through)
        limited |= change > 0.0
        largest.append(float(np.max(change)))
    return {"limited_cycles": int(np.count_nonzero(limited)), "limited_max": largest}
