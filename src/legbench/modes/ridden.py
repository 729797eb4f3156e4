"""Limit cycles of bang-bang, followed by growing amplitude of the motors.

Bang-bang switches its motors itself, when the spring torque along z2, zero at rest, passes
`+threshold` (to z2 + dz2) or `-threshold` (to z2 - dz2). Its limit cycle is closed, and both
switches happen at their torque: six equations for the state at a switch, the two durations and
dz2. So the cycles form a curve. Every cycle is a response to motors of its own amplitude and duty.
"""

from dataclasses import dataclass

import numpy as np

from legbench.errors import ConfigError
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
from legbench.modes.linear import RADIAL
from legbench.modes.response import CLOSED, SAMPLES, Response, Switched
from legbench.modes.roots import bracketed
from legbench.modes.scene import Scene
from legbench.signals import Floats

SETTLING = 60
"""Number of periods for which the law is followed before its cycle is solved [-]."""
LOOKED = 40
"""Number of instants of a linear period at which a switch is sought [-]."""
LONGEST = 3.0
"""Longest time without a switch, in linear periods [-]."""


@dataclass(frozen=True, slots=True, kw_only=True)
class RiddenCurve:
    """Limit cycles of bang-bang by growing dz2."""

    threshold: float
    """Modal spring torque that switches [N m]."""
    cycles: tuple[Response, ...]
    ended: str
    """Reason why there are none with larger dz2, in words."""


class _Law:
    """Bang-bang in continuous time, on the equations of a switched leg."""

    def __init__(self, switched: Switched, threshold: float) -> None:
        self.switched, self.threshold = switched, threshold
        scene = switched.scene
        self._pull = np.asarray(scene.model.stiffness) * RADIAL
        self._rest = float(self._pull @ (np.asarray(scene.motor) - np.asarray(scene.rest)))

    def torque(self, state: Floats, motor: Floats) -> float:
        """Spring torque along z2 above that at rest [N m]."""
        return float(self._pull @ (motor - state[:2])) - self._rest

    def equations(self, unknown: Floats) -> tuple[Floats, Floats]:
        """Closure and torques at both switches (6,), and their derivative (6, 7).

        Unknowns are (q1, q2, v1 s, v2 s, T_folded / unit, T_stretched / unit, dz2).
        """
        switched, carrier = self.switched, self.switched.carrier
        start, times = unknown[:4] * switched.size, unknown[4:6] * switched.unit
        slope = np.zeros((6, 7))
        residual = np.zeros(6)
        state, moved = start, np.zeros((4, 7))
        moved[:, :4] = np.eye(4)
        for index, (sign, time) in enumerate(zip((1.0, -1.0), times.tolist(), strict=True)):
            motor, grown = switched.motors(sign * float(unknown[6]))
            done = carrier.carry(state, time, motor=motor)
            moved = done.by_start @ moved
            moved[:, 4 + index] += done.rate
            moved[:, 6] += done.by_parameters[:, -2:] @ (sign * grown)
            state = done.end
            residual[4 + index] = self.torque(state, motor) + sign * self.threshold
            slope[4 + index] = -self._pull @ moved[:2]
            slope[4 + index, 6] += self._pull @ (sign * grown)
        residual[:4] = (state - start) / switched.size
        slope[:4] = moved
        slope[:4, :4] -= np.eye(4)
        slope[:4] /= switched.size[:, np.newaxis]
        unit = switched.unit
        return residual, slope * np.array([*switched.size, unit, unit, 1.0])

    def settle(self, dz2: float) -> Floats:
        """Unknowns (7,) near the cycle: the law followed from rest for a while."""
        state = start = np.array([*self.switched.scene.rest, 0.0, 0.0])
        times = [0.0, 0.0]
        # The first switch goes to the longer leg; torques are those of a leg that has just rested.
        sign = -1.0
        for _ in range(2 * SETTLING):
            motor = self.switched.motors(sign * dz2)[0]
            if sign > 0.0:
                start = state
            time, state = self._until_switch(state, motor, sign)
            times[0 if sign > 0.0 else 1] = time
            sign = -sign
        scaled = start / self.switched.size
        return np.array([*scaled, *(np.array(times) / self.switched.unit), dz2])

    def _until_switch(self, state: Floats, motor: Floats, sign: float) -> tuple[float, Floats]:
        """Time [s] and state when the torque next passes the threshold that ends a half."""
        carrier, unit = self.switched.carrier, self.switched.unit
        grid = np.linspace(0.0, LONGEST * unit, round(LONGEST * LOOKED) + 1)
        path = carrier.path(state, grid, motor=motor)
        past = np.array([sign * self.torque(row, motor) + self.threshold for row in path])
        passed = np.flatnonzero((past[1:] < 0.0) & (past[:-1] >= 0.0))
        if len(passed) == 0:
            raise ConfigError(
                f"bang-bang stops switching: the torque does not pass {self.threshold:g} N m; "
                "lower the threshold or raise dz2"
            )
        near = path[passed[0]]

        def at(time: float) -> Floats:
            return carrier.path(near, np.array([0.0, time]), motor=motor)[-1] if time else near

        def off(time: float) -> float:
            return sign * self.torque(at(time), motor) + self.threshold

        time = bracketed(off, 0.0, unit / LOOKED, 1e-12)
        return float(grid[passed[0]]) + time, at(time)

    def cycle(self, unknown: Floats) -> Response:
        """The cycle of solved unknowns (7,), with the multipliers of the law's own map."""
        switched, carrier = self.switched, self.switched.carrier
        start, times = unknown[:4] * switched.size, unknown[4:6] * switched.unit
        dz2 = float(unknown[6])
        state, product, paths = start, np.eye(4), []
        for sign, time in zip((1.0, -1.0), times.tolist(), strict=True):
            motor = switched.motors(sign * dz2)[0]
            paths.append(carrier.path(state, np.linspace(0.0, time, SAMPLES), motor=motor))
            done = carrier.carry(state, time, motor=motor)
            normal = np.concatenate([self._pull, [0.0, 0.0]])
            # The switch comes later for a neighbour that reaches its torque later.
            shift = np.outer(done.rate, normal) / float(normal @ done.rate)
            product = (np.eye(4) - shift) @ done.by_start @ product
            state = done.end
        path = np.vstack(paths)[:, :2]
        return switched.described(start, (times[0], times[1]), dz2, path, product)


