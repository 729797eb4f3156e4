"""Periodic response of the damped leg to motors that switch between two set points.

For half a period the motors hold z2 + dz2, for the other half z2 - dz2. The response is closed:
`phi_stretched(phi_folded(x)) = x`, four equations, and with the period as the fifth unknown a
curve, amplitude over frequency, followed through its turning points.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import final

import numpy as np

from legbench.design.statics import motor_holding
from legbench.errors import ConfigError
from legbench.modes.brake import beyond_limits
from legbench.modes.carry import Carrier
from legbench.modes.continuation import (
    LOST,
    MANY,
    Answer,
    CurvePoint,
    Refused,
    Stride,
    correct,
    trace,
)
from legbench.modes.linear import RADIAL, linear_modes
from legbench.modes.scene import SUPPORTED, Scene
from legbench.signals import Floats

CLOSED = 1e-10
"""Largest distance between the two ends of a closed response, scaled [-]."""
SAMPLES = 65
"""Number of states of each half at which range and joint limits are evaluated [-]."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Response:
    """Periodic motion under periodic motors."""

    start: Floats
    """State when the motors go to z2 + dz2 (4,) [rad, rad/s]."""
    folded: float
    """Duration of the motors' stay at z2 + dz2 [s]."""
    stretched: float
    """Duration of the motors' stay at z2 - dz2 afterwards [s]."""
    dz2: float
    """Amplitude of the motors [rad]."""
    radial: float
    """Half of the range of z2 [rad]."""
    polar: float
    """Half of the range of z1 [rad]."""
    multipliers: tuple[complex, ...]
    """Multipliers of the map from one period to the next, the largest first [-]."""
    outside: str
    """Joint that is beyond its limit on the way, and where; empty if none is."""

    @property
    def freq(self) -> float:
        """Frequency of the motors and of the leg [Hz]."""
        return 1.0 / (self.folded + self.stretched)

    @property
    def stable(self) -> bool:
        """Whether disturbances die out."""
        return abs(self.multipliers[0]) < 1.0


@dataclass(frozen=True, slots=True, kw_only=True)
class ResponseCurve:
    """Responses to motors of one amplitude, from the high frequencies to the low ones."""

    dz2: float
    responses: tuple[Response, ...]
    ended: str
    """Reason why there are no more, in words."""


@final
class Switched:
    """A leg whose motors are switched between two set points.

    Args:
        scene: the leg, how it is held, and the posture between the set points.
        damping: of both joints [N m s/rad].
    """

    def __init__(self, scene: Scene, damping: tuple[float, float]) -> None:
        self.scene, self.carrier = scene, Carrier(scene, damping)
        self.unit = 1.0 / linear_modes(scene)["radial"].freq
        second = self.unit / (2.0 * np.pi)
        self.size = np.array([1.0, 1.0, 1.0 / second, 1.0 / second])

    def motors(self, dz2: float) -> tuple[Floats, Floats]:
        """Motor positions (2,) that hold the link at z2 + dz2, and their derivative by dz2 (2,)."""
        q = np.asarray(self.scene.rest) + dz2 * RADIAL
        support = SUPPORTED[self.scene.kind]
        slope = np.asarray(self.scene.terms.moment) * np.cos(q)
        grown = (1.0 + slope / np.asarray(self.scene.model.stiffness)) * RADIAL
        return motor_holding(self.scene.design, q, support), grown

    def response(self, start: Floats, times: tuple[float, float], dz2: float) -> Response:
        """Range, limits and multipliers of a response that is closed."""
        state, paths, product = start, [], np.eye(4)
        for sign, time in zip((1.0, -1.0), times, strict=True):
            motor = self.motors(sign * dz2)[0]
            paths.append(self.carrier.path(state, np.linspace(0.0, time, SAMPLES), motor=motor))
            product = self.carrier.carry(state, time, motor=motor).by_start @ product
            state = paths[-1][-1]
        return self.described(start, times, dz2, np.vstack(paths)[:, :2], product)

    def described(
        self,
        start: Floats,
        times: tuple[float, float],
        dz2: float,
        path: Floats,
        product: Floats,
    ) -> Response:
        """The response with the postures `path` (n, 2) and the return map's derivative (4, 4)."""
        values = np.linalg.eigvals(product)
        return Response(
            start=start.copy(),
            folded=times[0],
            stretched=times[1],
            dz2=dz2,
            radial=float(np.ptp(path @ RADIAL) / 2.0),
            polar=float(np.ptp(path @ np.abs(RADIAL)) / 2.0),
            multipliers=tuple(complex(value) for value in values[np.argsort(-np.abs(values))]),
            outside=beyond_limits(self.scene, path),
        )

    def equations(self, dz2: float) -> Callable[[Floats], tuple[Floats, Floats]]:
        """The closed motion under a square wave, of unknowns (q1, q2, v1 s, v2 s, T / unit)."""
        motors = self.motors(dz2)[0], self.motors(-dz2)[0]

        def square(unknown: Floats) -> tuple[Floats, Floats]:
            start, half = unknown[:4] * self.size, 0.5 * float(unknown[4]) * self.unit
            first = self.carrier.carry(start, half, motor=motors[0])
            last = self.carrier.carry(first.end, half, motor=motors[1])
            slope = np.zeros((4, 5))
            slope[:, :4] = last.by_start @ first.by_start - np.eye(4)
            slope[:, 4] = 0.5 * (last.by_start @ first.rate + last.rate)
            return (
                (last.end - start) / self.size,
                slope * np.append(self.size, self.unit) / self.size[:, np.newaxis],
            )

        return square


