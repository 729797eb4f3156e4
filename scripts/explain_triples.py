"""Three causes at once: what `legbench explain` does not search, over a bounded set of them.

    scripts/explain_triples.py text       the step from 1.7 to 1.4 rad
    scripts/explain_triples.py caption    the step from 0.7 to 1.0 rad; a minute of CPU
    scripts/explain_triples.py flights    what small imperfections alone leave of the jump's ratings

Each triple joins a cause that couples the modes, one that lets the radial motion die faster or
turn out another one, and any third. It is fitted to the six ratings and, unlike a pair, to the
order of the setups and to the decline in each; those that reach the target then jump, and the best
are tried against all ten statements.
"""

import sys
import time
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from legbench.design import LegDesign, load_design
from legbench.design.setup import SetupKind
from legbench.explain.causes import CAUSES, Cause, combined
from legbench.explain.consistency import checks_of, only_counted, predict
from legbench.explain.engine import rate_many
from legbench.explain.fitting import DIFFERENCE, CauseFit, leg_of, rate
from legbench.explain.jumping import PredictedHop, hops_of
from legbench.explain.least_squares import refine
from legbench.explain.targets import READING, Target, step_experiment, step_target
from legbench.imperfections import Imperfections
from legbench.paper import published
from legbench.signals import Floats, Ints

MODELS = Path(__file__).parents[1] / "models"
COUPLING = ("stiffness-apart", "link-zero-polar", "motor-zero-polar")
DYING = ("damping", "guide-upward", "friction", "trunk-mass", "stiffness")
THIRD = (
    "stiffness-apart",
    "link-zero-polar",
    "motor-zero-polar",
    "damping-apart",
    "guide-forward",
    "thigh-inertia",
    "shank-inertia",
    "shank-com",
    "leg-mass",
)
FIXED = (SetupKind.HFTS, SetupKind.VFTS)
MARGIN = 0.005
"""Least distance that a fit seeks between two setups of which the paper rates one over [-]."""
JUMPING, JUDGED = 40, 6
"""Numbers of fits that jump, and of those that are tried against everything."""

SMALL: tuple[dict[str, float], ...] = (
    {"stiffness-apart": 0.01},
    {"stiffness-apart": -0.01},
    {"stiffness-apart": 0.055},
    {"damping": 0.5},
    {"damping-apart": 0.3},
    {"damping-apart": 1.0, "stiffness-apart": 0.055},
    {"link-zero-polar": 0.002},
    {"motor-zero-polar": 0.002},
    {"shank-com": -0.01, "stiffness-apart": 0.055},
)
"""Sizes by cause, of legs that jump in `flights`."""

Triple = tuple[Cause, ...]


def triples() -> list[tuple[Triple, tuple[float, ...]]]:
    """Causes and the sizes to begin at, each with the third at either sign."""
    found = {}
    for coupling in COUPLING:
        for dying in DYING:
            for third in THIRD:
                if third == coupling:
                    continue
                causes = tuple(CAUSES[name] for name in (coupling, dying, third))
                key = tuple(sorted(cause.name for cause in causes))
                begin = [2.0 * causes[0].plausible, causes[1].plausible]
                for sign in (1.0, -1.0) if causes[2].signed else (1.0,):
                    sizes = (*begin, sign * causes[2].plausible)
                    found.setdefault((key, sign), (causes, sizes))
    return list(found.values())


def steps_of(design: LegDesign, target: Target, legs: Sequence[Imperfections]) -> list[Floats]:
    """Ratings (n, p) of the target's step with a fixed trunk, in each such setup."""
    found = []
    for setup in FIXED:
        experiment = step_experiment(design, setup, target.z2, target.dz2)
        shapes = rate_many(experiment, legs, periods=len(target.shape))
        found.append(only_counted(shapes.equilibrium, shapes.counted))
    return found


def others(steps: Sequence[Floats], foot: Floats) -> Floats:
    """How far legs (n,) are from the order of the setups and from declines (n, 4) [tolerances]."""
    missed = []
    for ratings in steps:
        common = np.isfinite(ratings) & np.isfinite(foot)
        last = np.where(common.any(axis=1), common.cumsum(axis=1).argmax(axis=1), 0)
        rows = np.arange(len(foot))
        over = ratings[rows, last] - foot[rows, last]
        fall = ratings[:, 0] - ratings[rows, last]
        missed += [MARGIN - over, READING + MARGIN - fall]
    apart = np.nan_to_num(np.stack(missed, axis=-1), nan=10.0 * READING)
    return np.maximum(apart, 0.0) / READING


