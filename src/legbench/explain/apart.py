"""The experiment that tells explanations apart which the measured numbers cannot."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations, product
from typing import Final

import numpy as np

from legbench.control import make_controller
from legbench.design import LegDesign
from legbench.design.setup import SetupKind
from legbench.errors import ConfigError, DesignError
from legbench.experiment import Experiment, targets_of
from legbench.explain.consistency import only_counted
from legbench.explain.engine import NOBODY, Watch, in_setup, rate_many
from legbench.explain.fitting import CauseFit
from legbench.explain.targets import PERIODS, READING, step_experiment
from legbench.imperfections import Imperfections
from legbench.kinematics import joint_to_modal
from legbench.plant.backlash import rest_of
from legbench.signals import Floats

SETUPS: Final = (SetupKind.HFTS, SetupKind.VFTS, SetupKind.FFS)
SET_POINTS: Final = (1.0, 1.2, 1.4, 1.6)
"""Set points z2 of the steps that are considered [rad]."""
DEFLECTIONS: Final = (-0.3, -0.15, 0.15, 0.3)
"""Deflections dz2 of the steps that are considered [rad]."""
POSTURE = 0.003
"""Accuracy with which a posture at rest can be read along z1 [rad]: two counts of an encoder of
4096 a revolution."""
TOLD = 2.0
"""Difference of two predictions that tells them apart, in accuracies of the reading [-]."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ProposedExperiment:
    """One experiment and what the explanations say of it."""

    setup: SetupKind
    z2: float
    """Set point after the step [rad]."""
    dz2: float
    """Deflection before it [rad]."""
    told: int
    """Number of pairs of explanations that it tells apart."""
    pairs: int
    """Number of pairs of explanations."""
    nearest: float
    """Smallest difference of two explanations, in accuracies of the reading [-]."""
    nearest_names: tuple[str, str]
    """Names of the two explanations that it tells apart least."""
    names: tuple[str, ...]
    """Names of the explanations."""
    ratings: Floats
    """Ratings P^r that each explanation predicts (k, p), NaN where no period counts [-]."""
    posture: Floats
    """Angle z1 that the encoders show at rest, before and after the step (k, 2) [rad]."""


def propose(
    design: LegDesign, fits: Sequence[CauseFit], watch: Watch = NOBODY
) -> list[ProposedExperiment]:
    """Steps that tell explanations apart, the one that tells most first; none for a single one.

    What a step shows are the ratings of its periods and the postures before and after it.
    """
    if len(fits) < 2:
        return []
    legs = [fit.imperfections for fit in fits]
    found = []
    for setup, z2, dz2 in product(SETUPS, SET_POINTS, DEFLECTIONS):
        if watch.stopped():
            break
        experiment = step_experiment(design, setup, z2, dz2)
        try:
            posture = resting(experiment, legs)
            shapes = rate_many(experiment, legs, periods=PERIODS, watch=watch)
        except (ConfigError, DesignError):
            # A set point that one of the legs cannot take is no experiment for all of them.
            watch.advance(len(fits))
            continue
        ratings = only_counted(shapes.equilibrium, shapes.counted)
        found.append(_proposal(experiment, fits, ratings, posture))
    return sorted(found, key=lambda each: (-each.told, -each.nearest))


def count_proposals(fits: int) -> int:
    """Number of legs that `propose` rates for so many explanations [-]."""
    return len(SETUPS) * len(SET_POINTS) * len(DEFLECTIONS) * fits if fits > 1 else 0


def resting(experiment: Experiment, legs: Sequence[Imperfections]) -> Floats:
    """Angle z1 that the encoders show of each leg at rest, before and after a step (n, 2) [rad].

    Raises:
        DesignError: the springs of a leg do not hold it there.
    """
    acting = [in_setup(leg, experiment.setup.kind) for leg in legs]
    targets = targets_of(experiment)
    before = make_controller(experiment.controller, targets).start_motor_pos
    after = targets.motor_at(experiment.controller.z2, "z2")  # pyrefly: ignore[missing-attribute]
    zero = np.array([leg.link_zero or (0.0, 0.0) for leg in acting])
    shown = []
    for motor in (before, after):
        at = np.repeat(motor[np.newaxis], len(legs), axis=0)
        rest = rest_of([experiment.design] * len(legs), targets.support, at, acting)
        shown.append(joint_to_modal(rest + zero, experiment.conventions.modal)[:, 0])
    return np.stack(shown, axis=-1)


def _proposal(
    experiment: Experiment, fits: Sequence[CauseFit], ratings: Floats, posture: Floats
) -> ProposedExperiment:
    pairs = list(combinations(range(len(fits)), 2))
    apart = [differ(ratings[[a, b]], posture[[a, b]]) for a, b in pairs]
    least = int(np.argmin(apart))
    first, second = pairs[least]
    controller = experiment.controller
    return ProposedExperiment(
        setup=experiment.setup.kind,
        z2=controller.z2,  # pyrefly: ignore[missing-attribute]
        dz2=controller.dz2,  # pyrefly: ignore[missing-attribute]
        told=sum(value > TOLD for value in apart),
        pairs=len(pairs),
        nearest=float(apart[least]),
        nearest_names=(fits[first].name, fits[second].name),
        names=tuple(fit.name for fit in fits),
        ratings=ratings,
        posture=posture,
    )


def differ(ratings: Floats, posture: Floats) -> float:
    """Largest difference of two predictions, in accuracies of the reading [-].

    Args:
        ratings: ratings of both (2, p), NaN where there is no period.
        posture: angles z1 at rest of both (2, 2) [rad].
    """
    periods = np.abs(ratings[0] - ratings[1]) / READING
    postures = np.abs(posture[0] - posture[1]) / POSTURE
    return float(max(np.nanmax(periods, initial=0.0), postures.max()))
