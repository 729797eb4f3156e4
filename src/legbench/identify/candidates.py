"""Experiments that may be proposed as the next run: those of the paper, steps in z1, and chirps."""

from collections.abc import Iterator
from dataclasses import replace
from typing import Final

import numpy as np

from legbench.control import (
    BangBangConfig,
    ChirpConfig,
    ControllerSettings,
    PositionJumpConfig,
    make_controller,
)
from legbench.control.chirp import ChirpCoordinate, ChirpWave
from legbench.design.setup import Setup, SetupKind
from legbench.experiment.data import Experiment
from legbench.experiment.run import run
from legbench.experiment.start import targets_of
from legbench.identify.staged import IdentificationTask
from legbench.identify.trial import FIXED, FitTrial, trial_of
from legbench.mjcf.options import Linkage, LinkageKind
from legbench.plant.start import PERIOD
from legbench.signals import Observation

DURATION: Final = 3.0
"""Length of a candidate [s]."""


def candidates(task: IdentificationTask) -> Iterator[tuple[str, Experiment]]:
    """Experiments by a name that says setup and motion."""
    bars = task.bars
    linkage = (
        Linkage(kind=LinkageKind.REDUCED)
        if bars is None
        else Linkage(bar_density=bars.density, crank_length=bars.crank_length)
    )
    for kind in FIXED:
        for name, controller in _motions():
            yield (
                f"{kind} {name}",
                Experiment(
                    design=task.design,
                    controller=controller,
                    setup=Setup(kind=SetupKind(kind)),
                    linkage=linkage,
                    duration=DURATION,
                ),
            )


def _motions() -> Iterator[tuple[str, ControllerSettings]]:
    for z2 in (1.0, 1.4):
        yield f"step to z2 {z2:g}", PositionJumpConfig(z2=z2, dz2=0.3)
    yield "bang-bang z2 1", BangBangConfig(z2=1.0)
    step = ChirpConfig(
        coordinate=ChirpCoordinate.Z1, wave=ChirpWave.SQUARE, f0=0.5, f1=0.5, amplitude=0.1
    )
    yield "steps in z1 0.1", step
    for coordinate in (ChirpCoordinate.Q1, ChirpCoordinate.Q2, ChirpCoordinate.Z1):
        yield f"chirp in {coordinate} 1 to 12 Hz", ChirpConfig(coordinate=coordinate)


def trial_of_candidate(name: str, experiment: Experiment, task: IdentificationTask) -> FitTrial:
    """Run of a candidate as far as a prediction needs it: when the motors would be where.

    Motions that are the same whatever the leg does are asked of their controller; others are
    simulated.

    Raises:
        ConfigError: the leg refuses the settings.
    """
    like = task.trials[0]
    if isinstance(experiment.controller, BangBangConfig):
        return replace(trial_of(run(experiment)), links=like.links, motors=like.motors)
    controller = make_controller(experiment.controller, targets_of(experiment))
    rows = round(experiment.duration / PERIOD)
    asked = [controller.step(_moment(row * PERIOD)).motor_pos for row in range(rows)]
    motors = np.array([controller.start_motor_pos, *asked[:-1]])
    return FitTrial(
        name=name,
        setup=experiment.setup.kind,
        time=PERIOD * np.arange(rows, dtype=np.float64),
        motor_pos=motors,
        joint_pos=np.zeros_like(motors),
        applied_pos=motors,
        period=PERIOD,
        links=like.links,
        motors=like.motors,
    )


def _moment(time: float) -> Observation:
    """Observation at a time, for controllers that look at nothing else."""
    nothing = np.zeros(2)
    return Observation(
        time=time,
        motor_pos=nothing,
        joint_pos=nothing,
        joint_vel=nothing,
        spring_torque=nothing,
        applied_pos=nothing,
    )
