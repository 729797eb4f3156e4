"""What experiments must share to be stepped side by side, as one batch; imports no simulator."""

from collections.abc import Hashable
from dataclasses import replace

from legbench.experiment.data import Experiment
from legbench.plants import SimChoice


def runs_in_batch(experiment: Experiment) -> bool:
    """Whether a batch can run an experiment: on the simulated plant, without limits."""
    return isinstance(experiment.plant, SimChoice) and experiment.plant.limits is None


def alike(experiment: Experiment) -> Hashable:
    """What legs that are stepped together have in common: parts of the model, readings, columns."""
    conventions = experiment.conventions
    signals = experiment.controller.describe().signals
    options, built = experiment.options, experiment.imperfections.leg_of(experiment.design)
    # Alone each leg has the step that suits it, so that only legs of one step are company.
    fitted = options.numerics.fitted([built], options.linkage)
    return replace(options, numerics=fitted), conventions.modal, conventions.setpoint, signals