def _check(scene: Scene, threshold: float, dz2: float, largest: float) -> None:
    limit = min(scene.model.stiffness) * dz2
    if not 0.0 < threshold < limit:
        raise ConfigError(
            f"threshold is {threshold:g} N m; it must be positive and below k dz2 = {limit:.3g} N m"
        )
    if not largest > dz2:
        raise ConfigError(f"the largest dz2 is {largest:g} rad; it must exceed the first, {dz2:g}")


def ride(
    scene: Scene,
    damping: tuple[float, float],
    threshold: float,
    dz2: float,
    largest: float,
    *,
    most: int = 80,
) -> RiddenCurve:
    """Limit cycles of bang-bang from an amplitude of the motors up to the largest one [rad].

    Args:
        scene: the leg, how it is held, and the posture between the set points.
        damping: of both joints [N m s/rad].
        threshold: modal spring torque that switches [N m].
        dz2: amplitude of the motors at which the law is started from rest [rad].
        largest: up to which its cycles are followed [rad].
        most: largest number of cycles.

    Raises:
        ConfigError: a threshold that the law cannot pass, amplitudes out of order, or no cycle.
    """
    _check(scene, threshold, dz2, largest)
    law = _Law(Switched(scene, damping), threshold)
    row = np.eye(7)[6]
    solved = correct(law.equations, law.settle(dz2), row, dz2, CLOSED)
    if solved is None:
        raise ConfigError(f"bang-bang with dz2 = {dz2:g} rad does not settle on a cycle")
    found: list[Response] = []

    def visit(one: CurvePoint) -> Answer:
        cycle = law.cycle(one.unknown)
        if cycle.outside:
            last = found[-1].dz2 if found else dz2
            return Refused(f"{cycle.outside} beyond dz2 = {last:.4g} rad")
        found.append(cycle)
        return "the largest dz2 asked for" if cycle.dz2 >= largest else None

    answer = visit(solved)
    if isinstance(answer, Refused):
        raise ConfigError(f"bang-bang with dz2 = {dz2:g} rad takes the leg too far: {answer.why}")
    stride = Stride(first=0.02, longest=0.05, most=most)
    ended = trace(law.equations, solved.towards(row), stride, CLOSED, visit)
    lost = f"no cycle continues it at dz2 = {found[-1].dz2:.4g} rad"
    said = {LOST: lost, MANY: f"{most} cycles"}
    return RiddenCurve(threshold=threshold, cycles=tuple(found), ended=said.get(ended, ended))
