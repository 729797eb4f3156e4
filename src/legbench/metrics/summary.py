"""One run in numbers: what tables, reports and searches read."""

import math
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from legbench.design.setup import SetupKind
from legbench.metrics.budget import energy_budget
from legbench.metrics.energy import energy_flows, energy_residual, loop_gap_max
from legbench.metrics.jump import JumpFigures, jump_figures
from legbench.metrics.limited import limited_commands
from legbench.metrics.periods import first_action
from legbench.metrics.phases import Gait, find_gait
from legbench.metrics.ratings import rate_run
from legbench.metrics.source import Recorded, Terms, terms_of


@dataclass(frozen=True, slots=True, kw_only=True)
class Summary:
    """Figures of one run; NaN where the run, its setup or a missing truth does not show them.

    Ratings hold every complete phase or period, in order; the lists without a suffix use the
    reference of the manifest's `conventions.rating_reference`, the motor unless it says
    otherwise.
    """

    run: str
    """Folder of the run."""
    setup: str
    controller: str
    status: str | None
    """How the run ended, as its manifest says."""
    cause: str | None
    """Why it ended early."""
    limited_cycles: int
    """Cycles in which the limits changed the command."""
    limited_max: list[float]
    """Largest change of each motor's command by the limits [rad]."""
    duration: float
    """First to last row [s]."""
    real_time_factor: float
    """Duration over the wall time of all cycles [-]."""
    rating_reference: str
    rating_stance: list[float]
    """P^r of each complete stance, eq. (14) [-]."""
    rating_flight: list[float]
    """Of each complete flight [-]."""
    rating_periods: list[float]
    """Of each oscillation period in a fixed setup [-]."""
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

    def to_json(self) -> dict[str, Any]:
        """Fields by name for strict JSON: NaN is None, alone and in lists."""
        return {name: _plain(value) for name, value in asdict(self).items()}


def _plain(value: Any) -> Any:
    if isinstance(value, list):
        return [_plain(entry) for entry in value]
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value


def summarise(recording: Recorded) -> Summary:
    """Measure a run of any setup, whole, torn or empty.

    Raises:
        FormatError: the manifest describes no leg, or an unknown setup or convention.
    """
    terms = terms_of(recording.manifest)
    gait = find_gait(recording)
    figures = jump_figures(recording, gait)
    return Summary(
        run=str(recording.path),
        setup=terms.setup.value,
        controller=terms.controller,
        status=recording.manifest.get("status"),
        cause=recording.manifest.get("cause"),
        rating_reference=terms.reference.value,
        loop_gap_max=loop_gap_max(recording),
        **limited_commands(recording),
        **_clock(recording),
        **rate_run(recording, terms, gait),
        **_jumping(recording, terms, figures),
        **_energy(recording, gait, figures.first),
    )


def _clock(recording: Recorded) -> dict[str, Any]:
    time, cycles = recording.time, recording["cycle_us"]
    duration = float(time[-1] - time[0]) if len(time) else math.nan
    wall = float(np.sum(cycles)) / 1e6
    return {"duration": duration, "real_time_factor": duration / wall if wall > 0.0 else math.nan}


def _jumping(recording: Recorded, terms: Terms, figures: JumpFigures) -> dict[str, Any]:
    values = asdict(figures)
    values["jumps"] = values.pop("count")
    if terms.setup is not SetupKind.JUMP:
        moved = recording["joint_pos"][first_action(recording) :].sum(axis=-1)
        values["polar_max"] = 0.5 * float(np.max(np.abs(moved))) if len(moved) else math.nan
    return values


def _energy(recording: Recorded, gait: Gait, first: int) -> dict[str, Any]:
    flows = energy_flows(recording)
    budget = energy_budget(recording, gait, flows)
    losses = ("motor_work", "damper_loss", "impact_loss", "stop_loss", "contact_loss", "other_loss")
    means = {name: getattr(budget, name)[first:] for name in losses}
    values = {name: float(np.mean(each)) if len(each) else math.nan for name, each in means.items()}
    return {"energy_residual": energy_residual(recording, flows), **values}
