"""Hybrid motion of stance and flight: touchdown by eq. (12), lift-off when the ground would pull.

An event is a falling zero of an event function: the height of the foot in flight, the vertical
contact force in stance. (A leg that also swings is held by a horizontal force, too; if both vanish
at once, its foot can move down. It is then held until the foot would rise, which on the radial
mode is the same instant.) Each integration step is searched on its interpolant, at eight points
and then by Brent's method; steps that cannot contain a zero are skipped. For `min_phase` after an
event none is sought. A foot that is below the ground and sinking when that time is over has touched
down, and a force that pulls by then ends the stance, without a search; so does a force that pulls
because the motors have jumped.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import final

import numpy as np
from scipy.integrate import OdeSolver
from scipy.optimize import root_scalar

from legbench.analytic.contact import hold, overdue, switch
from legbench.analytic.equations import Pair
from legbench.analytic.model import LegModel
from legbench.analytic.smooth import Accuracy, Rates, steps
from legbench.analytic.state import LegState, Regime, Transition
from legbench.signals import Floats

EVENT_TIME = 1e-13
"""Width of the bracket to which Brent's method narrows an event [s]."""
SEARCHED = 8
"""Number of parts of a step that are searched one by one [-]."""


@dataclass(frozen=True, slots=True, kw_only=True)
class _Leg:
    """One regime's equations on a flat state, for a motor position that does not move."""

    rates: Rates
    pack: list[float]
    unpack: Callable[[float, list[float]], LegState]
    event: Callable[[list[float]], float] | None
    """Event function, which falls through zero at the event; None if there is no event."""
    near: Callable[[list[float], list[float], float], bool]
    """Whether a step between two states of that length may hold an event."""


@final
class HybridLeg:
    """Integrates one leg over time, from event to event."""

    def __init__(self, model: LegModel, accuracy: Accuracy | None = None) -> None:
        self.model = model
        self.accuracy = accuracy or Accuracy()

    def advance(
        self, state: LegState, until: float, motor: Pair
    ) -> tuple[LegState, list[Transition]]:
        """State of the leg at `until`, motors held at `motor`, and the transitions on the way.

        Raises:
            PlantFault: the integration failed.
        """
        happened: list[Transition] = []
        while state.time < until:
            state, event = self._until_event(state, until, motor)
            if event:
                after = switch(self.model, state)
                happened.append(Transition(time=state.time, before=state, after=after))
                state = after
        return state, happened

    def _until_event(self, state: LegState, until: float, motor: Pair) -> tuple[LegState, bool]:
        leg = self._leg(state, motor)
        guard = state.since + self.accuracy.min_phase
        guarded = leg.event is not None and state.time < guard
        if leg.event is not None and not guarded and overdue(self.model, state, motor):
            return state, True
        end = min(until, guard) if guarded else until
        last, last_time = leg.pack, state.time
        for solver in steps(leg.rates, state.time, leg.pack, end, self.accuracy):
            now, now_time = solver.y.tolist(), float(solver.t)
            if not guarded and leg.event is not None and leg.near(last, now, now_time - last_time):
                time = _first_fall(leg.event, solver)
                if time is not None:
                    return leg.unpack(time, solver.dense_output()(time).tolist()), True
            last, last_time = now, now_time
        return leg.unpack(end, last), False

    def _leg(self, state: LegState, motor: Pair) -> _Leg:
        match state.regime:
            case Regime.FLIGHT:
                return _flight(self.model, state, motor)
            case Regime.HANGING:
                return _hanging(self.model, state, motor)
            case _:
                return _stance(self.model, state, motor)


