"""The jump of imperfect legs, simulated side by side."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from legbench.control import JumpConfig
from legbench.design import LegDesign
from legbench.design.setup import Setup, SetupKind
from legbench.experiment import Experiment, run_batch
from legbench.imperfections import Imperfections
from legbench.metrics import Analysis
from legbench.mjcf.options import Linkage, LinkageKind
from legbench.recording.reader import Recording

DURATION = 4.0
"""Length of the jumping run [s]: a second in which the hop grows, and more than three jumps."""


@dataclass(frozen=True, slots=True, kw_only=True)
class PredictedHop:
    """Figures of the simulated hop of one leg; NaN where there is none."""

    stance: float
    """Lowest P^r of a complete stance of the limit cycle [-]."""
    flight: float
    """Lowest P^r of a complete flight of the limit cycle [-]."""
    foot_clearance: float
    """Height that the foot tip reaches [m]."""
    trunk_excursion: float
    """Vertical travel of the trunk [m]."""
    drift: float
    """Horizontal travel of the trunk over three jumps [m]."""
    cause: str | None
    """Cause of an early end of the run; none if it hopped to its end."""


def jump_experiment(design: LegDesign, imperfections: Imperfections) -> Experiment:
    """Hop of an imperfect leg; what guides the trunk in `ffs` is not there."""
    return Experiment(
        design=design,
        controller=JumpConfig(),
        setup=Setup(kind=SetupKind.JUMP),
        linkage=Linkage(kind=LinkageKind.REDUCED),
        imperfections=replace(imperfections, guide_damping=None),
        duration=DURATION,
    )


def hops_of(
    design: LegDesign,
    legs: Sequence[Imperfections],
    progress: Callable[[int, int], None] | None = None,
) -> list[PredictedHop]:
    """Simulate the hop of each leg and measure it."""
    experiments = [jump_experiment(design, leg) for leg in legs]
    return [measure_hop(run) for run in run_batch(experiments, progress=progress)]


def measure_hop(run: Recording) -> PredictedHop:
    """Figures of a hopping run."""
    analysis = Analysis(run)
    figures, ratings = analysis.jump_figures, analysis.ratings.chosen
    begin = figures.first
    cause = analysis.description.cause
    if cause is None and figures.count <= begin:
        cause = "the leg does not hop"
    return PredictedHop(
        stance=_lowest(ratings.stance[begin:]),
        flight=_lowest(ratings.flight[begin:]),
        foot_clearance=figures.foot_clearance,
        trunk_excursion=figures.trunk_excursion,
        drift=figures.drift,
        cause=cause,
    )


def _lowest(values: list[float]) -> float:
    return float(np.min(values)) if values else float("nan")
