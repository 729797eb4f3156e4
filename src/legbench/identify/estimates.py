"""Estimates with their intervals, from a fit's steps back to units."""

import math
from collections.abc import Sequence

from legbench.identify.outcome import Estimate
from legbench.identify.parameters import INDEX, PARAMETERS, moved, steps_of
from legbench.identify.spread import Spread
from legbench.signals import Floats


def estimates_of(
    names: Sequence[str], before: Floats, values: Floats, spread: Spread
) -> tuple[Estimate, ...]:
    """Estimates of the free parameters; an interval of a positive one is one of its logarithm."""
    found = []
    for place, name in enumerate(names):
        value, error = float(values[INDEX[name]]), float(spread.errors[place])
        width = spread.quantile * error
        per_step = abs(steps_of(name, value))
        # A logarithm that is known to no better than a factor of e^300 is not known at all.
        width = min(width, 300.0) if PARAMETERS[name].positive else width
        found.append(
            Estimate(
                name=name,
                unit=PARAMETERS[name].unit,
                value=value,
                before=float(before[INDEX[name]]),
                error=error * per_step if math.isfinite(error) else math.inf,
                white_error=float(spread.white[place]) * per_step,
                low=moved(name, value, -width),
                high=moved(name, value, width),
            )
        )
    return tuple(found)
