"""Search for the first event of each lane on the dense output of a step.

All conditions are looked at in seven places of a step. One that may rise above zero and fall
back between two looks is followed to its largest value there.
"""

from collections.abc import Callable

import numpy as np
from reference.conditions import Conditions
from reference.dop853 import Dense
from reference.lanes import Lanes
from reference.roots import largest, rising_roots

from legbench.signals import Bools, Floats, Ints

SHARES = np.array([0.0, 0.02, 0.25, 0.5, 0.75, 0.98, 1.0])
"""Places of a step that are looked at, close to its ends too, where an extreme may hide [-]."""


def first_events(
    lanes: Lanes, inside: Dense, step: Floats, accepted: Bools
) -> tuple[Ints, Ints, Floats]:
    """First event of each lane that has one: lane, condition, and share of the step [-]."""
    times = lanes.time + SHARES[:, np.newaxis] * step
    seen = Conditions(lanes).at(inside.looks(SHARES), times)
    what, place, lane = np.nonzero((seen[:, 1:] > 0.0) & (seen[:, :-1] <= 0.0) & accepted)
    low, high = SHARES[place], SHARES[place + 1]
    more, other, began, top = _hidden(lanes, inside, step, seen, accepted)
    if more.size:
        what, lane = np.concatenate([what, other]), np.concatenate([lane, more])
        low, high = np.concatenate([low, began]), np.concatenate([high, top])
    if not lane.size:
        return lane, what, low
    share = rising_roots(_condition(lanes, inside, step, lane, what), low, high)
    order = np.lexsort((what, share, lane))
    first = order[np.unique(lane[order], return_index=True)[1]]
    return lane[first], what[first], share[first]


def _hidden(
    lanes: Lanes, inside: Dense, step: Floats, seen: Floats, accepted: Bools
) -> tuple[Ints, Ints, Floats, Floats]:
    """Events between looks that are all below zero: lane, condition, and a bracket of shares."""
    left, middle, right = seen[:, :-2], seen[:, 1:-1], seen[:, 2:]
    drop = middle - np.minimum(left, right)
    peak = (middle >= left) & (middle >= right) & (middle <= 0.0) & (middle + drop > 0.0)
    what, place, lane = np.nonzero(peak & accepted)
    began = SHARES[place]
    if not lane.size:
        return lane, what, began, began
    function = _condition(lanes, inside, step, lane, what)
    top, value = largest(function, began, SHARES[place + 2])
    comes = value > 0.0
    return lane[comes], what[comes], began[comes], top[comes]


def _condition(
    lanes: Lanes, inside: Dense, step: Floats, lane: Ints, what: Ints
) -> Callable[[Floats], Floats]:
    """One condition of each of some lanes, as a function of the share of the step."""
    some, part, step = lanes.take(lane), inside.take(lane), step[lane]
    conditions, every = Conditions(some, what), np.arange(lane.size)

    def at(share: Floats) -> Floats:
        return conditions.at(part.at(share), some.time + share * step)[what, every]

    return at
