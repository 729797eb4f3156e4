"""The first orbit of a nonlinear mode: out of its linear mode, or around a resonance.

Where both linear modes have nearly one frequency, every shape is nearly a mode, and the smallest
imperfection of the numbers decides which two are found. The orbits of finite amplitude are not
arbitrary. They are followed from a set point at which the frequencies lie apart.
"""

import numpy as np

from legbench.errors import ConfigError
from legbench.modes.brake import BrakeShooting
from legbench.modes.linear import RADIAL, LinearMode, linear_modes
from legbench.modes.scene import Scene, make_scene
from legbench.signals import Floats

FIRST = 0.01
"""Amplitude at which a family starts, where the linear mode is near enough [rad]."""
APART = 0.05
"""Relative difference of the frequencies above which linear shapes tell the modes apart [-]."""
AMPLITUDE = 0.1
"""Amplitude at which modes are followed from one set point to another [rad]: they differ by the
square of it."""
REACH = 0.6
"""Largest difference of set points over which a mode is followed [rad]."""
SEARCHED = 0.02
"""Distance of the set points that are tried [rad]."""
STEPS = (8, 16, 32, 64)
"""Numbers of steps from one set point to the other that are tried in turn [-]."""


def gap(modes: dict[str, LinearMode]) -> float:
    """Relative difference of the two linear frequencies [-]."""
    radial, polar = modes["radial"].freq, modes["polar"].freq
    return abs(radial - polar) / (0.5 * (radial + polar))


def first_unknown(scene: Scene, name: str) -> tuple[BrakeShooting, Floats, float | None]:
    """Shooting, and a small orbit (3,) of the `radial` or `polar` mode.

    With it comes the set point from which the mode was followed [rad], if there is a resonance.

    Raises:
        ConfigError: the orbit does not exist.
    """
    modes = linear_modes(scene)
    if gap(modes) > APART:
        return *_near_linear(scene, modes[name], FIRST), None
    away = _apart(scene)
    shooting, unknown = _near_linear(away, linear_modes(away)[name], AMPLITUDE)
    for steps in STEPS:
        found = _carried(shooting, unknown, scene, name, steps)
        if found is not None:
            return *found, _set_point(away)
    raise ConfigError(
        f"the {name} mode cannot be followed from z2 = {_set_point(away):.4g} rad into the 1:1 "
        f"resonance at {_set_point(scene):.4g} rad; take a z2 further from it"
    )


def _near_linear(scene: Scene, mode: LinearMode, amplitude: float) -> tuple[BrakeShooting, Floats]:
    shooting = BrakeShooting(scene, mode.name, 0.5 / mode.freq)
    along = np.concatenate([mode.shape, [0.0]])
    solved = shooting.correct(np.array([*scene.rest, 1.0]) + amplitude * along, along)
    if solved is None:
        raise ConfigError(f"the {mode.name} mode has no orbit of {amplitude:g} rad at rest")
    return shooting, solved.unknown


def _set_point(scene: Scene) -> float:
    return float(RADIAL @ scene.rest)


def _apart(scene: Scene) -> Scene:
    """The leg at the nearest set point at which its frequencies lie apart."""
    for distance in np.arange(SEARCHED, REACH, SEARCHED):
        for sign in (1.0, -1.0):
            try:
                other = make_scene(scene.design, scene.kind, _set_point(scene) + sign * distance)
            except ConfigError:
                continue
            if gap(linear_modes(other)) > 2.0 * APART:
                return other
    raise ConfigError(
        f"the leg's two frequencies lie within {100.0 * APART:g} % of each other at every set "
        f"point within {REACH:g} rad of {_set_point(scene):.4g} rad: its modes cannot be told apart"
    )


def _carried(
    shooting: BrakeShooting, unknown: Floats, scene: Scene, name: str, steps: int
) -> tuple[BrakeShooting, Floats] | None:
    """An orbit followed from its set point to that of `scene`, at one amplitude along its axis."""
    axis = RADIAL if name == "radial" else np.abs(RADIAL)
    row = np.concatenate([axis, [0.0]])
    begin, end = _set_point(shooting.scene), _set_point(scene)
    rest = np.asarray(shooting.scene.rest)
    before: Floats | None = None
    for share in np.linspace(0.0, 1.0, steps + 1)[1:]:
        there = scene
        if share < 1.0:
            there = make_scene(scene.design, scene.kind, begin + float(share) * (end - begin))
        moved = unknown - np.array([*rest, 0.0])
        guess = moved if before is None else 2.0 * moved - before
        rest, before = np.asarray(there.rest), moved
        shooting = BrakeShooting(there, name, shooting.unit)
        solved = shooting.correct(guess + np.array([*rest, 0.0]), row)
        if solved is None:
            return None
        unknown = solved.unknown
    return shooting, unknown
