"""The conservative flow of two angles, with exact derivatives by complex steps."""

import numpy as np
from scipy.integrate import solve_ivp

from legbench.errors import ConfigError
from legbench.modes.scene import Scene
from legbench.signals import Floats

RTOL, ATOL = 1e-11, 1e-13
"""A brake orbit is closed to about 1e-10."""
TINY = 1e-40
"""Imaginary step: squares of it vanish, so the derivative is exact to rounding."""


def flow(scene: Scene, start: Floats, time: float, directions: Floats) -> tuple[Floats, Floats]:
    """State (4,) after `time` [s], and its derivative along each of `directions` (4, n).

    Raises:
        ConfigError: the leg runs away from there.
    """
    ends = [_complex_flow(scene, start + TINY * 1j * column, time) for column in directions.T]
    return ends[0].real, np.stack([end.imag / TINY for end in ends], axis=-1)


def _complex_flow(scene: Scene, start: Floats, time: float) -> Floats:
    def rates(_time: float, y: Floats) -> list[complex]:
        return scene.rates(y.tolist())

    solved = solve_ivp(
        rates, (0.0, time), start.astype(np.complex128), method="DOP853", rtol=RTOL, atol=ATOL
    )
    if not solved.success:
        raise ConfigError(f"the leg cannot be followed for {time:.3g} s: {solved.message}")
    return solved.y[:, -1]


def orbit(scene: Scene, posture: Floats, time: float, count: int) -> Floats:
    """Postures (count, 2) over `time` [s] of a leg let go at rest from `posture` (2,)."""

    def rates(_time: float, y: Floats) -> list[float]:
        return [float(value.real) for value in scene.rates(y.tolist())]

    start = np.concatenate([posture, [0.0, 0.0]])
    times = np.linspace(0.0, time, count)
    solved = solve_ivp(
        rates, (0.0, time), start, method="DOP853", rtol=RTOL, atol=ATOL, t_eval=times
    )
    if not solved.success:
        raise ConfigError(f"the leg cannot be followed for {time:.3g} s: {solved.message}")
    return solved.y[:2].T
