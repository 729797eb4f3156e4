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
    """RatingLists of the stances."""
    flight: list[float]
    """RatingLists of the flights."""
    periods: list[float]
    """RatingLists of the oscillation periods."""


@dataclass(frozen=True, slots=True, kw_only=True)
class RunRatings:
    """RatingLists of a run with the reference that it asks for, and with the equilibrium."""

    chosen: RatingLists
    equilibrium: RatingLists


def rate_run(run: Recorded, gait: Gait, periods: Periods | None) -> RunRatings:
    """Rate a run; without periods, those of a run that has none.

    A stance is carried by the foot, a flight by nothing, a period as its setup has it.
    """
    equilibrium = _rate(run, gait, periods, Reference.EQUILIBRIUM)
    if run.description.reference is Reference.EQUILIBRIUM:
        return RunRatings(chosen=equilibrium, equilibrium=equilibrium)
    chosen = _rate(run, gait, periods, run.description.reference)
    return RunRatings(chosen=chosen, equilibrium=equilibrium)


def _rate(run: Recorded, gait: Gait, periods: Periods | None, reference: Reference) -> RatingLists:
    carried, stance, flight = SUPPORTS[run.description.setup.kind], gait.stance, gait.flight
    return RatingLists(
        stance=rate_phases(run, carried, reference, stance.first, stance.stop),
        flight=rate_phases(run, Support.NONE, reference, flight.first, flight.stop),
        periods=[]
        if periods is None
        else rate_phases(run, carried, reference, periods.first, periods.stop),
    )
