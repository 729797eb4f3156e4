"""Colouring of a run's rows in a figure: by period, or by stance and flight."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from itertools import pairwise

import numpy as np

from legbench.metrics.analysis import Analysis, analysed
from legbench.metrics.rating_text import shown
from legbench.metrics.roles import STANCE
from legbench.metrics.run_ratings import RatingLists, RunRatings
from legbench.metrics.source import Recorded, Reference
from legbench.signals import Floats
from legbench.viz import style

LAST_JUMPS = 3
"""Jumps in full colour, as in Fig. 6; earlier ones are drawn faintly."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ColouredRows:
    """Rows [first, stop) in one colour."""

    first: int
    stop: int
    colour: tuple[float, float, float]


@dataclass(frozen=True, slots=True, kw_only=True)
class Colouring:
    """Colours of a figure's lines, and their meaning."""

    stretches: tuple[ColouredRows, ...]
    """Highlighted rows in order."""
    periods: int = 0
    """Number of periods that the colours count; zero for stance and flight."""
    ratings: str = ""
    """Ratings P^r in words."""


def colouring_of(recording: Recorded) -> Colouring:
    """Colour a jump's last jumps by stance and flight, any other run by period."""
    run = analysed(recording)
    ratings, jumps = run.ratings, run.gait.jumps
    if len(jumps):
        begin, end = jumps.start[-LAST_JUMPS:][0], jumps.end[-1]
        first, stop = np.searchsorted(run.time, [begin, end])
        return Colouring(
            stretches=_by_stance(run, int(first), int(stop)),
            ratings=_both(ratings, partial(_jump_ratings, len(jumps))),
        )
    periods = run.periods
    count = len(periods)
    colours = style.viridis(np.linspace(0.0, 0.95, max(count, 2)))[:count] / 255.0
    return Colouring(
        stretches=tuple(
            ColouredRows(first=int(first), stop=int(stop), colour=(r, g, b))
            for first, stop, (r, g, b) in zip(
                periods.first, periods.stop, colours.tolist(), strict=True
            )
        ),
        periods=count,
        ratings=_both(ratings, _period_ratings),
    )


def _by_stance(run: Analysis, first: int, stop: int) -> tuple[ColouredRows, ...]:
    stands = run.states[first:stop] == STANCE
    edges = [0, *(np.flatnonzero(np.diff(stands)) + 1).tolist(), stop - first]
    return tuple(
        ColouredRows(
            first=first + low,
            stop=first + high,
            colour=style.unit(style.STANCE if stands[low] else style.FLIGHT),
        )
        for low, high in pairwise(edges)
    )


def _both(ratings: RunRatings, words: Callable[[RatingLists], str]) -> str:
    """Ratings about the reference that comes first, and about the other one where they differ."""
    first = ratings.reference
    found = {each: words(ratings.about(each)) for each in (first, *Reference)}
    if not found[first]:
        return ""
    said = [each for each in found if each is first or found[each] != found[first]]
    return "\n".join(f"about the {each.value}: {found[each]}" for each in said)


def _jump_ratings(jumps: int, ratings: RatingLists) -> str:
    """Means over the highlighted jumps, and how many these are of those of the run."""
    latest = min(jumps, LAST_JUMPS)
    parts = [
        f"$P^r_{{{name}}}$ = {shown(float(np.nanmean(values[-latest:])))}"
        for name, values in (("st", ratings.stance), ("fl", ratings.flight))
        if _any_finite(values[-latest:])
    ]
    number = f"{'last ' if latest < jumps else ''}{latest} jump{'' if latest == 1 else 's'}"
    return f"{', '.join(parts)} ({number})" if parts else ""


def _period_ratings(ratings: RatingLists) -> str:
    values = ratings.periods
    if not _any_finite(values):
        return ""
    last = len(values)
    ends = f"$P^r_1$ = {shown(values[0])}, $P^r_{{{last}}}$ = {shown(values[-1])}"
    return f"{ends}, mean {shown(float(np.nanmean(values)))}"


def _any_finite(values: list[float] | Floats) -> bool:
    return bool(np.isfinite(values).any())
