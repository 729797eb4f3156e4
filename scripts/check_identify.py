"""Proofs of identification that take minutes: accuracy, coverage, predicted errors, convergence.

    python scripts/check_identify.py [--repeats 100] [--only coverage bars errors starts]

Truths are random legs near the prototype, set points are random too, so that rounded motors differ
from run to run. Data of the same model are predicted by the compiled leg; data of `bars` come from
MuJoCo. Noise is 0.1 deg on encoders of 16 384 counts, motors are rounded to such counts.
"""

import argparse
import math
import time
from dataclasses import replace
from pathlib import Path

import numpy as np

from legbench.control import PositionJumpConfig
from legbench.design import LegDesign, load_design
from legbench.design.setup import Setup, SetupKind
from legbench.experiment import Experiment, run_batch
from legbench.identify.base import LegParameters, mended
from legbench.identify.candidates import trial_of_candidate
from legbench.identify.estimates import estimates_of
from legbench.identify.fitting import fit
from legbench.identify.noise import Precision, precision_of
from legbench.identify.outcome import Estimate
from legbench.identify.parameters import GROUPS, INDEX, USUAL, Freedom
from legbench.identify.prediction import Guess, Predictor, nothing_moved
from legbench.identify.problem import Problem
from legbench.identify.spread import spread_of
from legbench.identify.staged import IdentificationTask, fits_from
from legbench.identify.trial import FIXED, FitTrial, bars_of, trial_of
from legbench.recording.reader import Recording
from legbench.signals import Floats

PROTOTYPE = load_design(Path(__file__).parents[1] / "models" / "prototype.toml")
NOISE, COUNT = math.radians(0.1), 2.0 * math.pi / 16384
PRECISION = Precision(sigma=math.hypot(NOISE, COUNT / math.sqrt(12.0)), count=COUNT)
NINE = GROUPS["nine"]
STARTS = 3
"""Number of starts that `legbench identify` makes."""


def shaken(design: LegDesign, random: np.random.Generator, share: float) -> LegDesign:
    """Leg whose springs, dampers, centres of mass and inertias are off by up to a share."""

    def off(value: float) -> float:
        return value * (1.0 + random.uniform(-share, share))

    segments = {
        name: replace(
            getattr(design, name),
            com=off(getattr(design, name).com),
            inertia=off(getattr(design, name).inertia),
        )
        for name in ("thigh", "shank", "foot")
    }
    stiffness = off(design.stiffness[0]), off(design.stiffness[1])
    damping = off(design.damping[0]), off(design.damping[1])
    return replace(design, stiffness=stiffness, damping=damping, **segments)


def steps(design: LegDesign, random: np.random.Generator, duration: float) -> list[Experiment]:
    """Steps in the three fixed setups, from random set points."""
    return [
        Experiment(
            design=design,
            controller=PositionJumpConfig(z2=random.uniform(0.95, 1.05), dz2=0.3),
            setup=Setup(kind=SetupKind(kind)),
            duration=duration,
        )
        for kind in FIXED
    ]


def rounded(values: Floats) -> Floats:
    """Angles in whole counts."""
    return np.round(values / COUNT) * COUNT


def noisy(trial: FitTrial, random: np.random.Generator, *, motors: bool = True) -> FitTrial:
    """Run as encoders of 0.1 deg of noise and 16 384 counts show it, on motors, too, or not."""
    shown = trial.joint_pos + NOISE * random.standard_normal(trial.joint_pos.shape)
    return replace(
        trial,
        motor_pos=rounded(trial.motor_pos) if motors else trial.motor_pos,
        joint_pos=rounded(shown),
        links=(PRECISION, PRECISION),
        motors=(precision_of(np.zeros(2)).counting(COUNT if motors else 0.0),) * 2,
    )


def synthetic(
    truth: LegDesign, random: np.random.Generator, duration: float, *, motors: bool = True
) -> list[FitTrial]:
    """Runs of a leg as its equations predict them, with noise."""
    like = FitTrial(
        name="",
        setup=SetupKind.FFS,
        time=np.array([0.0, 1.0]),
        motor_pos=np.zeros((2, 2)),
        joint_pos=np.zeros((2, 2)),
        applied_pos=np.zeros((2, 2)),
        period=1e-3,
        links=(PRECISION, PRECISION),
        motors=(PRECISION, PRECISION),
    )
    task = IdentificationTask(design=truth, trials=(like,))
    bare = [
        replace(trial_of_candidate(each.setup.kind, each, task), name=each.setup.kind)
        for each in steps(truth, random, duration)
    ]
    leg = LegParameters.of(truth)
    guess = Guess(values=leg.values, starts=nothing_moved(bare))
    links = Predictor(bare, leg.reach, friction=False).predict(guess)
    return [
        noisy(replace(trial, joint_pos=each.links), random, motors=motors)
        for trial, each in zip(bare, links, strict=True)
    ]


def learned(
    trials: list[FitTrial], start: LegParameters, names: tuple[str, ...]
) -> tuple[tuple[Estimate, ...], float]:
    """Estimates from one start, and the mean square of the residuals."""
    problem = Problem(trials, start.reach, Freedom(names=names))
    ended = fit(problem, Guess(values=start.values, starts=nothing_moved(trials))).misfit
    size = sum(each.size for each in ended.residuals)
    spread = spread_of(ended, trials)
    return (
        estimates_of(names, start.values, ended.guess.values, spread),
        ended.cost / size,
    )


def held(
    truth: LegParameters, names: tuple[str, ...], random: np.random.Generator
) -> LegParameters:
    """Start whose free parameters are 30 % off, up or down; the others are the truth."""
    values = truth.values.copy()
    for name in names:
        values[INDEX[name]] *= 1.3 if random.random() < 0.5 else 0.7
    return replace(truth, values=values)


