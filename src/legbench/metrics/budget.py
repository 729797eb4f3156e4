"""Energy budget of each jump, which bounds the hop."""

from dataclasses import dataclass

import numpy as np

from legbench.metrics.energy import Flows, stop_intervals
from legbench.metrics.phases import Gait
from legbench.metrics.source import Recorded
from legbench.metrics.stance import MINIMUM_PHASE
from legbench.signals import Bools, Floats


@dataclass(frozen=True, slots=True, kw_only=True)
class EnergyBudget:
    """Energy of each complete jump, lower apex to lower apex (m,) [J]; NaN without truth.

    `gain = motor_work - damper_loss - impact_loss - stop_loss - contact_loss - other_loss`, each
    interval's unexplained energy being counted once, in this order.
    """

    gain: Floats
    """Energy that the leg has gained from one lower apex to the next: zero in a limit cycle."""
    motor_work: Floats
    damper_loss: Floats
    impact_loss: Floats
    """Unexplained energy in the first `MINIMUM_PHASE` after touchdown."""
    stop_loss: Floats
    """Unexplained energy while a joint is at a stop."""
    contact_loss: Floats
    """Unexplained energy in the rest of stance: sliding, yielding ground."""
    other_loss: Floats
    """Unexplained energy in the rest of flight: friction, numerics."""


def energy_budget(recording: Recorded, gait: Gait, flows: Flows) -> EnergyBudget:
    """Work and losses of each complete jump (m,) [J]."""
    if len(gait.jumps) == 0:
        return EnergyBudget(**{name: np.zeros(0) for name in EnergyBudget.__dataclass_fields__})
    impact, stance = _stance_intervals(recording.time, gait)
    stop = stop_intervals(recording) & ~impact
    stance &= ~(impact | stop)
    rest = ~(impact | stop | stance)
    low = np.searchsorted(recording.time, gait.jumps.start)
    high = np.searchsorted(recording.time, gait.jumps.end)

    def each_jump(flow: Floats, counts: Bools | None = None) -> Floats:
        """Sum of a flow over each jump, or the loss in the intervals that count."""
        lost = flow if counts is None else np.where(counts, -flow, 0.0)
        running = np.concatenate([[0.0], np.cumsum(lost)])
        return running[high] - running[low]

    return EnergyBudget(
        gain=each_jump(flows.gain),
        motor_work=each_jump(flows.motor_work),
        damper_loss=each_jump(flows.damper_loss),
        impact_loss=each_jump(flows.unexplained, impact),
        stop_loss=each_jump(flows.unexplained, stop),
        contact_loss=each_jump(flows.unexplained, stance),
        other_loss=each_jump(flows.unexplained, rest),
    )


def _stance_intervals(time: Floats, gait: Gait) -> tuple[Bools, Bools]:
    """Intervals just after a touchdown, and all that touch a complete stance (n - 1,)."""
    impact = np.zeros(max(len(time) - 1, 0), dtype=bool)
    stance = impact.copy()
    for first, stop in zip(gait.stance.first, gait.stance.stop, strict=True):
        stance[max(first - 1, 0) : stop] = True
        after = int(np.searchsorted(time, time[first] + MINIMUM_PHASE))
        impact[max(first - 1, 0) : min(after, stop)] = True
    return impact, stance
