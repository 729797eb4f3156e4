"""One recorded run as a fit uses it: what was measured, when, in which setup, how exactly."""

from dataclasses import dataclass, field, replace
from typing import Final

import numpy as np

from legbench.analytic.terms import Bars
from legbench.design.setup import SetupKind
from legbench.errors import ConfigError
from legbench.identify.noise import Precision, precision_of
from legbench.mjcf.fitting import fitted_bar_density
from legbench.recording.answers import between_answers, unanswered
from legbench.recording.description import BARS, RunDescription
from legbench.recording.reader import Recording
from legbench.signals import Floats, Ints

FIXED: Final = (SetupKind.HFTS, SetupKind.VFTS, SetupKind.FFS)
"""Setups without touchdown and lift-off, which a fit can follow."""
FEWEST_ROWS: Final = 50
"""Fewest rows of a run from which anything can be learned [-]."""
LEAST_MOTION: Final = 0.02
"""Smallest range of the link angles of a run that moves [rad]."""
FIRST_ROWS: Final = 15
"""Rows through which the first posture and rates of a moving leg are guessed [-]."""
STILL_RATE: Final = 0.05
"""Rate up to which a leg counts as being at rest [rad/s]: one that was let go 2 mrad beside its
rest posture is no faster."""
SETTLED_ROWS: Final = 50
"""Rows for which a command has to stand still before the motors' noise is averaged [-]."""


@dataclass(frozen=True, slots=True, kw_only=True)
class FitTrial:
    """Run as a fit uses it: motors and links in the same rows, measured or planned."""

    name: str
    """Name of the run."""
    setup: SetupKind
    time: Floats
    """Times of the rows (n,) [s]."""
    motor_pos: Floats
    """Motor positions (n, 2) [rad]; row k + 1 held from time k to time k + 1."""
    joint_pos: Floats
    """Link angles (n, 2) [rad]."""
    applied_pos: Floats
    """Commands that reached the servo (n, 2) [rad]."""
    period: float
    """Control period that the run says it had [s]."""
    links: tuple[Precision, Precision]
    """Precision of the link encoders."""
    motors: tuple[Precision, Precision]
    """Precision of the motor encoders."""

    moving: bool = False
    """Whether the leg moves in the first row already."""
    left_out: Ints = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    """Rows (m,) that say nothing of the links, because a drive had not answered [-]."""

    @property
    def sigma(self) -> Floats:
        """Standard deviation of both link encoders (2,) [rad]."""
        return np.array([each.sigma for each in self.links])

    @property
    def first_state(self) -> Floats:
        """Angles and rates in the first row (4,), by a parabola through the first rows."""
        rows = min(FIRST_ROWS, len(self.time))
        parabola = np.polynomial.polynomial.polyfit(
            self.time[:rows] - self.time[0], self.joint_pos[:rows], 2
        )
        return np.concatenate([parabola[0], parabola[1]])

    def with_links(self, joint_pos: Floats) -> "FitTrial":
        """Return this trial with other link angles (n, 2), as if wired otherwise."""
        return replace(self, joint_pos=joint_pos)


