"""The fast path: the same equations, compiled into Taylor integrators with event detection.

Nothing of a leg is compiled in (`places`), so a leg or a setup that is new costs nothing, and the
compiled code is kept on disk (`store`). `TaylorLeg` follows states from event to event; who follows
one leg for long asks for its `course`. `varied` is the same leg on dual numbers.
"""

from dataclasses import replace
from typing import final

from legbench.analytic.compiled import TOLERANCE, event_integrator
from legbench.analytic.contact import MIN_PHASE
from legbench.analytic.course import Course
from legbench.analytic.dual import DUAL
from legbench.analytic.equations import Pair
from legbench.analytic.lookout import KINDS, SILENT, Levels
from legbench.analytic.model import LegModel
from legbench.analytic.places import Kind, Watched
from legbench.analytic.state import LegState, Regime, Transition
from legbench.errors import ConfigError

__all__ = ["MAP_TOLERANCE", "SILENT", "Levels", "TaylorLeg", "Watched"]

MAP_TOLERANCE = 1e-9
"""Tolerance for maps of many hops: a hop then errs by about 1e-8 and costs two thirds."""


@final
class TaylorLeg:
    """Integrates one leg from event to event; `advance` is that of `HybridLeg`.

    A probe `p1 q1 + p2 q2` can be watched on the way, for controllers that act on angles.

    Attributes:
        model: the leg.
        course: what `watch` and `advance` follow; faster for who needs no states on the way.

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
        """This leg on dual numbers: what it returns carries derivatives (see `variation`).

        Given are the times and the state to start from, levels and motors.
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
        """The leg at `until`, motors held at `motor`, and what happened until then.

        Raises:
            PlantFault: the integration failed.
        """
        happened: list[Transition] = []
        while state.time < until:
            state, what = self.watch(state, until, motor, SILENT)
            if what is Watched.CONTACT:
                self.course.switch()
                after = self.course.state()
                happened.append(Transition(time=state.time, before=state, after=after))
                state = after
        return state, happened

    def watch(
        self, state: LegState, until: float, motor: Pair, levels: Levels
    ) -> tuple[LegState, Watched | None]:
        """Go on until `until` or to the first thing watched, just before it takes effect.

        Raises:
            PlantFault: the integration failed.
        """
        course = self.course
        if state is not course.told:
            course.start(state)
        course.hold(motor)
        what = course.go(until, levels)
        return course.state(), what

    def order(self, regime: Regime) -> int:
        """Order of the Taylor series that the tolerance asks for."""
        kind = KINDS.get(regime, Kind.FIXED)
        return int(event_integrator(kind, self._tolerance).order)

    def fixed_steps(self, state: LegState, step: float, count: int, motor: Pair) -> LegState:
        """Take steps of one length whatever the error, blind to events; to measure the order."""
        self.course.start(state)
        self.course.hold(motor)
        self.course.march(step, count)
        return self.course.state()
