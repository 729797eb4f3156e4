"""The fast path: the same equations, compiled into Taylor integrators with event detection.

Compiling the two regimes of a leg takes about a second (extra `modes`); after that a hop costs a
tenth of a millisecond at an error near rounding. `varied` is the same leg on dual numbers.
"""

from dataclasses import replace
from typing import final

from legbench.analytic.compiled import MAX_EVENTS, SILENT, Compiled, Levels
from legbench.analytic.dual import DUAL
from legbench.analytic.equations import Pair
from legbench.analytic.formulas import Watched
from legbench.analytic.hybrid import overdue, switch
from legbench.analytic.model import LegModel
from legbench.analytic.smooth import Accuracy
from legbench.analytic.state import LegState, Regime, Transition
from legbench.errors import ConfigError, PlantFault

__all__ = ["MAP_TOLERANCE", "SILENT", "Levels", "TaylorLeg", "Watched"]

MAP_TOLERANCE = 1e-9
"""Tolerance for maps of many hops: a hop then errs by about 1e-8 and costs two thirds."""


@final
class TaylorLeg:
    """Integrates one leg from event to event; `advance` is that of `HybridLeg`.

    A probe `p1 q1 + p2 q2` can be watched on the way, for controllers that act on angles; who
    has none need not pay for it.

    Raises:
        ConfigError: a tolerance that is not positive.
    """

    def __init__(
        self,
        model: LegModel,
        *,
        probe: Pair | None = None,
        tolerance: float = 1e-15,
        min_phase: float = Accuracy().min_phase,
    ) -> None:
        if not tolerance > 0.0:
            raise ConfigError(f"tolerance is {tolerance:g}; it must be positive")
        self.model = model
        self._probe, self._min_phase = probe, min_phase
        self._tolerance = tolerance
        self._compiled: dict[Regime, Compiled] = {}
        self._varied: TaylorLeg | None = None

    @property
    def varied(self) -> "TaylorLeg":
        """This leg on dual numbers: what it returns carries derivatives (see `variation`).

        Given are the times and the state to start from, and levels; motors are plain numbers.
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
                after = switch(self.model, state)
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
        for _ in range(MAX_EVENTS):
            state, what = self._piece(state, until, motor, levels)
            if what is not Watched.STOP:
                return state, what
            self._leg(state.regime).switch_stop()
        raise PlantFault(
            "integration failed", f"integration failed at t = {state.time:.6f} s: a stop chatters"
        )

    def _piece(
        self, state: LegState, until: float, motor: Pair, levels: Levels
    ) -> tuple[LegState, Watched | None]:
        """Integrate as `watch` does, but no further than the next event of a joint stop."""
        leg = self._leg(state.regime)
        leg.load(state)
        leg.set(motor, levels)
        free = state.regime in (Regime.FLIGHT, Regime.STANCE)
        guard = state.since + self._min_phase
        if free and state.time < guard:
            what = leg.go(min(guard, until), contact=False)
            if what is not None or guard >= until:
                return leg.read(state), what
            state = leg.read(state)
        if free and overdue(self.model, state, motor):
            return state, Watched.CONTACT
        what = leg.go(until, contact=free)
        return leg.read(state), what

    def _leg(self, regime: Regime) -> Compiled:
        kind = Regime.STANCE if regime.stands else regime
        if kind not in self._compiled:
            self._compiled[kind] = Compiled(self.model, kind, self._probe, self._tolerance)
        return self._compiled[kind]

    def order(self, regime: Regime) -> int:
        """Order of the Taylor series that the tolerance asks for."""
        return int(self._leg(regime).integrator.order)

    def fixed_steps(self, state: LegState, step: float, count: int, motor: Pair) -> LegState:
        """Take steps of one length whatever the error, blind to events; to measure the order."""
        leg = self._leg(state.regime)
        leg.load(state)
        leg.set(motor, SILENT)
        leg.march(step, count)
        return leg.read(state)