def coverage(repeats: int, duration: float) -> None:
    """Accuracy and coverage on data of the same model, k and d free and 30 % off."""
    for motors in (False, True):
        random = np.random.default_rng(1)
        worst, inside = dict.fromkeys(USUAL, 0.0), dict.fromkeys(USUAL, 0)
        for _ in range(repeats):
            truth = shaken(PROTOTYPE, random, 0.1)
            leg = LegParameters.of(truth)
            trials = synthetic(truth, random, duration, motors=motors)
            found, _ = learned(trials, held(leg, USUAL, random), USUAL)
            count_in(found, leg, worst, inside)
        name = f"same model, motors {'rounded' if motors else 'exact'}"
        told(name, worst, inside, repeats)


def count_in(
    found: tuple[Estimate, ...], leg: LegParameters, worst: dict[str, float], inside: dict[str, int]
) -> None:
    """Note errors of estimates, and whether their intervals cover the truth."""
    for each in found:
        true = float(leg.values[INDEX[each.name]])
        worst[each.name] = max(worst[each.name], abs(each.value / true - 1.0))
        inside[each.name] += each.low <= true <= each.high


def told(name: str, worst: dict[str, float], inside: dict[str, int], repeats: int) -> None:
    """Print errors and coverage."""
    print(f"{name}: largest error [%]", {key: round(100 * each, 4) for key, each in worst.items()})
    print(f"{name}: 95 % intervals cover, of {repeats}", inside)


def from_bars(repeats: int, duration: float) -> None:
    """Coverage on data of MuJoCo's leg with bars, k and d free."""
    random = np.random.default_rng(2)
    truth = shaken(PROTOTYPE, random, 0.05)
    sets = 4
    recordings: list[Recording] = run_batch(
        [each for _ in range(sets) for each in steps(truth, random, duration)]
    )
    bare = [replace(trial_of(each), name=str(place)) for place, each in enumerate(recordings)]
    leg = LegParameters.of(truth, bars=bars_of(recordings[0]))
    inside, worst = dict.fromkeys(USUAL, 0), dict.fromkeys(USUAL, 0.0)
    for repeat in range(repeats):
        place = 3 * (repeat % sets)
        trials = [noisy(each, random) for each in bare[place : place + 3]]
        found, _ = learned(trials, leg, USUAL)
        count_in(found, leg, worst, inside)
    told("bars", worst, inside, repeats)


def errors(repeats: int, duration: float) -> None:
    """Scatter of nine estimates against the standard errors that their Jacobian predicts.

    Motors are not rounded here, which would scatter by itself; that error is reported apart.
    """
    random = np.random.default_rng(3)
    leg = LegParameters.of(PROTOTYPE)
    bare = synthetic(PROTOTYPE, random, duration, motors=False)
    clean = Predictor(bare, leg.reach, friction=False).predict(
        Guess(values=leg.values, starts=nothing_moved(bare))
    )
    values, predicted = [], []
    for _ in range(repeats):
        trials = [
            replace(
                trial,
                joint_pos=each.links + PRECISION.sigma * random.standard_normal(each.links.shape),
            )
            for trial, each in zip(bare, clean, strict=True)
        ]
        found, _ = learned(trials, leg, NINE)
        values.append([each.value for each in found])
        predicted.append([each.white_error for each in found])
    ratio = np.std(values, axis=0, ddof=1) / np.mean(predicted, axis=0)
    print("nine: scatter over predicted error", dict(zip(NINE, ratio.round(3), strict=True)))


def starts(repeats: int, duration: float) -> None:
    """Convergence from 0.4 to 3 times the truth, mixed; k and d, and all nine."""
    random = np.random.default_rng(4)
    leg = LegParameters.of(PROTOTYPE)
    trials = synthetic(PROTOTYPE, random, duration, motors=False)
    for names in (USUAL, NINE):
        problem = Problem(trials, leg.reach, Freedom(names=names))
        truth = Guess(values=leg.values, starts=nothing_moved(trials))
        bottom, once, good, evaluations = problem.misfit(truth).cost, 0, 0, 0
        for _ in range(repeats):
            factors = random.uniform(math.log(0.4), math.log(3.0), len(names))
            start = truth
            for name, factor in zip(names, factors.tolist(), strict=True):
                start = start.at(name, float(leg.values[INDEX[name]]) * math.exp(factor))
            start = replace(start, values=mended(start.values, leg.reach))
            found = fits_from(problem, start, STARTS)
            evaluations += found[0].evaluations
            once += found[0].misfit.cost < bottom * 1.001
            good += min(each.misfit.cost for each in found) < bottom * 1.001
        print(
            f"starts, {len(names)} free: {once} of {repeats} at the truth's misfit alone, {good} "
            f"with the best of {STARTS}; {evaluations / repeats:.0f} evaluations each"
        )


def main() -> None:
    """Run the proofs that were asked for."""
    proofs = {"coverage": coverage, "bars": from_bars, "errors": errors, "starts": starts}
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--repeats", type=int, default=100)
    parser.add_argument("--duration", type=float, default=3.0, help="length of a run [s]")
    parser.add_argument("--only", nargs="*", choices=list(proofs), default=list(proofs))
    asked = parser.parse_args()
    for name in asked.only:
        before = time.process_time()
        proofs[name](asked.repeats if name != "starts" else min(asked.repeats, 50), asked.duration)
        print(f"   {name}: {time.process_time() - before:.0f} s of CPU", flush=True)


if __name__ == "__main__":
    main()
