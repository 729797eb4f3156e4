"""What the phase column of a run means for the leg, by the roles that its controller declared."""

import numpy as np

from legbench.metrics.source import Recorded
from legbench.phases import LARGEST_CODE, PhaseInfo, Role
from legbench.signals import Bools, Floats, Ints

FLIGHT, STANCE, UNKNOWN = 0, 1, -1
"""States of the foot, row by row."""

STATES = {Role.FLIGHT: FLIGHT, Role.STANCE: STANCE}
"""Role -> state of the foot; the other roles say nothing of it."""


def foot_states(phase: Ints, time: Floats, phases: tuple[PhaseInfo, ...]) -> Ints:
    """STANCE, FLIGHT or UNKNOWN, row by row, from the phases alone (n,).

    A phase that is told late began so much earlier: the rows of the phase before it, back to that
    instant, have its state already.

    Args:
        phase: phase of every row (n,).
        time: plant time of every row (n,) [s].
        phases: phases that the controller declared.
    """
    states = _by_code(phases)[_codes(phase)]
    for info in phases:
        if info.late > 0.0:
            told = np.flatnonzero((phase[1:] == info.code) & (phase[:-1] != info.code)) + 1
            began = np.searchsorted(time, time[told] - info.late)
            for row, first in zip(told.tolist(), began.tolist(), strict=True):
                earlier = states[first:row]
                earlier[phase[first:row] == phase[row - 1]] = states[row]
    return states


def states_by_controller(run: Recorded) -> Ints:
    """STANCE, FLIGHT or UNKNOWN, row by row, from the phases of a run's controller (n,)."""
    return foot_states(run["phase"], run.time, run.description.phases)


def resting(phase: Ints, phases: tuple[PhaseInfo, ...]) -> Bools:
    """Whether the rest posture is held, row by row (n,); a phase that was not declared acts."""
    rests = np.zeros(LARGEST_CODE + 2, dtype=np.bool_)
    rests[[info.code for info in phases if info.role is Role.REST]] = True
    return rests[_codes(phase)]


def first_action(run: Recorded) -> int:
    """Row of the first control action of a run, its number of rows when there is none.

    It is the first row whose phase is no rest. A controller that never says more than that it
    rests acts where its command first leaves that of the first row.
    """
    acting = np.flatnonzero(~resting(run["phase"], run.description.phases))
    if len(acting) == 0 and len(run.time):
        command = run["command_pos"]
        acting = np.flatnonzero(np.any(command != command[0], axis=-1))
    return int(acting[0]) if len(acting) else len(run.time)


def _by_code(phases: tuple[PhaseInfo, ...]) -> Ints:
    """State of the foot by the code of the phase."""
    table = np.full(LARGEST_CODE + 2, UNKNOWN)
    for info in phases:
        table[info.code] = STATES.get(info.role, UNKNOWN)
    return table


def _codes(phase: Ints) -> Ints:
    """Codes with those that no phase can have moved to a place of their own."""
    return np.where((phase >= 0) & (phase <= LARGEST_CODE), phase, LARGEST_CODE + 1)
