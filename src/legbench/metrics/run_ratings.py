"""The ratings of a whole run: every complete stance, flight and oscillation period."""

from dataclasses import dataclass

from legbench.design.setup import SUPPORTS
from legbench.design.statics import Support
from legbench.metrics.periods import Periods
from legbench.metrics.phases import Gait
from legbench.metrics.rating import rate_phases
from legbench.metrics.source import Recorded, Reference


@dataclass(frozen=True, slots=True, kw_only=True)
class RatingLists:
    """P^r of eq. (14) [-] with one reference, one value a complete phase or period, in order."""

    stance: list[float]
    """Ratings of the stances."""
    flight: list[float]
    """Ratings of the flights."""
    periods: list[float]
    """Ratings of the oscillation periods."""


@dataclass(frozen=True, slots=True, kw_only=True)
class RunRatings:
    """Ratings of a run about the motor and about the equilibrium, one of which comes first."""

    reference: Reference
    """Reference that the run is judged by."""
    motor: RatingLists
    equilibrium: RatingLists

    @property
    def chosen(self) -> RatingLists:
        """Ratings about the reference that the run is judged by."""
        return self.about(self.reference)

    def about(self, reference: Reference) -> RatingLists:
        """Ratings about one of the two references."""
        return self.motor if reference is Reference.MOTOR else self.equilibrium


def rate_run(run: Recorded, gait: Gait, periods: Periods | None) -> RunRatings:
    """Rate a run; without periods, those of a run that has none.

    A stance is carried by the foot, a flight by nothing, a period as its setup has it.
    """
    reference = run.description.reference
    motor = _rate(run, gait, periods, Reference.MOTOR)
    carried = SUPPORTS[run.description.setup.kind]
    if carried is Support.NONE:
        # Springs that carry nothing have their equilibrium at the motor.
        return RunRatings(reference=reference, motor=motor, equilibrium=motor)
    equilibrium = _rate(run, gait, periods, Reference.EQUILIBRIUM, flight=motor.flight)
    return RunRatings(reference=reference, motor=motor, equilibrium=equilibrium)


def _rate(
    run: Recorded,
    gait: Gait,
    periods: Periods | None,
    reference: Reference,
    flight: list[float] | None = None,
) -> RatingLists:
    """Rate with one reference; flights may be rated already, since nothing carries the leg."""
    carried, stance = SUPPORTS[run.description.setup.kind], gait.stance
    if flight is None:
        rows = (gait.flight.first, gait.flight.stop)
        flight = rate_phases(run, Support.NONE, reference, *rows)
    return RatingLists(
        stance=rate_phases(run, carried, reference, stance.first, stance.stop),
        flight=flight,
        periods=[]
        if periods is None
        else rate_phases(run, carried, reference, periods.first, periods.stop),
    )
