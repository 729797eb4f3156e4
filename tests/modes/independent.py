"""Oscillations of a leg by another path: Appendix I in numpy, DOP853, differences."""

import numpy as np
from scipy.integrate import solve_ivp

from legbench.design.statics import motor_holding
from legbench.modes.scene import SUPPORTED, Scene


def acceleration(scene: Scene, q: np.ndarray, v: np.ndarray, torque: np.ndarray) -> np.ndarray:
    """From kinetic and potential energy, the first by its inertia matrix."""
    terms = scene.terms
    c, s = np.cos(q[0] - q[1]), np.sin(q[0] - q[1])
    mass = np.array(
        [[terms.inertia[0], terms.coupling * c], [terms.coupling * c, terms.inertia[1]]]
    )
    swirl = terms.coupling * s * np.array([v[1] ** 2, -(v[0] ** 2)])
    return np.linalg.solve(mass, torque - swirl - np.asarray(terms.moment) * np.sin(q))


def moved(
    scene: Scene,
    start: np.ndarray,
    time: float,
    *,
    damping: tuple[float, float] = (0.0, 0.0),
    motor: np.ndarray | None = None,
) -> np.ndarray:
    """State (4,) after a time [s]."""
    held = np.asarray(scene.motor) if motor is None else motor

    def rates(_time: float, y: np.ndarray) -> np.ndarray:
        q, v = y[:2], y[2:]
        torque = np.asarray(scene.model.stiffness) * (held - q) - np.array(damping) * v
        return np.concatenate([v, acceleration(scene, q, v, torque)])

    solved = solve_ivp(rates, (0.0, time), start, method="DOP853", rtol=1e-12, atol=1e-13)
    return solved.y[:, -1]


def differences(scene: Scene, start: np.ndarray, time: float, step: float = 1e-5) -> np.ndarray:
    """Derivative of the state after a time by that at the start (4, 4)."""
    columns = []
    for index in range(4):
        aside = step * np.eye(4)[index]
        ends = [moved(scene, start + sign * aside, time) for sign in (1.0, -1.0)]
        columns.append((ends[0] - ends[1]) / (2.0 * step))
    return np.stack(columns, axis=-1)


def motors_at(scene: Scene, dz2: float) -> np.ndarray:
    """Motors that hold the link at z2 + dz2."""
    q = np.asarray(scene.rest) + dz2 * np.array([-1.0, 1.0]) / np.sqrt(2.0)
    return motor_holding(scene.design, q, SUPPORTED[scene.kind])


def straight_period(scene: Scene, start: np.ndarray) -> float:
    """Period of a leg let go at rest on x1 = 0, from when it next turns round."""

    def rates(_time: float, y: np.ndarray) -> np.ndarray:
        q, v = y[:2], y[2:]
        torque = np.asarray(scene.model.stiffness) * (np.asarray(scene.motor) - q)
        return np.concatenate([v, acceleration(scene, q, v, torque)])

    def turning(_time: float, y: np.ndarray) -> float:
        return float(y[3] - y[2])

    turning.terminal, turning.direction = True, 1.0  # type: ignore[attr-defined]
    solved = solve_ivp(
        rates, (0.0, 5.0), start, method="DOP853", events=turning, rtol=1e-12, atol=1e-13
    )
    return 2.0 * float(solved.t_events[0][0])


def polar_trace(scene: Scene, start: np.ndarray, period: float) -> float:
    """Trace of what a period does to z1 and its rate, on an orbit on x1 = 0 of a matched leg.

    There the polar motion is decoupled to first order, by symmetry; complex steps take it along.
    """

    def rates(_time: float, y: np.ndarray) -> np.ndarray:
        q, v = y[:2], y[2:]
        torque = np.asarray(scene.model.stiffness) * (np.asarray(scene.motor) - q)
        return np.concatenate([v, acceleration(scene, q, v, torque)])

    total = 0.0
    for index in (0, 2):
        aside = np.zeros(4)
        aside[index : index + 2] = 1.0
        first = start.astype(np.complex128) + 1e-30j * aside
        solved = solve_ivp(rates, (0.0, period), first, method="DOP853", rtol=1e-12, atol=1e-13)
        end = solved.y[:, -1].imag / 1e-30
        total += 0.5 * float(end[index] + end[index + 1])
    return total


def bang_bang(
    scene: Scene,
    start: np.ndarray,
    damping: tuple[float, float],
    dz2: float,
    threshold: float,
    periods: int,
) -> tuple[np.ndarray, np.ndarray]:
    """State (4,) after some periods of the law, begun when it has just folded, and their times."""
    pull = np.asarray(scene.model.stiffness) * np.array([-1.0, 1.0]) / np.sqrt(2.0)
    zero = float(pull @ (np.asarray(scene.motor) - np.asarray(scene.rest)))
    state, durations = start, []
    for _ in range(periods):
        for sign in (1.0, -1.0):
            motor = motors_at(scene, sign * dz2)

            def rates(_time: float, y: np.ndarray, motor: np.ndarray = motor) -> np.ndarray:
                q, v = y[:2], y[2:]
                torque = np.asarray(scene.model.stiffness) * (motor - q) - np.array(damping) * v
                return np.concatenate([v, acceleration(scene, q, v, torque)])

            def past(
                _time: float, y: np.ndarray, motor: np.ndarray = motor, sign: float = sign
            ) -> float:
                return sign * (float(pull @ (motor - y[:2])) - zero) + threshold

            past.terminal, past.direction = True, -1.0  # type: ignore[attr-defined]
            solved = solve_ivp(
                rates, (0.0, 3.0), state, method="DOP853", events=past, rtol=1e-10, atol=1e-12
            )
            state = solved.y[:, -1]
            durations.append(float(solved.t[-1]))
    return state, np.array(durations)
