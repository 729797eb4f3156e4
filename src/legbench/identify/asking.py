"""Task of identifying the leg of runs in folders: they are read, and must be of one leg."""

from collections.abc import Sequence
from pathlib import Path

from legbench.design import LegDesign
from legbench.errors import ConfigError
from legbench.identify.parameters import Freedom
from legbench.identify.staged import IdentificationTask
from legbench.identify.trial import FIXED, bars_of, trial_of
from legbench.recording.reader import Recording, load


def read_runs(paths: Sequence[Path | str]) -> list[Recording]:
    """Read recordings that may be learned from together.

    Raises:
        RecordingError: there is no such run, or it is damaged.
        ConfigError: there is none, one is given twice, or they are of different legs.
    """
    if not paths:
        raise ConfigError("no run to learn from; give one run folder or more")
    found = [load(path) for path in paths]
    folders = [recording.path.resolve() for recording in found]
    if twice := [str(path) for path in folders if folders.count(path) > 1]:
        raise ConfigError(f"{twice[0]} is given twice; every run counts once")
    first = found[0]
    for other in found[1:]:
        check_same_leg(first, other)
    return found


def check_same_leg(first: Recording, other: Recording) -> None:
    """Refuse two runs whose legs differ; raises ConfigError."""
    one, two = first.description, other.description
    if one.design != two.design:
        raise ConfigError(
            f"{first.path.name} is of leg '{one.design.name}' and {other.path.name} of "
            f"'{two.design.name}'{_differing(one.design, two.design)}; learn from runs of one leg"
        )
    if bars_of(first) != bars_of(other):
        raise ConfigError(
            f"{first.path.name} and {other.path.name} have different bars "
            f"(linkage {one.linkage or 'ideal'} and {two.linkage or 'ideal'}); learn from runs of "
            "one leg"
        )


def _differing(one: LegDesign, two: LegDesign) -> str:
    if one.name != two.name:
        return ""
    names = ("trunk_mass", "thigh", "shank", "foot", "stiffness", "damping", "limits")
    return f", which differs in {', '.join(n for n in names if getattr(one, n) != getattr(two, n))}"


def task_of(
    runs: Sequence[Recording],
    *,
    free: Freedom,
    design: LegDesign | None = None,
    held_out: Sequence[Recording] = (),
    mass: float | None = None,
    noise: float | None = None,
    starts: int = 3,
) -> IdentificationTask:
    """Make the task of identifying a leg from some runs.

    Args:
        runs: recordings in fixed setups, all of one leg.
        free: what is to be learned.
        design: leg to start from; none: the one that the runs name.
        held_out: runs that are predicted, not fitted; hops are left to `repeat`.
        mass: mass of the whole leg as weighed [kg].
        noise: standard deviation of the link encoders [rad]; none: it is measured.
        starts: number of starts of the fit.

    Raises:
        ConfigError: a run cannot be learned from.
    """
    for other in held_out:
        check_same_leg(runs[0], other)
    fixed = [each for each in held_out if each.description.setup.kind in FIXED]
    return IdentificationTask(
        design=design or runs[0].description.design,
        trials=tuple(trial_of(each, noise=noise) for each in runs),
        held_out=tuple(trial_of(each, noise=noise) for each in fixed),
        free=free,
        mass=mass,
        bars=bars_of(runs[0]),
        starts=starts,
    )
