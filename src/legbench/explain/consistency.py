"""Consistency of a fit with what else was measured on the same leg: other setups, and the jump.

Every check is one statement of section VI. A statement that says nothing of a setting, such as the
order of the setups, is tried at the target's own.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from legbench.control import BangBangConfig
from legbench.control.bang_bang import RATED_PERIODS
from legbench.design import LegDesign
from legbench.design.setup import Setup, SetupKind
from legbench.experiment import Experiment
from legbench.explain.engine import NOBODY, Watch, rate_many
from legbench.explain.jumping import PredictedHop
from legbench.explain.targets import READING, Target, step_experiment
from legbench.imperfections import Imperfections
from legbench.paper import Published
from legbench.signals import Floats, Ints

DURATIONS = {SetupKind.FFS: 8.0, SetupKind.HFTS: 2.5, SetupKind.VFTS: 2.5}
"""Setup -> time of bang-bang [s]: eight seconds as in the paper where there are fewer periods than
are rated, and as many as show a saturated rating where there are more."""


@dataclass(frozen=True, slots=True, kw_only=True)
class StatementCheck:
    """One statement of the paper, tried on one leg."""

    name: str
    words: str
    """Statement in words."""
    value: float
    """Number that decides, as the words say it [-]; NaN if the leg does not come to it."""
    held: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class Predicted:
    """Ratings of n legs in everything that is checked; each row belongs to one leg."""

    bang_bang: Floats
    """Mean P^r after the transient of bang-bang with the foot fixed (n,) [-]."""
    steps: dict[SetupKind, Floats]
    """Setup -> ratings of the same step (n, p), NaN where the paper would not count [-]."""
    folded: dict[SetupKind, tuple[Floats, Floats]]
    """Setup with fixed trunk -> mean P^r of bang-bang at the set point that the paper finds lower,
    and at the usual one, each (n,) [-]."""


def predict(
    design: LegDesign,
    target: Target,
    numbers: Mapping[str, Published],
    legs: Sequence[Imperfections],
    watch: Watch = NOBODY,
) -> Predicted:
    """Rate legs in everything that is checked beside the target itself."""
    middle, amplitude = (numbers[key].value for key in ("bang_bang_middle", "bang_bang_amplitude"))
    lower = numbers["lower_rated_set_point"].value
    transient = round(numbers["bang_bang_transient"].value)

    def level(setup: SetupKind, z2: float) -> Floats:
        experiment = bang_bang_experiment(design, setup, z2, amplitude)
        shapes = rate_many(experiment, legs, periods=RATED_PERIODS, watch=watch)
        return settled(shapes.equilibrium, transient)

    steps = {}
    for setup in (SetupKind.HFTS, SetupKind.VFTS, SetupKind.FFS):
        experiment = step_experiment(design, setup, target.z2, target.dz2)
        shapes = rate_many(experiment, legs, periods=len(target.shape), watch=watch)
        steps[setup] = only_counted(shapes.equilibrium, shapes.counted)
    return Predicted(
        bang_bang=level(SetupKind.FFS, middle),
        steps=steps,
        folded={
            setup: (level(setup, lower), level(setup, middle))
            for setup in (SetupKind.HFTS, SetupKind.VFTS)
        },
    )


def count_predictions(legs: int) -> int:
    """Number of legs that `predict` rates for so many [-]."""
    return 8 * legs


def bang_bang_experiment(design: LegDesign, setup: SetupKind, z2: float, dz2: float) -> Experiment:
    """Bang-bang between z2 + dz2 and z2 - dz2 in a fixed setup."""
    return Experiment(
        design=design,
        controller=BangBangConfig(z2=z2, dz2=dz2, threshold=THRESHOLD * dz2),
        setup=Setup(kind=setup),
        duration=DURATIONS[setup],
    )


THRESHOLD = 0.65
"""Threshold of bang-bang over its amplitude [N m/rad], a quarter of the springs' stiffness: the
ratio of the controller's own defaults."""


def settled(ratings: Floats, transient: int) -> Floats:
    """Mean (n,) of ratings (n, p) after a transient of so many periods; NaN without any."""
    late = ratings[:, transient:]
    count = np.isfinite(late).sum(axis=1)
    return np.where(count > 0, np.nansum(late, axis=1) / np.maximum(count, 1), np.nan)


def only_counted(ratings: Floats, counted: Ints) -> Floats:
    """Ratings (n, p) of the periods that the paper would count; NaN for the others."""
    return np.where(np.arange(ratings.shape[1]) < counted[:, np.newaxis], ratings, np.nan)


def checks_of(
    predicted: Predicted, leg: int, hop: PredictedHop | None, numbers: Mapping[str, Published]
) -> tuple[StatementCheck, ...]:
    """Statements of the paper on one of the legs; without a hop, none on the jump."""
    level, wanted = float(predicted.bang_bang[leg]), numbers["bang_bang_rating"].value
    found = [
        StatementCheck(
            name="bang-bang",
            words=f"ffs, bang-bang settles at {wanted:.2f}",
            value=level,
            held=abs(level - wanted) <= READING,
        ),
        _order(predicted, leg, SetupKind.HFTS, SetupKind.FFS),
        _order(predicted, leg, SetupKind.VFTS, SetupKind.FFS),
        _order(predicted, leg, SetupKind.VFTS, SetupKind.HFTS),
        *(_decline(predicted, leg, setup) for setup in (SetupKind.HFTS, SetupKind.VFTS)),
    ]
    z2 = numbers["lower_rated_set_point"].value
    for setup, (lower, usual) in predicted.folded.items():
        fall = float(usual[leg] - lower[leg])
        found.append(
            StatementCheck(
                name=f"{setup}-folded",
                words=f"{setup}, bang-bang falls at z2 = {z2:g} by",
                value=fall,
                held=fall > READING,
            )
        )
    if hop is not None:
        found += [
            _lowest("stance", hop.stance, numbers),
            _lowest("flight", hop.flight, numbers),
        ]
    return tuple(found)


def _order(predicted: Predicted, leg: int, high: SetupKind, low: SetupKind) -> StatementCheck:
    """Order of two setups in the last period that the paper would count in both."""
    rows = [predicted.steps[setup][leg] for setup in (high, low)]
    common = np.flatnonzero(np.isfinite(rows[0]) & np.isfinite(rows[1]))
    value = float(rows[0][common[-1]] - rows[1][common[-1]]) if len(common) else float("nan")
    return StatementCheck(
        name=f"{high}-over-{low}",
        words=f"step, {high} is rated over {low} by",
        value=value,
        held=value > 0.0,
    )


def _decline(predicted: Predicted, leg: int, setup: SetupKind) -> StatementCheck:
    """Fall of the rating from the first to the last period that the paper would count."""
    rating = predicted.steps[setup][leg]
    known = rating[np.isfinite(rating)]
    value = float(known[0] - known[-1]) if len(known) > 1 else float("nan")
    return StatementCheck(
        name=f"{setup}-declines",
        words=f"step, {setup} declines, by",
        value=value,
        held=value > READING,
    )


def _lowest(phase: str, value: float, numbers: Mapping[str, Published]) -> StatementCheck:
    """Bound of the ratings of a phase of the jump, which holds whatever height it reaches."""
    least = numbers[f"jump_rating_{phase}"].value
    return StatementCheck(
        name=f"jump-{phase}",
        words=f"jump, every {phase} is rated over {least:.2f}",
        value=value,
        held=value > least,
    )