def _check(damping: tuple[float, float], dz2: float) -> None:
    if not dz2 > 0.0:
        raise ConfigError(f"dz2 is {dz2:g} rad; motors that do not move excite nothing")
    if not min(damping) > 0.0:
        raise ConfigError(
            f"damping is {damping} N m s/rad; without it nothing bounds the response at resonance"
        )


def respond(
    scene: Scene,
    damping: tuple[float, float],
    dz2: float,
    *,
    fastest: float = 1.5,
    slowest: float = 0.6,
    most: int = 1000,
) -> ResponseCurve:
    """Follow the response to a square wave of the motors through the radial resonance.

    Args:
        scene: the leg, how it is held, and the posture between the set points.
        damping: of both joints [N m s/rad].
        dz2: amplitude of the motors [rad].
        fastest: frequency at which the curve begins, over that of the linear radial mode [-].
        slowest: frequency at which it ends [-].
        most: largest number of responses.

    Raises:
        ConfigError: an amplitude or a damping that is not positive, or one at which no response
            is found.
    """
    _check(damping, dz2)
    switched = Switched(scene, damping)
    equations = switched.equations(dz2)
    begin = np.array([*scene.rest, 0.0, 0.0, 1.0 / fastest])
    solved = correct(equations, begin, np.eye(5)[4], 1.0 / fastest, CLOSED)
    if solved is None:
        raise ConfigError(f"no response to motors of {dz2:g} rad is found; take a smaller dz2")
    found: list[Response] = []

    def visit(one: CurvePoint) -> Answer:
        period = float(one.unknown[4]) * switched.unit
        half = 0.5 * period
        response = switched.response(one.unknown[:4] * switched.size, (half, half), dz2)
        if response.outside:
            return Refused(f"{response.outside} at {response.freq:.4g} Hz")
        found.append(response)
        return "the slowest motors asked for" if one.unknown[4] >= 1.0 / slowest else None

    answer = visit(solved)
    if isinstance(answer, Refused):
        raise ConfigError(f"motors of {dz2:g} rad take the leg too far: {answer.why}")
    ended = trace(equations, solved, Stride(first=0.01, longest=0.02, most=most), CLOSED, visit)
    lost = f"no response continues it at {found[-1].freq:.4g} Hz"
    said = {LOST: lost, MANY: f"{most} responses"}
    return ResponseCurve(dz2=dz2, responses=tuple(found), ended=said.get(ended, ended))
