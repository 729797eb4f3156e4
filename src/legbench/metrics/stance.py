"""Distinction of stance and flight in the rows of a hopping run."""

import numpy as np

from legbench.metrics.roles import FLIGHT, STANCE, UNKNOWN, states_by_controller
from legbench.metrics.rows import runs_of, without_short
from legbench.metrics.source import Recorded
from legbench.signals import Bools, Floats, Ints

MINIMUM_PHASE = 0.015
"""Shortest stance or flight [s]: contact chatters for a few milliseconds around both events, and
the shortest real phase of a leg this size lasts several times longer."""

LOOK_BACK = 0.005
"""How long before a contact the foot must have been higher to be on its way down [s]: longer than
the impact itself, much shorter than a flight."""


def loaded_by_contact(
    time: Floats,
    contact: Bools,
    foot_height: Floats,
    hip_height: Floats,
    minimum: float = MINIMUM_PHASE,
) -> Bools:
    """Whether the leg is in stance, row by row, from chattering contact (n,).

    Gaps shorter than `minimum` [s], and bounces however long, belong to the stance around them;
    then contacts shorter than that, and contacts that begin while the foot rises, belong to the
    flight around them.

    Args:
        time: times of the rows (n,) [s].
        contact: whether the foot touches the ground (n,).
        foot_height: height of the foot tip (n,) [m].
        hip_height: height of the hip (n,) [m].
        minimum: shortest stance or flight [s].
    """
    loaded = without_short(time, contact, value=False, minimum=minimum)
    loaded = without_bounces(loaded, hip_height)
    loaded = without_short(time, loaded, value=True, minimum=minimum)
    runs = runs_of(loaded)
    for first, stop, value in zip(runs.first[1:], runs.stop[1:], runs.value[1:], strict=True):
        before = min(int(np.searchsorted(time, time[first] - LOOK_BACK)), first - 1)
        if value and not foot_height[first] < foot_height[before]:
            loaded[first:stop] = False
    return loaded


def without_bounces(loaded: Bools, hip_height: Floats) -> Bools:
    """Contact (n,) with the gaps filled in which a leg that has touched down bounces.

    A leg lifts off after its lower apex, where the hip has turned upwards. A foot that leaves the
    ground and is back on it while the hip (n,) [m] has only fallen since it touched down has
    bounced: the leg has landed all the same, at the first of the two contacts.
    """
    runs = runs_of(loaded)
    filled = loaded.copy()
    falls = np.diff(hip_height) < 0.0
    for landed, left, back in zip(runs.first[1:-2], runs.first[2:-1], runs.first[3:], strict=True):
        if loaded[landed] and falls[landed : back - 1].all():
            filled[left:back] = True
    return filled


def states_of(run: Recorded) -> Ints:
    """STANCE, FLIGHT or UNKNOWN of every row (n,), from truth when there is any.

    A leg in a fixed setup does neither: all rows are UNKNOWN.
    """
    if not run.description.jumps:
        return np.full(len(run.time), UNKNOWN)
    if not run.has_truth:
        return states_by_controller(run)
    contact = np.asarray(run["contact"], dtype=bool)
    foot_height, hip_height = run["foot_pos"][:, 1], run["trunk_pos"][:, 1]
    loaded = loaded_by_contact(run.time, contact, foot_height, hip_height)
    return np.where(loaded, STANCE, FLIGHT)