def _flight(model: LegModel, state: LegState, motor: Pair) -> _Leg:
    def rates(_time: float, y: Floats) -> list[float]:
        _, _, q1, q2, vx, vz, v1, v2 = y.tolist()
        trunk, a = model.flight_acceleration(motor, (q1, q2), (v1, v2))
        return [vx, vz, v1, v2, trunk[0], trunk[1], a[0], a[1]]

    def unpack(time: float, y: list[float]) -> LegState:
        x, z, q1, q2, vx, vz, v1, v2 = y
        return state._replace(
            time=time, q=(q1, q2), v=(v1, v2), trunk_pos=(x, z), trunk_vel=(vx, vz)
        )

    def height(y: list[float]) -> float:
        return y[1] + model.foot_from_hip((y[2], y[3]))[1]

    def near(last: list[float], now: list[float], duration: float) -> bool:
        """Closer to the ground than twice the way that the foot makes at its faster end."""
        speeds = [
            abs(y[5] + model.foot_vel_from_hip((y[2], y[3]), (y[6], y[7]))[1]) for y in (last, now)
        ]
        bend = 2.0 * model.floating.gravity * duration**2
        return min(height(last), height(now)) < 2.0 * max(speeds) * duration + bend

    pack = [*state.trunk_pos, *state.q, *state.trunk_vel, *state.v]
    return _Leg(rates=rates, pack=pack, unpack=unpack, event=height, near=near)


def _stance(model: LegModel, state: LegState, motor: Pair) -> _Leg:
    anchor = state.trunk_pos[0] - model.hip_over_foot(state.q)[0]

    def rates(_time: float, y: Floats) -> list[float]:
        q1, q2, v1, v2 = y.tolist()
        return [v1, v2, *model.stance_acceleration(motor, (q1, q2), (v1, v2))]

    def unpack(time: float, y: list[float]) -> LegState:
        q, v = (y[0], y[1]), (y[2], y[3])
        hip = model.hip_over_foot(q)
        return state._replace(
            time=time,
            q=q,
            v=v,
            trunk_pos=(anchor + hip[0], hip[1]),
            trunk_vel=model.hip_vel_over_foot(q, v),
        )

    def force(y: list[float]) -> float:
        return model.stance_force(motor, (y[0], y[1]), (y[2], y[3]))[1]

    weight = model.floating.mass * model.floating.gravity

    def near(last: list[float], now: list[float], _duration: float) -> bool:
        """Loaded by less than half the weight, or by what the step has changed."""
        first, second = force(last), force(now)
        return min(first, second) < 0.5 * weight + 2.0 * abs(second - first)

    def held(y: list[float]) -> float:
        return hold(model, motor, (y[0], y[1]), (y[2], y[3]))

    free = state.regime is Regime.STANCE
    pack = [*state.q, *state.v]
    return _Leg(rates=rates, pack=pack, unpack=unpack, event=held if free else None, near=near)


def _hanging(model: LegModel, state: LegState, motor: Pair) -> _Leg:
    def rates(_time: float, y: Floats) -> list[float]:
        q1, q2, v1, v2 = y.tolist()
        return [v1, v2, *model.hanging_acceleration(motor, (q1, q2), (v1, v2))]

    def unpack(time: float, y: list[float]) -> LegState:
        return state._replace(time=time, q=(y[0], y[1]), v=(y[2], y[3]))

    pack = [*state.q, *state.v]
    return _Leg(rates=rates, pack=pack, unpack=unpack, event=None, near=lambda *_: False)


def _first_fall(event: Callable[[list[float]], float], solver: OdeSolver) -> float | None:
    """Time at which the event function first falls through zero in the solver's last step [s]."""
    inside = solver.dense_output()

    def value(time: float) -> float:
        return event(inside(time).tolist())

    begin, end = float(inside.t_old), float(inside.t)
    times = np.linspace(begin, end, SEARCHED + 1).tolist()
    states = inside(np.asarray(times)).T.tolist()
    values = [event(state) for state in states]
    for index in range(SEARCHED):
        if values[index] >= 0.0 > values[index + 1]:
            if values[index] == 0.0:
                return times[index]
            bracket = (times[index], times[index + 1])
            return float(root_scalar(value, bracket=bracket, xtol=EVENT_TIME, rtol=1e-15).root)
    return None
