"""Compiled equations: one integrator for each regime, with all numbers of a leg as parameters.

The state is (q1, q2, v1, v2) in every regime: the leg turns about a point that does not depend on
its angles, the centre of mass on its parabola in flight, the foot in stance, the held trunk. So
one set of equations serves all, and regimes differ in their parameters and events.

Each integrator is compiled once on a machine (`store`) and copied for each leg that uses it.
"""

import copy
from functools import cache
from typing import Any

import numpy as np

from legbench.analytic._heyoka import heyoka as hy
from legbench.analytic.equations import Pair
from legbench.analytic.formulas import STATE, events, smooth_system, stopped_system
from legbench.analytic.model import LegModel
from legbench.analytic.parameters import (
    ALONG,
    COUPLING,
    DAMPING,
    FREE_COUPLING,
    FREE_INERTIA,
    FRICTION,
    GRAVITY,
    INERTIA,
    LEVEL,
    MOMENT,
    MOTOR,
    PROBE,
    SHARPNESS,
    SMOOTH,
    STIFFNESS,
    Event,
    Kind,
)
from legbench.analytic.state import Regime
from legbench.analytic.store import kept
from legbench.analytic.terms import PairTerms

TOLERANCE = 1e-15
"""Error of a step over the largest of state and events [-]."""
COOLDOWN = 1e-8
"""Time within which an event cannot occur again; long against rounding, short against the leg's
motion [s]."""
OPTIMISED = 1
"""Level of the compiler's optimisation, whose code is as fast as that of the highest, 3."""
PARAMETERS = LEVEL + len(Event)
"""Length of the array of parameters of a leg."""


def event_integrator(kind: Kind, tolerance: float = TOLERANCE) -> Any:
    """New integrator of one regime with its events; its parameters have still to be set."""
    return copy.deepcopy(_events(kind, tolerance))


def varied_integrator(tolerance: float = TOLERANCE) -> Any:
    """New integrator of the equations with stops and of their derivatives, without events.

    The derivatives are those by the four states and the `SMOOTH` parameters of the motion, in this
    order, one row a state.
    """
    return copy.deepcopy(_varied(tolerance))


def free_integrator(tolerance: float = TOLERANCE) -> Any:
    """New integrator of one leg without stops, events and derivatives."""
    return copy.deepcopy(_free(tolerance))


def smooth_integrator(
    tolerance: float, *, varied: bool, friction: bool, guide: bool = False
) -> Any:
    """New integrator of a batch of legs, without stops and events.

    `varied` adds the derivatives by the nine parameters of a leg, and by its friction if any.
    """
    return copy.deepcopy(_smooth(tolerance, hy.recommended_simd_size(), varied, friction, guide))


def sensitive_integrator(tolerance: float, lanes: int, *, friction: bool) -> Any:
    """New integrator of a batch of legs and of their derivatives, without stops and events.

    The derivatives are those by the four states and by the parameters of the motion, the motors
    among them, and by the friction if there is any: `sensitive_seeds`.
    """
    return copy.deepcopy(_sensitive(tolerance, lanes, friction))


@cache
def _events(kind: Kind, tolerance: float) -> Any:
    system, pushes = stopped_system()
    watched = list(events(kind, (system[2][1], system[3][1]), pushes).values())

    def build() -> Any:
        rising = hy.event_direction.positive
        return hy.taylor_adaptive(
            system,
            [0.0] * len(system),
            t_events=[hy.t_event(one, direction=rising, cooldown=COOLDOWN) for one in watched],
            tol=tolerance,
            fast_math=True,  # a third faster, without loss of accuracy
            opt_level=OPTIMISED,
        )

    return kept(f"events {OPTIMISED} {tolerance!r} {COOLDOWN!r} {system} {watched}", build)


@cache
def _varied(tolerance: float) -> Any:
    system, _ = stopped_system()
    seeds = [*STATE, *(hy.par[place] for place in range(SMOOTH))]

    def build() -> Any:
        return hy.taylor_adaptive(
            hy.var_ode_sys(system, seeds),
            [0.0] * len(system),
            tol=tolerance,
            fast_math=True,
            compact_mode=True,  # slower, but compiled in a second instead of a minute
            opt_level=OPTIMISED,
        )

    return kept(f"varied {tolerance!r} {system} {seeds}", build)


