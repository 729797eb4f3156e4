"""Which rows of a hopping run are stance and which are flight."""

import numpy as np

from legbench.design.setup import SetupKind
from legbench.metrics.rows import runs_of, without_short
from legbench.metrics.source import Recorded, terms_of
from legbench.signals import Bools, Floats, Ints, Phase

MINIMUM_PHASE = 0.015
"""Shortest stance or flight [s]: contact chatters for a few milliseconds around both events, and
the shortest real phase of a leg this size lasts several times longer."""

LOOK_BACK = 0.005
"""How long before a contact the foot must have been higher to be on its way down [s]: longer than
the impact itself, much shorter than a flight."""

FLIGHT, STANCE, UNKNOWN = 0, 1, -1


def loaded_by_contact(
    time: Floats, contact: Bools, foot_height: Floats, minimum: float = MINIMUM_PHASE
) -> Bools:
    """Whether the leg is in stance, row by row, from chattering contact (n,).

    Gaps shorter than `minimum` [s] belong to the stance around them; then contacts shorter than
    that, and contacts that begin while the foot rises, belong to the flight around them.
    """
    loaded = without_short(time, contact, value=False, minimum=minimum)
    loaded = without_short(time, loaded, value=True, minimum=minimum)
    runs = runs_of(loaded)
    for first, stop, value in zip(runs.first[1:], runs.stop[1:], runs.value[1:], strict=True):
        before = min(int(np.searchsorted(time, time[first] - LOOK_BACK)), first - 1)
        if value and not foot_height[first] < foot_height[before]:
            loaded[first:stop] = False
    return loaded


def states_by_controller(recording: Recorded) -> Ints:
    """STANCE, FLIGHT or UNKNOWN, row by row, from the jump controller's phases (n,).

    The controller calls a load ground once it has lasted for its `touchdown_time`, which the
    manifest tells; the stance began when the load did.
    """
    phase, time = recording["phase"], recording.time
    states = np.full(len(phase), UNKNOWN)
    states[np.isin(phase, [Phase.COMPRESS, Phase.PUSH])] = STANCE
    states[np.isin(phase, [Phase.FLIGHT, Phase.RELEASE])] = FLIGHT
    lasted = float(recording.manifest.get("controller", {}).get("touchdown_time", 0.0))
    told = np.flatnonzero((phase[1:] == Phase.COMPRESS) & (phase[:-1] == Phase.FLIGHT)) + 1
    for row, began in zip(told, np.searchsorted(time, time[told] - lasted), strict=True):
        states[began:row][phase[began:row] == Phase.FLIGHT] = STANCE
    return states


def states_of(recording: Recorded) -> Ints:
    """STANCE, FLIGHT or UNKNOWN of every row (n,), from truth when there is any.

    A leg in a fixed setup does neither: all rows are UNKNOWN.

    Raises:
        FormatError: a manifest without a leg or with an unknown setup.
    """
    if terms_of(recording.manifest).setup is not SetupKind.JUMP:
        return np.full(len(recording.time), UNKNOWN)
    if not recording.has_truth:
        return states_by_controller(recording)
    contact = np.asarray(recording["contact"], dtype=bool)
    loaded = loaded_by_contact(recording.time, contact, recording["foot_pos"][:, 1])
    return np.where(loaded, STANCE, FLIGHT)
