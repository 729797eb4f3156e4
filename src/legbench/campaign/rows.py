"""Rows of a campaign's table that one run gives: itself, its periods, phases and jumps."""

import math
from collections.abc import Iterator, Mapping
from typing import Any, Final

import numpy as np

from legbench.design.setup import SUPPORTS
from legbench.kinematics import joint_to_modal, polar_angle
from legbench.metrics import Recorded, Reference, analysed, deflection, loop_gap_max
from legbench.metrics.analysis import Analysis
from legbench.metrics.phases import Intervals
from legbench.metrics.summary import Summary, summarise
from legbench.signals import Floats, Ints

KINDS: Final = ("run", "period", "stance", "flight", "jump")
"""Kinds of rows, in their order within a run."""
Row = Mapping[str, Any]
"""Value by column; a column that is not there is NaN."""


def measured_rows(recording: Recorded, experiment: str) -> list[Row]:
    """Rows of a run, in the order of the table.

    Args:
        recording: what the run left; one that a fault ended gives what it reached.
        experiment: hash of the experiment that was run.

    Raises:
        FormatError: the run describes no leg.
    """
    run = analysed(recording)
    summary = summarise(run)
    said = {
        "experiment": experiment,
        "status": summary.status,
        "cause": summary.cause,
        "numerics": summary.numerics,
        "energy_residual": summary.energy_residual,
        "loop_gap_max": loop_gap_max(run),
    }
    found = [_whole(run, summary)]
    if run.description.jumps:
        found += _phases("stance", run, run.gait.stance, run.ratings.motor.stance)
        found += _phases("flight", run, run.gait.flight, run.ratings.motor.flight)
        found += _jumps(run)
    else:
        found += _periods(run)
    return [said | dict(row) for row in found]


def _whole(run: Analysis, summary: Summary) -> Row:
    """The row of the run itself; figures of its jumps are means over the limit cycle."""
    limit_cycle = list(_jumps(run))[run.jump_figures.first :]
    names = ("foot_clearance", "trunk_excursion", "foot_travel", "apex")
    means = {name: _mean([jump[name] for jump in limit_cycle]) for name in names}
    return {
        "row": "run",
        "index": 0,
        "start": float(run.time[0]) if len(run.time) else math.nan,
        "length": summary.duration,
        "polar_max": summary.polar_max,
        "hop_freq": summary.hop_freq,
        # The paper tells the travel over three jumps together; a mean of single ones is another.
        "drift": summary.drift,
        **means,
    }


def _periods(run: Analysis) -> Iterator[Row]:
    periods, ratings = run.periods, run.ratings
    radial = np.abs(_radial_deflection(run, periods.first, periods.stop))
    at = 0
    for index in range(len(periods)):
        first, stop = int(periods.first[index]), int(periods.stop[index])
        own = radial[at : at + stop - first]
        at += stop - first
        yield {
            "row": "period",
            "index": index + 1,
            "start": float(periods.start[index]),
            "length": float(periods.end[index] - periods.start[index]),
            "rating": ratings.chosen.periods[index],
            "rating_motor": ratings.motor.periods[index],
            "rating_equilibrium": ratings.equilibrium.periods[index],
            "amplitude": _largest(own),
            "polar_max": _polar_max(run, first, stop),
        }


def _radial_deflection(run: Analysis, first: Ints, stop: Ints) -> Floats:
    """Deflection z2 - z2_d about the equilibrium over consecutive periods (rows,) [rad]."""
    described = run.description
    if len(first) == 0:
        return np.zeros(0)
    rows = slice(int(first[0]), int(stop[-1]))
    moved = deflection(
        described.design,
        run["joint_pos"][rows],
        run["motor_pos"][rows],
        SUPPORTS[described.setup.kind],
        Reference.EQUILIBRIUM,
    )
    return joint_to_modal(moved, described.convention)[:, 1]


def _phases(kind: str, run: Analysis, phases: Intervals, motor: list[float]) -> Iterator[Row]:
    ratings = run.ratings
    equilibrium = getattr(ratings.equilibrium, kind)
    chosen = getattr(ratings.chosen, kind)
    for index in range(len(phases)):
        yield {
            "row": kind,
            "index": index + 1,
            "start": float(phases.start[index]),
            "length": float(phases.duration[index]),
            "rating": chosen[index],
            "rating_motor": motor[index],
            "rating_equilibrium": equilibrium[index],
            "polar_max": _polar_max(run, int(phases.first[index]), int(phases.stop[index])),
        }


def _jumps(run: Analysis) -> Iterator[Row]:
    jumps, stance, flight = run.gait.jumps, run.gait.stance, run.gait.flight
    trunk, foot = run["trunk_pos"], run["foot_pos"]
    for index in range(len(jumps)):
        takeoff, flown, landing = (
            int(each[index]) for each in (jumps.takeoff, jumps.flight, jumps.landing)
        )
        air = slice(int(flight.first[flown]), int(flight.stop[flown]))
        low, high = np.searchsorted(run.time, [jumps.start[index], jumps.end[index]]).tolist()
        apex = float(flight.apex_height[flown])
        lowest = min(float(stance.apex_height[takeoff]), float(stance.apex_height[landing]))
        yield {
            "row": "jump",
            "index": index + 1,
            "start": float(jumps.start[index]),
            "length": float(jumps.end[index] - jumps.start[index]),
            "polar_max": _polar_max(run, low, high),
            "foot_clearance": _largest(foot[air, 1]),
            "trunk_excursion": apex - lowest,
            "drift": _range(trunk[low:high, 0]),
            "foot_travel": _range(foot[air, 0]),
            "apex": apex,
        }


def _polar_max(run: Analysis, first: int, stop: int) -> float:
    return _largest(np.abs(polar_angle(run["joint_pos"][first:stop])))


def _largest(values: Floats) -> float:
    return float(np.max(values)) if len(values) else math.nan


def _range(values: Floats) -> float:
    return float(np.ptp(values)) if len(values) else math.nan


def _mean(values: list[float]) -> float:
    return float(np.mean(values)) if values else math.nan
