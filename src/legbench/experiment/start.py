"""Start of an experiment: set points of its leg, and its first posture."""

from legbench.control import LegTargets, make_controller
from legbench.experiment.data import Experiment
from legbench.plant.backlash import rest_of
from legbench.plant.start import Start


def targets_of(experiment: Experiment) -> LegTargets:
    """Set points of the experiment's leg in its setup."""
    return LegTargets(
        designs=experiment.design,
        support=experiment.setup.support,
        meaning=experiment.conventions.setpoint,
        convention=experiment.conventions.modal,
    )


def start_of(experiment: Experiment) -> Start:
    """The state that an experiment begins in: its controller's first posture, at rest.

    The motors are where their encoders show that posture; the links are where the leg as it was
    built rests then.

    Raises:
        ConfigError: settings that the leg refuses.
    """
    targets = targets_of(experiment)
    motor_pos = make_controller(experiment.controller, targets).start_motor_pos
    imperfections = experiment.imperfections
    if imperfections.perfect:
        return Start(joint_pos=targets.link_at_rest(motor_pos), motor_pos=motor_pos)
    rest = rest_of(experiment.design, targets.support, motor_pos, imperfections)
    return Start(joint_pos=rest, motor_pos=motor_pos)
