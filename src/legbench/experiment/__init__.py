"""What is to happen as one value, its file and its name, and what running it leaves.

What runs it is loaded when it is asked for: describing an experiment costs no simulator.
"""

from typing import TYPE_CHECKING

from legbench.control import ControllerSettings, make_controller
from legbench.experiment.canonical import canonical_text, experiment_hash
from legbench.experiment.data import Conventions, Experiment
from legbench.experiment.files import experiment_text, load_experiment, save_experiment
from legbench.experiment.start import start_of, targets_of
from legbench.lazily import lazy_names

if TYPE_CHECKING:
    from legbench.experiment.running import Finished, record

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
    "save_experiment",
    "start_of",
    "targets_of",
]
_HOME = "legbench.experiment.running"
__getattr__ = lazy_names(__name__, {"Finished": _HOME, "record": _HOME})