def trial_of(recording: Recording, *, noise: float | None = None) -> FitTrial:
    """Take from a recording what a fit needs.

    Args:
        recording: a run in a fixed setup.
        noise: standard deviation of the link encoders [rad]; none: it is measured.

    Raises:
        ConfigError: the run hops, is on a boom, is too short, or does not move.
        FormatError: the run describes no leg.
    """
    run, name = recording.description, recording.path.name
    _check_setup(run, name)
    time, joint_pos = recording.time, recording["joint_pos"]
    if len(time) < FEWEST_ROWS:
        raise ConfigError(f"{name} has {len(time)} rows; to learn from it takes {FEWEST_ROWS}")
    motor_pos, applied_pos = recording["motor_pos"], recording["applied_pos"]
    for signal, values in (("joint_pos", joint_pos), ("motor_pos", motor_pos)):
        if not np.all(np.isfinite(values)):
            raise ConfigError(
                f"{name} lacks {signal} in {int(np.sum(~np.isfinite(values).all(axis=1)))} rows; "
                "a fit needs the encoders of both sides of each spring"
            )
    if np.ptp(joint_pos, axis=0).max() < LEAST_MOTION:
        raise ConfigError(
            f"{name} does not move: its link angles span "
            f"{np.ptp(joint_pos, axis=0).max():.2g} rad, less than {LEAST_MOTION:g} rad; "
            "take a step or a chirp"
        )
    links = tuple(precision_of(joint_pos[:, joint], noise) for joint in (0, 1))
    # Two postures of a motor do not show its count; encoders of both sides are mostly alike.
    motors = tuple(
        precision_of(motor_pos[:, joint]).counting(links[joint].count) for joint in (0, 1)
    )
    # A drive that has not answered repeats itself: what it says is no reading of that row.
    missing = unanswered(recording)
    motor_pos, joint_pos = (between_answers(each, missing) for each in (motor_pos, joint_pos))
    return FitTrial(
        name=name,
        setup=run.setup.kind,
        time=time,
        motor_pos=quietened(motor_pos, applied_pos, np.array([each.sigma for each in motors])),
        joint_pos=joint_pos,
        applied_pos=applied_pos,
        period=run.period or float(np.median(np.diff(time))),
        links=(links[0], links[1]),
        motors=(motors[0], motors[1]),
        moving=begins_in_motion(time, joint_pos, np.array([each.sigma for each in links])),
        left_out=np.flatnonzero(missing.any(axis=1)).astype(np.int64),
    )


def begins_in_motion(time: Floats, joint_pos: Floats, sigma: Floats) -> bool:
    """Whether link angles (n, 2) drift from the first rows on [rad].

    A line through the first rows has a slope; a leg at rest has one of the noise alone.
    """
    rows = slice(0, SETTLED_ROWS // 2)
    centred = time[rows] - time[rows].mean()
    slope = centred @ joint_pos[rows] / (centred @ centred)
    doubt = sigma / np.sqrt(centred @ centred)
    return bool(np.any(np.abs(slope) > STILL_RATE + 6.0 * doubt))


def _check_setup(run: RunDescription, name: str) -> None:
    if run.setup.kind not in FIXED:
        raise ConfigError(
            f"{name} is in setup '{run.setup.kind}', where the foot lifts off; learn from runs in "
            f"{', '.join(FIXED)}, and give a hop as --held-out"
        )
    if run.setup.boom_radius is not None:
        raise ConfigError(
            f"{name} is on a boom of {run.setup.boom_radius:g} m, which the equations of a fit do "
            "not know; learn from runs without one"
        )


def bars_of(recording: Recording) -> Bars | None:
    """Bars of the leg that a run says it had, with their mass; none: they weigh nothing.

    Raises:
        FormatError: the run describes no leg.
    """
    run = recording.description
    if run.linkage != BARS or run.crank_length is None:
        return None
    table = run.experiment.get("linkage", {})
    density = table.get("bar_density") if isinstance(table, dict) else None
    return Bars(
        density=fitted_bar_density(run.design) if density is None else float(density),
        crank_length=run.crank_length,
    )


def quietened(motor_pos: Floats, applied_pos: Floats, sigma: Floats) -> Floats:
    """Motor positions with the noise averaged out wherever their command has stood still.

    A motor that has settled does not move; what its encoder then shows is noise about one place,
    which is their mean. Motors that still follow stay as measured.

    Args:
        motor_pos: measured (n, 2) [rad].
        applied_pos: commands (n, 2) [rad].
        sigma: standard deviation of the encoders (2,) [rad].
    """
    found = motor_pos.copy()
    for joint in (0, 1):
        command, measured = applied_pos[:, joint], motor_pos[:, joint]
        edges = np.flatnonzero(np.diff(command)) + 1
        for begin, end in zip([0, *edges], [*edges, len(command)], strict=True):
            if end - begin < SETTLED_ROWS:
                continue
            late = measured[(begin + end) // 2 : end]
            away = np.abs(measured[begin:end] - late.mean()) > 6.0 * sigma[joint]
            # As long again as it took to come near, for the tail that noise hides.
            settled = begin + (2 * (int(np.flatnonzero(away)[-1]) + 1) if away.any() else 0)
            if end - settled >= SETTLED_ROWS:
                found[settled:end, joint] = measured[settled:end].mean()
    return found
