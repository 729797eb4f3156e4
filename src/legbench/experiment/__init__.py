"""Experiments: a run as one value, its file, its name, and its running.

Names are loaded when they are asked for: describing an experiment costs no simulator.
"""

from typing import TYPE_CHECKING

from legbench.lazily import lazy_names

if TYPE_CHECKING:
    from legbench.control import ControllerSettings, make_controller
    from legbench.experiment.batch import run_batch
    from legbench.experiment.canonical import canonical_text, experiment_hash
    from legbench.experiment.data import Conventions, Experiment
    from legbench.experiment.files import experiment_text, load_experiment, save_experiment
    from legbench.experiment.running import Finished, record
    from legbench.experiment.start import start_of, targets_of

__all__ = [
    "ControllerSettings",
    "Conventions",
    "Experiment",
    "Finished",
    "canonical_text",
    "experiment_hash",
    "experiment_text",
    "load_experiment",
    "make_controller",
    "record",
    "run_batch",
    "save_experiment",
    "start_of",
    "targets_of",
]
__getattr__ = lazy_names(
    __name__,
    {
        "ControllerSettings": "legbench.control",
        "Conventions": "legbench.experiment.data",
        "Experiment": "legbench.experiment.data",
        "Finished": "legbench.experiment.running",
        "canonical_text": "legbench.experiment.canonical",
        "experiment_hash": "legbench.experiment.canonical",
        "experiment_text": "legbench.experiment.files",
        "load_experiment": "legbench.experiment.files",
        "make_controller": "legbench.control",
        "record": "legbench.experiment.running",
        "run_batch": "legbench.experiment.batch",
        "save_experiment": "legbench.experiment.files",
        "start_of": "legbench.experiment.start",
        "targets_of": "legbench.experiment.start",
    },
)
