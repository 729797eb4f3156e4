"""Cells that a leg cannot do, found before anything runs, each with the nearest it could."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final

from legbench.campaign.data import Settings
from legbench.errors import ConfigError, LegbenchError
from legbench.experiment.data import Experiment
from legbench.experiment.start import start_of

REACH: Final = 64
"""Number of distances at which a feasible value is looked for, on either side."""
NEAREST, RATIO = 1e-4, 1.2
"""Smallest of these distances, as a share of the value or of 1, and ratio of one to the next: the
largest is 1e-4 * 1.2^63, some ten times the value."""
HALVINGS: Final = 20
"""Number of halvings by which the border is narrowed down."""
DIGITS: Final = 4
"""Number of decimals of the value that is told, on the feasible side."""
SET_POINTS: Final = ("controller.settings.dz2", "controller.settings.z2")
"""Settings that are tried where they are plain numbers, whether they vary or not."""

Build = Callable[[Settings], Experiment]


@dataclass(frozen=True, slots=True, kw_only=True)
class Infeasible:
    """Cell that the leg cannot do."""

    block: str
    settings: Settings
    reason: str
    """Reason, as the controller or the leg gives it."""
    nearest: Settings
    """Nearest feasible value by dotted key, each if that one alone is changed."""

    def __str__(self) -> str:
        """Return the cell, why, and the nearest that is feasible, on one line."""
        told = f"{self.block}: {self.reason}"
        if not self.nearest:
            return told
        ways = " or ".join(f"{key} = {value:g}" for key, value in self.nearest.items())
        return f"{told}; the nearest feasible is {ways}"


def why_infeasible(
    experiment: Experiment,
    settings: Settings,
    varied: Sequence[str],
    build: Build,
    block: str,
) -> Infeasible | None:
    """Reason why a leg cannot do a cell, with the nearest that it could; none if it can.

    Args:
        experiment: what the cell is.
        settings: settings of the cell.
        varied: dotted keys that the campaign varies; nothing near is looked for without any.
        build: makes the experiment of other settings; raises ConfigError.
        block: name of the block that it belongs to.
    """
    reason = _refusal(experiment)
    if reason is None:
        return None

    def feasible(key: str, value: float) -> bool:
        try:
            changed = build({**settings, key: value})
        except ConfigError:
            return False
        return _refusal(changed) is None

    nearest: dict[str, float] = {}
    for key in dict.fromkeys((*(SET_POINTS if varied else ()), *varied)):
        value = _plain(settings.get(key, _field(experiment, key)))
        if value is None:
            continue
        found = nearest_feasible(value, lambda each, key=key: feasible(key, each))
        if found is not None:
            nearest[key] = found
    return Infeasible(block=block, settings=settings, reason=reason, nearest=nearest)


def nearest_feasible(value: float, feasible: Callable[[float], bool]) -> float | None:
    """Feasible value that is nearest to one that is not, rounded to the feasible side; or none.

    Args:
        value: a value that is not feasible.
        feasible: whether another one is; taken to have one border on the way.
    """
    scale = max(abs(value), 1.0)
    before = 0.0
    for place in range(REACH):
        distance = scale * NEAREST * RATIO**place
        for sense in (-1.0, 1.0):
            if feasible(value + sense * distance):
                return _border(value, sense, before, distance, feasible)
        before = distance
    return None


def _border(
    value: float, sense: float, near: float, far: float, feasible: Callable[[float], bool]
) -> float:
    """The border between an infeasible and a feasible distance, told from the feasible side."""
    for _ in range(HALVINGS):
        middle = 0.5 * (near + far)
        if feasible(value + sense * middle):
            far = middle
        else:
            near = middle
    exact = value + sense * far
    for digits in (round(exact, DIGITS), round(exact + sense * 10.0**-DIGITS, DIGITS)):
        if feasible(digits):
            return digits
    return exact


def _field(experiment: Experiment, key: str) -> object:
    """Value at a dotted key of an experiment; none if there is none."""
    value: object = experiment
    for name in key.split("."):
        value = value if name == "settings" else getattr(value, name, None)
    return value


def _plain(value: object) -> float | None:
    """Return a number as a float; none for anything else."""
    if isinstance(value, int | float) and not isinstance(value, bool):
        return float(value)
    return None


def _refusal(experiment: Experiment) -> str | None:
    """Reason why an experiment cannot begin; none if it can."""
    try:
        start_of(experiment)
    except LegbenchError as error:
        return str(error)
    return None
