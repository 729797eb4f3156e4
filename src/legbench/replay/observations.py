"""Observations of a recorded run, as its plant gave them to its controller."""

from collections.abc import Iterator

import numpy as np

from legbench.errors import RecordingError
from legbench.recording.answers import DRIVES
from legbench.recording.layout import TIME
from legbench.recording.reader import Recording
from legbench.signals import MEASURED, Floats, Observation, Truth


def require_every_row(recording: Recording) -> float:
    """Period of a run of one leg in which no row is missing, so that it can be replayed [s].

    Raises:
        RecordingError: it has no rows or no period, holds several legs, or lacks rows where its
            plant could leave none out.
    """
    run = recording.description
    if len(recording.time) == 0:
        raise RecordingError(f"{recording.path} has no rows: there is nothing to replay")
    if run.period is None or not run.period > 0.0:
        raise RecordingError(f"{recording.path} does not tell its period: it cannot be replayed")
    if run.layout.legs != 1:
        raise RecordingError(
            f"{recording.path} holds {run.layout.legs} legs; one leg can be replayed"
        )
    gaps = np.diff(recording.columns[TIME])
    # On drives a tick without SYNC leaves a gap; where most rows have one, rows were taken out.
    judged = np.median(gaps) if run.plant == DRIVES and len(gaps) else gaps.max(initial=0)
    if judged > 1.5e9 * run.period:
        longest = int(gaps.max())
        at = float(recording.time[int(gaps.argmax())])
        raise RecordingError(
            f"{recording.path} lacks rows after t = {at:g} s: {1e-9 * longest:g} s to the next "
            f"one, its period is {run.period:g} s; a replay needs every row"
        )
    return run.period


def exact_times(recording: Recording, period: float) -> Floats:
    """Times of the rows (n,) as the plant told them, to the last bit [s].

    Samples hold whole nanoseconds, but a plant counts cycles: cycle times period, and on drives
    what SYNC was late beside that. Nanoseconds divided by 1e9 differ from it in the last bit, by
    which a comparison with a time in a controller falls a row later.
    """
    cycles, beside_ns = np.divmod(recording.columns[TIME], round(1e9 * period))
    return cycles * period + 1e-9 * beside_ns


def observations(recording: Recording, times: Floats) -> Iterator[Observation]:
    """Observations row by row; the arrays are the rows' own and may be made read-only.

    Args:
        recording: a run of one leg.
        times: time of each row (n,), as from `exact_times` [s].
    """
    measured = {name: recording[name] for name in (*MEASURED, "joint_vel", "applied_pos")}
    truth = {name: recording[name] for name in _TRUTH} if recording.has_truth else None
    contact = recording["contact"]
    for row, time in enumerate(times.tolist()):
        told = None
        if truth is not None:
            values = {name: array[row] for name, array in truth.items()}
            told = Truth(contact=np.asarray(contact[row]), **values)
        yield Observation(
            time=time, truth=told, **{name: array[row] for name, array in measured.items()}
        )


_TRUTH = ("trunk_pos", "trunk_vel", "foot_pos", "contact_force", "energy", "loop_gap")
