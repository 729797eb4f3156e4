"""Fast integration of a leg by compiled Taylor integrators with event detection.

No parameter of a leg is compiled in (`places`), so a new leg or setup needs no compilation, and the
compiled code is kept on disk (`store`). `TaylorLeg` goes from state to state; its `course` is
faster if the states at events are not needed. `varied` is the same leg on dual numbers.
"""

from dataclasses import replace
from typing import final

from legbench.analytic.compiled import TOLERANCE, event_integrator, steady_point
from legbench.analytic.compiled_regime import KINDS, SILENT, Levels
from legbench.analytic.contact import MIN_PHASE
from legbench.analytic.course import Course
from legbench.analytic.dual import DUAL
from legbench.analytic.equations import Pair, sweep_motion
from legbench.analytic.model import LegModel
from legbench.analytic.parameters import Kind, Watched
from legbench.analytic.state import LegState, Regime, Transition
from legbench.errors import ConfigError

__all__ = ["MAP_TOLERANCE", "SILENT", "Levels", "TaylorLeg", "Watched"]

MAP_TOLERANCE = 1e-9
"""Tolerance for maps of many hops [-]: a hop then has an error of about 1e-8, at two thirds of the
cost."""


@final
class TaylorLeg:
    """Compiled leg that is integrated from event to event, with the `advance` of `HybridLeg`.

    A probe `p1 q1 + p2 q2` can be watched on the way, for controllers that act on angles.

    Attributes:
        model: the leg.
        course: the integration behind `watch` and `advance`, which makes no states on the way.

    Raises:
        ConfigError: a tolerance that is not positive.
    """

    def __init__(
        self,
        model: LegModel,
        *,
        probe: Pair | None = None,
        tolerance: float = TOLERANCE,
        min_phase: float = MIN_PHASE,
    ) -> None:
        if not tolerance > 0.0:
            raise ConfigError(f"tolerance is {tolerance:g}; it must be positive")
        self.model = model
        self._probe, self._min_phase, self._tolerance = probe, min_phase, tolerance
        self.course = Course(model, probe=probe, tolerance=tolerance, min_phase=min_phase)
        self._varied: TaylorLeg | None = None

    @property
    def varied(self) -> "TaylorLeg":
        """This leg on dual numbers, whose results carry derivatives (see `variation`).

        The derivatives are those by the seeds in times, start, levels and motors.
        """
        if self._varied is None:
            self._varied = TaylorLeg(
                replace(self.model, ops=DUAL),
                probe=self._probe,
                tolerance=self._tolerance,
                min_phase=self._min_phase,
            )
        return self._varied

    def advance(
        self, state: LegState, until: float, motor: Pair
    ) -> tuple[LegState, list[Transition]]:
        """State of the leg at `until`, motors held at `motor`, and the transitions on the way.

        Raises:
            PlantFault: the integration failed.
        """
        happened: list[Transition] = []
        while state.time < until:
            state, what = self.watch(state, until, motor, SILENT)
            if what is Watched.CONTACT:
                self.course.switch()
                after = self._state()
                happened.append(Transition(time=state.time, before=state, after=after))
                state = after
        return state, happened

    def watch(
        self, state: LegState, until: float, motor: Pair, levels: Levels
    ) -> tuple[LegState, Watched | None]:
        """Integrate to `until`, or to the first watched event, which is not yet applied.

        Raises:
            PlantFault: the integration failed.
        """
        course = self.course
        if state is not course.told:
            self._start(state)
        course.hold(motor)
        what = course.go(until, levels)
        return self._state(), what

    def order(self, regime: Regime) -> int:
        """Order of the Taylor series that the tolerance asks for."""
        kind = KINDS.get(regime, Kind.FIXED)
        return int(event_integrator(kind, self._tolerance).order)

    def fixed_steps(self, state: LegState, step: float, count: int, motor: Pair) -> LegState:
        """Take steps of one length without error control and events, to measure the order."""
        course = self.course
        self._start(state)
        course.hold(motor)
        for _ in range(count):
            course.compiled.integrator.step(step)
        course.time = course.began + count * step
        q1, q2, v1, v2 = course.compiled.state.tolist()
        course.q, course.v = (q1, q2), (v1, v2)
        return self._state()

    def _start(self, state: LegState) -> None:
        """Set the course to a state."""
        ops, along = self.model.ops, steady_point(self.model, state.regime)
        inner, inner_vel = sweep_motion(ops, state.q, state.v, along)
        height = 0.0 if state.regime.stands else state.trunk_pos[1] + inner[1]
        point, drift = (state.trunk_pos[0] + inner[0], height), (0.0, 0.0)
        if state.regime is Regime.FLIGHT:
            drift = state.trunk_vel[0] + inner_vel[0], state.trunk_vel[1] + inner_vel[1]
        self.course.time, self.course.since = state.time, state.since
        self.course.begin(state.regime, state.q, state.v, point, drift)

    def _state(self) -> LegState:
        """State of the leg at the present time of the course."""
        course = self.course
        along = steady_point(self.model, course.regime)
        point, drift = course.centre() if course.compiled.flies else (course.point, course.drift)
        inner, inner_vel = sweep_motion(self.model.ops, course.q, course.v, along)
        course.told = LegState(
            time=course.time,
            regime=course.regime,
            q=course.q,
            v=course.v,
            trunk_pos=(point[0] - inner[0], point[1] - inner[1]),
            trunk_vel=(drift[0] - inner_vel[0], drift[1] - inner_vel[1]),
            since=course.since,
        )
        return course.told