def fitted(design: LegDesign, target: Target) -> list[CauseFit]:
    """Fit every triple from its start; the best first."""
    chosen = triples()
    owners = [causes for causes, _ in chosen]

    def residuals(sizes: Floats, which: Ints) -> Floats:
        legs = [leg_of(design, owners[o], row) for o, row in zip(which, sizes, strict=True)]
        found, ratings = rate(design, target, legs)
        more = np.full((len(legs), 4), 10.0)
        there = np.flatnonzero([leg is not None for leg in legs])
        real = [leg for leg in legs if leg is not None]
        if real:
            more[there] = others(steps_of(design, target, real), ratings[there])
        return np.concatenate([found, more], axis=1)

    starts = np.array([sizes for _, sizes in chosen])
    low, high = (
        np.array([[getattr(cause, end) for cause in causes] for causes in owners])
        for end in ("low", "high")
    )
    ends = refine(residuals, starts, low, high, DIFFERENCE * (high - low))
    legs = [leg_of(design, causes, row) for causes, row in zip(owners, ends, strict=True)]
    apart, ratings = rate(design, target, legs)
    fits = [
        CauseFit(
            causes=causes,
            sizes=tuple(row.tolist()),
            ratings=tuple(rated.tolist()),
            misfit=float(np.sqrt(np.mean(np.square(missed)))),
            worst=float(np.abs(missed).max()),
        )
        for causes, row, missed, rated in zip(owners, ends, apart, ratings, strict=True)
    ]
    rest = residuals(ends, np.arange(len(ends)))[:, -4:].max(axis=1)
    order = sorted(range(len(fits)), key=lambda place: (not fits[place].within, rest[place]))
    return [fits[place] for place in order]


def lowest(hop: PredictedHop) -> float:
    """Distance of a jump from the bounds of its stances and flights, the worse of both [-]."""
    return float(np.nan_to_num(min(hop.stance - 0.99, hop.flight - 0.97), nan=-1.0))


def flights() -> int:
    """Print the worst stance and flight of a jump of legs that are small ways from perfect."""
    design = load_design(MODELS / "prototype.toml")
    groups = [([CAUSES[name] for name in sizes], list(sizes.values())) for sizes in SMALL]
    hops = hops_of(design, [combined(*group) for group in groups])
    for (causes, sizes), hop in zip(groups, hops, strict=True):
        named = zip(causes, sizes, strict=True)
        words = " and ".join(f"{cause.words} ({cause.shown(size)})" for cause, size in named)
        print(f"stance {hop.stance:.3f} flight {hop.flight:.3f}  {words}")
    return 0


def main() -> int:
    """Search and print."""
    if sys.argv[1:] == ["flights"]:
        return flights()
    if len(sys.argv) != 2 or sys.argv[1] not in ("text", "caption"):
        print(__doc__, file=sys.stderr)
        return 2
    design, target = load_design(MODELS / "prototype.toml"), step_target(sys.argv[1])
    numbers = published()
    fits = fitted(design, target)
    within = [fit for fit in fits if fit.within]
    print(f"{len(fits)} triples, {len(within)} reach the target", flush=True)
    jumping = within[:JUMPING]
    if not jumping:
        return 0
    hops = hops_of(design, [fit.imperfections for fit in jumping])
    ranked = sorted(zip(jumping, hops, strict=True), key=lambda pair: -lowest(pair[1]))
    for fit, hop in ranked[:JUDGED]:
        print(f"stance {hop.stance:.3f} flight {hop.flight:.3f}  {fit.words}")
    best = dict.fromkeys([*(fit for fit, _ in ranked[: JUDGED // 2]), *within[: JUDGED // 2]])
    known = dict(ranked)
    predicted = predict(design, target, numbers, [fit.imperfections for fit in best])
    for place, fit in enumerate(best):
        checks = checks_of(predicted, place, known[fit], numbers)
        held = sum(check.held for check in checks)
        print(f"\n{held} of {len(checks)}, misfit {fit.misfit:.2f}: {fit.words}")
        print("  " + " ".join(f"{rating:.3f}" for rating in fit.ratings))
        for check in checks:
            print(f"  {'ok' if check.held else '--'} {check.words} {check.value:.3f}")
    print(f"{time.process_time() / 60.0:.1f} min of processor time")
    return 0


if __name__ == "__main__":
    sys.exit(main())
