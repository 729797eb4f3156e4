"""Hops by an independent path: DOP853 on the interpreted equations, events on dense output.

Shared with the compiled leg are the equations, typed once, and the settings; integrator, events,
stops and the controller's rules are this one's own. Steps end where a stop begins or ends to push;
every condition is looked at on the interpolant of each step, and where two looks may hide a double
crossing, its largest value is searched between them.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from dense_rules import SCALE, Condition, Rules
from scipy.integrate import DOP853
from scipy.optimize import brentq, minimize_scalar

from legbench.analytic import LegModel
from legbench.analytic.contact import hold
from legbench.analytic.equations import (
    SCALAR,
    pair_acceleration,
    pair_solve,
    touchdown,
)
from legbench.analytic.stops import Stop

LOOKS = 8
"""Parts of a step that are looked at."""
BLIND = 2e-4
"""Shortest stance or flight [s]."""


@dataclass
class Story:
    """What happened in a hop, in order."""

    events: list[tuple[str, float]] = field(default_factory=list)
    ending: str = ""
    apex: tuple[float, ...] = ()
    closest: float = math.inf
    """How near a condition came to its event without one: small when the hop grazes [-]."""


class DenseHop:
    """One hop from an apex to the next."""

    def __init__(
        self, model: LegModel, rules: Rules, longest: float = 4e-3, tolerance: float = 1e-11
    ) -> None:
        self.model, self.rules, self.story = model, rules, Story()
        self.longest, self.tolerance = longest, tolerance
        first, mass = model.floating.first, model.floating.mass
        self.arm = tuple(model.floating.reach - s / mass for s in first)
        self.gravity = model.floating.gravity

    def run(self, height: float, speed: float, q: Any, v: Any) -> Story:
        """Follow the leg."""
        self.time, self.y, self.flies, self.since = 0.0, [*q, *v], True, -1.0
        self.centre, self.began, self.left = (height, 0.0, speed), 0.0, False
        for _ in range(200):
            if self.time >= 2.0:
                self.story.ending = "stands"
                return self.story
            if self._next():
                return self.story
        self.story.ending = "fault"
        return self.story

    def foot(self, t: float, y: Any) -> tuple[float, float]:
        """Height of the foot in flight and its rate."""
        z, dz, _ = self.centre
        t = t - self.began
        arm = -sum(a * math.cos(x) for a, x in zip(self.arm, y[:2], strict=True))
        rate = sum(a * math.sin(x) * w for a, x, w in zip(self.arm, y[:2], y[2:], strict=True))
        return z + (dz - 0.5 * self.gravity * t) * t + arm, dz - self.gravity * t + rate

    def _next(self) -> bool:
        """One piece; whether the hop is over."""
        rules, model, motor = self.rules, self.model, self.rules.motor
        end, blind = 2.0, self.time < self.since + BLIND - 1e-15
        conditions = dict(rules.conditions())
        conditions["fell"] = lambda _, y: abs(y[0] + y[1]) - 2.4
        if self.flies and self.left:
            apex = self.began + self.centre[1] / self.gravity
            if apex >= self.time:
                conditions["apex"] = lambda t, _: t - apex
        if blind:
            end = min(end, self.since + BLIND)
        elif self.flies:
            height, rate = self.foot(self.time, self.y)
            if height <= 0.0 and rate < 0.0:
                self._switch()
                return False
            conditions["contact"] = lambda t, y: -self.foot(t, y)[0]
        else:
            conditions["contact"] = lambda _, y: -hold(model, motor, *_pairs(y))
        for name, condition in conditions.items():
            if name not in ("apex", "touched", "waited", "contact") and (
                condition(self.time, self.y) > 1e-12
            ):
                return self._happen(name)
        if not self.flies and not blind and conditions["contact"](self.time, self.y) > 0.0:
            self._switch()
            return False
        self.pushing, beyond = [], [stop.depth(_pairs(self.y)[0]) > 0.0 for stop in model.stops]
        for stop, past in zip(model.stops, beyond, strict=True):
            sign = -1.0 if past else 1.0
            conditions[f"{stop} {past}"] = lambda _, y, stop=stop, sign=sign: (
                sign * stop.depth(_pairs(y)[0]) - 1e-13
            )
            if past:
                pushes = self._asked(stop, self.y)[0] > 0.0
                sign = -1.0 if pushes else 1.0
                conditions[f"{stop} {pushes} push"] = lambda _, y, stop=stop, sign=sign: (
                    sign * self._asked(stop, y)[0] - 1e-5
                )
                self.pushing += [stop] * pushes
        what = self._integrate(
            end, conditions, min(self.longest, 1e-3) if any(beyond) else self.longest
        )
        if what is None or what.startswith("Stop"):  # goes on with other stops
            return False
        return self._happen(what)

    def _asked(self, asking: Stop | None, y: Sequence[float]) -> tuple[float, tuple[float, float]]:
        """What the law asks of a stop before its own push, and accelerations [rad/s^2]."""
        q, v = _pairs(y)
        terms = self.model.falling if self.flies else self.model.stance
        torque, asked = self.model.torque(self.rules.motor, q, v), 0.0
        a = pair_acceleration(SCALAR, terms, q, v, torque)
        for stop in self.model.stops:
            answer = pair_solve(SCALAR, terms, q, stop.normal)
            if stop is asking:
                asked = stop.turn(q, v, a)
            if stop in self.pushing:
                push = stop.push(q, v, a, answer)
                a = a[0] + answer[0] * push, a[1] + answer[1] * push
        return asked, a

    def _happen(self, what: str) -> bool:
        if what == "contact":
            self._switch()
        elif what in ("fell", "apex"):
            self.story.ending = what
            q, v = self.y[:2], self.y[2:]
            z, dz, dx = self.centre
            t = self.time - self.began
            height = z + (dz - 0.5 * self.gravity * t) * t
            modal = (q[0] + q[1], q[1] - q[0], v[0] + v[1], v[1] - v[0])
            self.story.apex = (height, dx, *(SCALE * x for x in modal))
            if what == "apex" and self.rules.phase not in ("flight", "release"):
                self.story.ending = "fault"
            return True
        else:
            self.story.events.append((what, self.time))
            self.rules.obey(what, self.time, self.y[:2])
        return False

    def _switch(self) -> None:
        self.story.events.append(("touchdown" if self.flies else "liftoff", self.time))
        q, v = _pairs(self.y)
        pairs = list(zip(self.arm, q, v, strict=True))
        arm = (
            sum(a * math.sin(x) for a, x, _ in pairs),
            -sum(a * math.cos(x) for a, x, _ in pairs),
        )
        rate = (
            sum(a * math.cos(x) * w for a, x, w in pairs),
            sum(a * math.sin(x) * w for a, x, w in pairs),
        )
        if self.flies:
            _, dz, dx = self.centre
            foot = (dx + rate[0], dz - self.gravity * (self.time - self.began) + rate[1])
            model = self.model
            self.y[2:], _ = touchdown(SCALAR, model.stance, model.floating, q, v, foot)
        else:
            self.centre, self.began = (-arm[1], -rate[1], -rate[0]), self.time
            self.left = True
        self.flies, self.since = not self.flies, self.time

    def _integrate(
        self, end: float, conditions: dict[str, Condition], longest: float
    ) -> str | None:
        """Go on to the first condition that holds, or to the end."""

        def rates(_t: float, y: Any) -> list[float]:
            state = y.tolist()
            return [*state[2:], *self._asked(None, state)[1]]

        solver = DOP853(
            rates,
            self.time,
            np.array(self.y),
            end,
            rtol=self.tolerance,
            atol=0.01 * self.tolerance,
            max_step=longest,
        )
        while solver.status == "running":
            solver.step()
            if solver.status == "failed":
                raise RuntimeError("the reference failed")
            dense = solver.dense_output()
            times = np.linspace(dense.t_old, dense.t, LOOKS + 1)
            states: list[list[float]] = [state.tolist() for state in dense(times).T]
            found = self._first(dense, times.tolist(), states, conditions)
            if found is not None:
                name, self.time = found
                self.y = dense(self.time).tolist()
                self.rules.look(self.y[:2])
                return name
            self._extremes(dense, times.tolist(), states)
        self.time, self.y = float(solver.t), solver.y.tolist()
        return None

    def _extremes(self, dense: Any, times: list[float], states: list[list[float]]) -> None:
        """Let the rules see the largest and smallest fold of a step."""
        for state in states:
            self.rules.look(state[:2])
        turning = [self.rules.k2 * state[3] - self.rules.k1 * state[2] for state in states]

        def rate(t: float) -> float:
            y = dense(t)
            return float(self.rules.k2 * y[3] - self.rules.k1 * y[2])

        for i in range(1, LOOKS + 1):
            if turning[i - 1] * turning[i] < 0.0:
                self.rules.look(dense(_root(rate, times[i - 1], times[i]))[:2].tolist())

    def _first(
        self,
        dense: Any,
        times: list[float],
        states: list[list[float]],
        conditions: dict[str, Condition],
    ) -> tuple[str, float] | None:
        found: tuple[str, float] | None = None
        for name, condition in conditions.items():
            values = [condition(t, y) for t, y in zip(times, states, strict=True)]

            def at(t: float, condition: Condition = condition) -> float:
                return condition(t, dense(t).tolist())

            time = None
            for i in range(1, LOOKS + 1):
                if values[i] > 0.0 >= values[i - 1]:
                    time = _root(at, times[i - 1], times[i])
                    break
                if i < LOOKS and max(values[i - 1], values[i + 1]) < values[i] <= 0.0:
                    time = self._hidden(at, times[i - 1], times[i + 1], values[i])
                    if time is not None:
                        break
            if time is not None and (found is None or time < found[1]):
                found = (name, time)
        return found

    def _hidden(self, at: Any, begin: float, end: float, seen: float) -> float | None:
        """A crossing between two looks that both see none."""
        if seen < -0.2:
            return None
        best: Any = minimize_scalar(
            lambda t: -at(t), bounds=(begin, end), method="bounded", options={"xatol": 1e-9}
        )
        if -best.fun > 0.0:
            return _root(at, begin, float(best.x))
        self.story.closest = min(self.story.closest, float(best.fun))
        return None


def _root(at: Any, begin: float, end: float) -> float:
    solve: Any = brentq
    return float(solve(at, begin, end, xtol=1e-16, rtol=1e-15))


def _pairs(y: Sequence[float]) -> tuple[tuple[float, float], tuple[float, float]]:
    """Angles and rates of a state."""
    return (y[0], y[1]), (y[2], y[3])
