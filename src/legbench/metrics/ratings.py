"""The ratings of a whole run: every complete stance, flight and oscillation period."""

from typing import Any

import numpy as np

from legbench.design.setup import SUPPORTS, SetupKind
from legbench.design.statics import Support
from legbench.metrics.periods import find_periods
from legbench.metrics.phases import Gait
from legbench.metrics.rating import rate_phases
from legbench.metrics.source import Recorded, Reference, Terms


def rate_run(recording: Recorded, terms: Terms, gait: Gait) -> dict[str, Any]:
    """Lists of P^r and of period lengths [s], by their name in a `Summary`.

    A stance is carried by the foot, a flight by nothing, a period as its setup has it.
    """
    periods = None if terms.setup is SetupKind.JUMP else find_periods(recording)
    no_rows = np.zeros(0, dtype=np.int64)
    first, stop = (no_rows, no_rows) if periods is None else (periods.first, periods.stop)
    phases = {
        "stance": (SUPPORTS[terms.setup], gait.stance.first, gait.stance.stop),
        "flight": (Support.NONE, gait.flight.first, gait.flight.stop),
        "periods": (SUPPORTS[terms.setup], first, stop),
    }
    ratings: dict[str, Any] = {
        "periods": [] if periods is None else (periods.end - periods.start).tolist()
    }
    for name, (support, low, high) in phases.items():
        by_motor = rate_phases(recording, support, Reference.MOTOR, low, high)
        by_equilibrium = rate_phases(recording, support, Reference.EQUILIBRIUM, low, high)
        chosen = by_motor if terms.reference is Reference.MOTOR else by_equilibrium
        ratings |= {f"rating_{name}": chosen, f"rating_{name}_equilibrium": by_equilibrium}
    return ratings