@cache
def _free(tolerance: float) -> Any:
    system = smooth_system(friction=False)

    def build() -> Any:
        return hy.taylor_adaptive(
            system, [0.0] * len(system), tol=tolerance, fast_math=True, opt_level=OPTIMISED
        )

    return kept(f"free {tolerance!r} {system}", build)


@cache
def _smooth(tolerance: float, lanes: int, varied: bool, friction: bool, guide: bool) -> Any:
    system = smooth_system(friction=friction, guide=guide)
    seeds = [hy.par[place] for place in smooth_seeds(friction=friction)] if varied else []

    def build() -> Any:
        return hy.taylor_adaptive_batch(
            hy.var_ode_sys(system, seeds) if varied else system,
            np.zeros((len(system), lanes)),
            tol=tolerance,
            fast_math=True,
            compact_mode=varied,
        )

    return kept(f"smooth {tolerance!r} {lanes} {system} {seeds}", build)


@cache
def _sensitive(tolerance: float, lanes: int, friction: bool) -> Any:
    system = smooth_system(friction=friction)
    seeds = [*STATE, *(hy.par[place] for place in sensitive_seeds(friction=friction))]

    def build() -> Any:
        return hy.taylor_adaptive_batch(
            hy.var_ode_sys(system, seeds),
            np.zeros((len(system), lanes)),
            tol=tolerance,
            fast_math=True,
            compact_mode=True,  # as in `_varied`, for the sake of compilation
            opt_level=OPTIMISED,
        )

    return kept(f"sensitive {tolerance!r} {lanes} {system} {seeds}", build)


def sensitive_seeds(*, friction: bool) -> range:
    """Indices of the parameters by which `sensitive_integrator` differentiates."""
    return range(SHARPNESS if friction else SMOOTH)


def smooth_seeds(*, friction: bool) -> list[int]:
    """Indices of the parameters by which a batch of legs is differentiated."""
    return [*range(MOTOR), *(range(FRICTION, SHARPNESS) if friction else ())]


def terms_of(model: LegModel, regime: Regime) -> PairTerms:
    """Constants of the motion of the angles about the steady point of a regime."""
    match regime:
        case Regime.FLIGHT:
            return model.falling
        case Regime.HANGING:
            return model.hanging
        case _:
            return model.stance


def steady_point(model: LegModel, regime: Regime) -> Pair:
    """Steady point seen from the hip, as its components along dir(q1) and dir(q2) [m]."""
    floating = model.floating
    match regime:
        case Regime.FLIGHT:
            return floating.first[0] / floating.mass, floating.first[1] / floating.mass
        case Regime.HANGING:
            return 0.0, 0.0
        case _:
            return floating.reach, floating.reach


def foot_from_centre(model: LegModel) -> Pair:
    """Foot tip seen from the centre of mass, as its components along dir(q1) and dir(q2) [m]."""
    floating = model.floating
    first_1, first_2 = floating.first
    return floating.reach - first_1 / floating.mass, floating.reach - first_2 / floating.mass


def parameters_of(model: LegModel, regime: Regime, probe: Pair) -> list[float]:
    """Parameters of one leg in one regime (`PARAMETERS`,), events switched off, motors at zero."""
    terms, values = terms_of(model, regime), [0.0] * PARAMETERS
    along_1, along_2 = foot_from_centre(model)
    if regime is not Regime.FLIGHT:
        along_1, along_2 = -along_1, -along_2
    for place, pair in (
        (INERTIA, terms.inertia),
        (MOMENT, terms.moment),
        (STIFFNESS, model.stiffness),
        (DAMPING, model.damping),
        (PROBE, probe),
        (ALONG, (along_1, along_2)),
        (FREE_INERTIA, model.falling.inertia),
    ):
        values[place : place + 2] = pair
    values[COUPLING], values[FREE_COUPLING] = terms.coupling, model.falling.coupling
    values[GRAVITY] = model.floating.gravity
    values[LEVEL:] = [1.0] * len(Event)
    return values
