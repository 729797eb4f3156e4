"""Runs of a leg whose parameters the test knows and the fit does not."""

import math
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from legbench.control import ControllerSettings, PositionJumpConfig
from legbench.design import LegDesign, load_design
from legbench.design.setup import Setup, SetupKind
from legbench.experiment import Experiment, run_batch
from legbench.experiment.run import run
from legbench.identify.staged import IdentificationTask
from legbench.identify.trial import FIXED, FitTrial, trial_of
from legbench.imperfections import Imperfections
from legbench.mjcf.options import Linkage, LinkageKind
from legbench.plant.landing import End
from legbench.plants import EMULATED, CanChoice
from legbench.recording.reader import Recording
from legbench.servo import ServoConfig
from legbench.signals import Floats

ROOT = Path(__file__).parents[2]
PROTOTYPE = load_design(ROOT / "models" / "prototype.toml")
HIDDEN = Imperfections(
    stiffness_error=(0.05, -0.03),
    damping_error=(0.2, -0.1),
    com_error=(0.003, 0.0, -0.002),
    inertia_error=(0.05, -0.04, 0.02),
)
"""What makes a twin of the prototype, which is driven over CAN, another leg."""
NOISE = math.radians(0.05)
REDUCED = Linkage(kind=LinkageKind.REDUCED)
STEP = PositionJumpConfig(z2=1.0, dz2=0.3, delay=0.06)
OFF = replace(PROTOTYPE, stiffness=(3.0, 1.7), damping=(0.0065, 0.0095))
"""Leg from which fits start: springs and dampers 30 % off."""


def experiments(
    design: LegDesign = PROTOTYPE,
    *,
    kinds: Sequence[SetupKind] = FIXED,
    controller: ControllerSettings = STEP,
    linkage: Linkage = REDUCED,
    duration: float = 0.6,
    **flaws: Any,
) -> list[Experiment]:
    """One run in each of some setups, with noise and counts on the encoders."""
    return [
        Experiment(
            design=design,
            controller=controller,
            setup=Setup(kind=kind),
            linkage=linkage,
            servo=ServoConfig(encoder_counts=65536),
            imperfections=Imperfections(link_noise=(NOISE, NOISE), **flaws),
            duration=duration,
            seed=place,
        )
        for place, kind in enumerate(kinds)
    ]


def trials(chosen: Sequence[Experiment]) -> tuple[FitTrial, ...]:
    """Runs of experiments, each by the name of its setup."""
    recordings = run_batch(chosen, threads=1)
    return tuple(
        replace(trial_of(recording), name=str(each.setup.kind))
        for recording, each in zip(recordings, chosen, strict=True)
    )


def driven(
    controller: ControllerSettings,
    kind: SetupKind,
    duration: float,
    hidden: Imperfections = HIDDEN,
) -> Recording:
    """Run of the twin behind emulated drives."""
    return run(
        Experiment(
            design=PROTOTYPE,
            controller=controller,
            setup=Setup(kind=kind),
            plant=CanChoice(bus=ROOT / "hardware" / "leg.toml", interface=EMULATED, end=End.STOP),
            imperfections=hidden,
            duration=duration,
        )
    )


def task(runs: Sequence[FitTrial], design: LegDesign = OFF, **more: Any) -> IdentificationTask:
    """Task with some runs that starts once, from a leg that is 30 % off."""
    return IdentificationTask(design=design, trials=tuple(runs), starts=1, **more)


def stretched(trial: FitTrial, factor: float) -> FitTrial:
    """Run whose clock goes slow by a factor: what happened, sampled at stretched times."""
    wanted = trial.time * factor
    joint_pos = np.stack([np.interp(wanted, trial.time, q) for q in trial.joint_pos.T], axis=1)
    rows = np.minimum(np.round(wanted / trial.period).astype(int), len(wanted) - 1)
    return replace(
        trial,
        joint_pos=joint_pos,
        motor_pos=trial.motor_pos[rows],
        applied_pos=trial.applied_pos[rows],
    )


def late(trial: FitTrial, cycles: int) -> FitTrial:
    """Run whose link encoders answer some cycles late."""
    first = np.repeat(trial.joint_pos[:1], cycles, axis=0)
    return trial.with_links(np.concatenate([first, trial.joint_pos[:-cycles]]))


def frozen(trial: FitTrial, joint: int, row: int) -> FitTrial:
    """Run one of whose link encoders stands still from a row on."""
    links: Floats = trial.joint_pos.copy()
    links[row:, joint] = links[row, joint]
    return trial.with_links(links)
