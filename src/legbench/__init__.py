"""legbench: a testbed for segmented legs whose natural motion is a pure radial oscillation.

The names here are what most work in Python needs; each is loaded when it is first asked for, so
that importing the package costs next to nothing.

    leg = legbench.load_design("models/prototype.toml")
    recording = legbench.run(legbench.Experiment(design=leg, controller=legbench.JumpConfig()))
    print(legbench.summarise(recording).rating_flight)
"""

from legbench.lazily import lazy_names

TYPE_CHECKING = False
"""Type checkers take it for true; `typing` is not imported for it."""
if TYPE_CHECKING:
    from legbench.control.bang_bang import BangBangConfig
    from legbench.control.chirp import ChirpConfig
    from legbench.control.jump import JumpConfig
    from legbench.control.position_jump import PositionJumpConfig
    from legbench.design.leg import LegDesign
    from legbench.design.setup import Setup, SetupKind
    from legbench.design.toml import load_design, save_design
    from legbench.errors import LegbenchError
    from legbench.experiment.data import Experiment
    from legbench.experiment.files import load_experiment, save_experiment
    from legbench.experiment.run import run
    from legbench.metrics.compare import Comparison, compare
    from legbench.metrics.summary import Summary, summarise
    from legbench.plant.analytic_choice import AnalyticChoice
    from legbench.plant.can_choice import CanChoice
    from legbench.plant.sim_choice import SimChoice
    from legbench.recording.reader import Recording, load
    from legbench.viz.print.figures import phase_figure

__version__ = "0.1.0"

__all__ = [
    "AnalyticChoice",
    "BangBangConfig",
    "CanChoice",
    "ChirpConfig",
    "Comparison",
    "Experiment",
    "JumpConfig",
    "LegDesign",
    "LegbenchError",
    "PositionJumpConfig",
    "Recording",
    "Setup",
    "SetupKind",
    "SimChoice",
    "Summary",
    "compare",
    "load",
    "load_design",
    "load_experiment",
    "phase_figure",
    "run",
    "save_design",
    "save_experiment",
    "summarise",
]
_HOMES = {
    "AnalyticChoice": "legbench.plant.analytic_choice",
    "BangBangConfig": "legbench.control.bang_bang",
    "CanChoice": "legbench.plant.can_choice",
    "ChirpConfig": "legbench.control.chirp",
    "Comparison": "legbench.metrics.compare",
    "Experiment": "legbench.experiment.data",
    "JumpConfig": "legbench.control.jump",
    "LegDesign": "legbench.design.leg",
    "LegbenchError": "legbench.errors",
    "PositionJumpConfig": "legbench.control.position_jump",
    "Recording": "legbench.recording.reader",
    "Setup": "legbench.design.setup",
    "SetupKind": "legbench.design.setup",
    "SimChoice": "legbench.plant.sim_choice",
    "Summary": "legbench.metrics.summary",
    "compare": "legbench.metrics.compare",
    "load": "legbench.recording.reader",
    "load_design": "legbench.design.toml",
    "load_experiment": "legbench.experiment.files",
    "phase_figure": "legbench.viz.print.figures",
    "run": "legbench.experiment.run",
    "save_design": "legbench.design.toml",
    "save_experiment": "legbench.experiment.files",
    "summarise": "legbench.metrics.summary",
}
__getattr__ = lazy_names(__name__, _HOMES)


def __dir__() -> list[str]:
    """Names that a prompt completes."""
    return [*__all__, "__version__"]
