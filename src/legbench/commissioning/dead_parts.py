"""Trials of dead motors and encoders: how soon the limits find them, and that healthy ones pass."""

from dataclasses import dataclass

from legbench.commissioning.broken_plant import Part
from legbench.commissioning.dead_part_stage import Bench, Death, Emulation, staged
from legbench.errors import PlantFault
from legbench.servo import ServoConfig

EXCITATION = 0.03
"""Smallest difference from a healthy part at which a dead one counts as contradicted [rad]."""
BOUND, DRIFT_BOUND = 0.05, 0.15
"""Longest times from the contradiction to the end of the run, and for a drift [s]."""
PATIENCE = 1.5
"""Time after which a dead part that has not been found counts as missed [s]."""


@dataclass(frozen=True, slots=True, kw_only=True)
class TrialOutcome:
    """What came of a run."""

    cause: str | None
    """Cause of the end of the run; None if nothing ended it."""
    time: float | None
    """Time from the contradiction to the end of the run, 0 if the end came before; None if nothing
    ended it [s]. Steps and drifts contradict a healthy leg from the moment on in which they
    begin, other parts once they differ from healthy ones by `EXCITATION`."""
    since_death: float | None
    """Time since the part died [s]."""
    excited: bool
    """Whether the dead part ever contradicted a healthy one."""

    def within(self, part: Part) -> bool:
        """Whether the part was found in time; one that shows nothing wrong need not be found."""
        if self.time is None:
            return not self.excited
        return self.time <= (DRIFT_BOUND if part.drifts else BOUND)


def try_dead_part(
    bench: Bench, emulation: Emulation, controller: str, death: Death, servo: ServoConfig
) -> TrialOutcome:
    """Run a controller, let a part die, and measure when the limits end the run.

    Raises:
        PlantFault: the run ended before the part died.
    """
    with staged(bench, emulation, controller, servo, death) as stage:
        observation = stage.plant.reset()
        stage.controller.reset(observation)
        onset = round(death.onset / stage.plant.period)
        contradicted = onset if death.part.shows_at_once else None
        for cycle in range(onset + round(PATIENCE / stage.plant.period)):
            if cycle == onset:
                stage.kill()
            try:
                observation = stage.plant.step(stage.controller.step(observation))
            except PlantFault as error:
                if cycle < onset:
                    raise
                cycles = 0 if contradicted is None else cycle - contradicted
                return TrialOutcome(
                    cause=error.cause,
                    time=cycles * stage.plant.period,
                    since_death=(cycle - onset) * stage.plant.period,
                    excited=contradicted is not None,
                )
            if contradicted is None and cycle >= onset and stage.contradiction() > EXCITATION:
                contradicted = cycle
    return TrialOutcome(cause=None, time=None, since_death=None, excited=contradicted is not None)


def watch_healthy(
    bench: Bench, emulation: Emulation, controller: str, servo: ServoConfig, seconds: float
) -> str | None:
    """Run a controller on a healthy leg; return what ended the run early, or None."""
    with staged(bench, emulation, controller, servo, None) as stage:
        observation = stage.plant.reset()
        stage.controller.reset(observation)
        for _ in range(round(seconds / stage.plant.period)):
            try:
                observation = stage.plant.step(stage.controller.step(observation))
            except PlantFault as error:
                return f"{error.cause} at {observation.time:.3f} s: {error}"
    return None
