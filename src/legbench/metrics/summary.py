"""Summary of a run in numbers, which tables, reports and searches read."""

import math
from dataclasses import asdict, dataclass, field
from typing import Any

import numpy as np

from legbench.kinematics import polar_angle
from legbench.metrics.analysis import Analysis, analysed
from legbench.metrics.caveats import warnings_of
from legbench.metrics.energy import energy_residual, loop_gap_max
from legbench.metrics.limited import limited_commands
from legbench.metrics.soundness import judge_numerics
from legbench.metrics.source import Recorded
from legbench.strict_json import null_for_nan

SPARSE = 1.5
"""Time from row to row above which a run is thinned out, in periods of its own [-]."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Summary:
    """Figures of one run; NaN where the run, its setup or a missing truth does not show them.

    Lists of ratings hold every complete phase or period, in order. Those without a suffix are about
    `rating_reference`: what the run's conventions ask for, or else the equilibrium in a fixed
    setup and the motor in a jump. Those with one are about the motor and about the equilibrium.
    """

    run: str
    """Folder of the run."""
    setup: str
    controller: str
    status: str | None
    """Status with which the run ended."""
    cause: str | None
    """Cause of an early end; none if the run came to its end."""
    numerics: str
    """Verdict on the numerics of a simulated run, `sound`, `unsound` or `unknown`: whether energy
    residual and loop gap are within bounds. The warnings say which is not."""
    limited_cycles: int
    """Cycles in which the limits changed the command."""
    limited_max: list[float]
    """Largest change of each motor's command by the limits [rad]."""
    duration: float
    """Time from the first row to the last [s]."""
    real_time_factor: float
    """Ratio of the duration to the wall time of all cycles [-]."""
    rating_reference: str
    """Reference of the ratings that come first, `motor` or `equilibrium`."""
    rating_stance: list[float]
    """P^r of each complete stance, eq. (14) [-]."""
    rating_flight: list[float]
    """P^r of each complete flight [-]."""
    rating_periods: list[float]
    """P^r of each oscillation period in a fixed setup [-]."""
    rating_stance_motor: list[float]
    rating_flight_motor: list[float]
    rating_periods_motor: list[float]
    rating_stance_equilibrium: list[float]
    rating_flight_equilibrium: list[float]
    rating_periods_equilibrium: list[float]
    periods: list[float]
    """Length of each oscillation period in a fixed setup [s]."""
    jumps: int
    """Complete jumps: a flight between two complete stances."""
    first: int
    """Index of the first jump of the limit cycle (`JumpFigures.first`)."""
    trunk_excursion: float
    """[m]"""
    foot_clearance: float
    """[m]"""
    drift: float
    """[m]"""
    foot_travel: float
    """[m]"""
    foot_travel_in_hip: float
    """[m]"""
    hop_freq: float
    """[Hz]"""
    flight_time: float
    """[s]"""
    stance_time: float
    """[s]"""
    apex_change: float
    """[m]"""
    polar_max: float
    """Largest |x1|: over the limit cycle of a jump, from the first control action in a fixed
    setup [rad]."""
    loop_gap_max: float
    """[m]"""
    energy_residual: float
    """Unexplained energy outside contact over the peak kinetic energy [-]."""
    motor_work: float
    """Mean over the jumps of the limit cycle, as are the losses [J]."""
    damper_loss: float
    """[J]"""
    impact_loss: float
    """[J]"""
    stop_loss: float
    """[J]"""
    contact_loss: float
    """[J]"""
    other_loss: float
    """[J]"""

    warnings: list[str] = field(default_factory=list)
    """Sentences on what is not measured although one might expect it, and why."""

    def to_json(self) -> dict[str, Any]:
        """Fields by name for strict JSON: NaN is None, alone and in lists."""
        return null_for_nan(asdict(self))


def summarise(recording: Recorded) -> Summary:
    """Measure a run of any setup, whole, torn or empty.

    Raises:
        FormatError: the run describes no leg, or an unknown setup or convention.
    """
    run = analysed(recording)
    description, ratings = run.description, run.ratings
    chosen, motor, equilibrium = ratings.chosen, ratings.motor, ratings.equilibrium
    periods = [] if description.jumps else (run.periods.end - run.periods.start).tolist()
    energy, gap = _energy(run), loop_gap_max(run)
    verdict = judge_numerics(energy["energy_residual"] if _dense(run) else math.nan, gap)
    return Summary(
        run=str(run.path),
        setup=description.setup.kind.value,
        controller=description.controller,
        status=description.status,
        cause=description.cause,
        rating_reference=description.reference.value,
        rating_stance=chosen.stance,
        rating_flight=chosen.flight,
        rating_periods=chosen.periods,
        rating_stance_motor=motor.stance,
        rating_flight_motor=motor.flight,
        rating_periods_motor=motor.periods,
        rating_stance_equilibrium=equilibrium.stance,
        rating_flight_equilibrium=equilibrium.flight,
        rating_periods_equilibrium=equilibrium.periods,
        periods=periods,
        loop_gap_max=gap,
        numerics=verdict.soundness.value,
        warnings=[*warnings_of(run), *verdict.reasons],
        **limited_commands(run),
        **_clock(run),
        **_jumping(run),
        **energy,
    )


def _dense(run: Analysis) -> bool:
    """Whether the rows are those of every cycle; between sparser ones energy flows unseen."""
    period = run.description.period
    return len(run.time) > 1 and (
        period is None or float(np.median(np.diff(run.time))) < SPARSE * period
    )


def _clock(run: Analysis) -> dict[str, Any]:
    time, cycles = run.time, run["cycle_us"]
    duration = float(time[-1] - time[0]) if len(time) else math.nan
    wall = float(np.sum(cycles)) / 1e6
    return {"duration": duration, "real_time_factor": duration / wall if wall > 0.0 else math.nan}


def _jumping(run: Analysis) -> dict[str, Any]:
    values = asdict(run.jump_figures)
    values["jumps"] = values.pop("count")
    if not run.description.jumps:
        moved = polar_angle(run["joint_pos"][run.first_action :])
        values["polar_max"] = float(np.max(np.abs(moved))) if len(moved) else math.nan
    return values


def _energy(run: Analysis) -> dict[str, Any]:
    budget, first = run.budget, run.jump_figures.first
    means = {
        "motor_work": budget.motor_work[first:],
        "damper_loss": budget.damper_loss[first:],
        "impact_loss": budget.impact_loss[first:],
        "stop_loss": budget.stop_loss[first:],
        "contact_loss": budget.contact_loss[first:],
        "other_loss": budget.other_loss[first:],
    }
    values = {name: float(np.mean(each)) if len(each) else math.nan for name, each in means.items()}
    return {"energy_residual": energy_residual(run, run.flows), **values}
