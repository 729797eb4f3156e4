"""First guess by linear regression: the equations of motion on smoothed angles.

With angles, rates and accelerations given, the equations are linear in inertias, first moments,
stiffness, damping and friction (Atkeson, An and Hollerbach 1986), so that one linear solution needs
no start of its own. A Gaussian kernel and its derivatives act on all linear terms alike, so that
what they smooth away is in none of them. Noise biases the solution by some percent, inertias most.
"""

from collections.abc import Sequence
from typing import Final

import numpy as np

from legbench.analytic.parameters import (
    COUPLING,
    DAMPING,
    FRICTION,
    INERTIA,
    MOMENT,
    SHARPNESS,
    STIFFNESS,
)
from legbench.identify.base import FRICTION_WIDTH, equation_parameters, mended
from legbench.identify.parameters import INDEX, NINE, PARAMETERS, Freedom
from legbench.identify.prediction import Guess
from legbench.identify.trial import FitTrial
from legbench.signals import Floats

WIDTH: Final = 1e-2
"""Standard deviation of the smoothing kernel [s]. Narrower ones let noise of 0.1 deg through, which
makes inertias a third too small at 6 ms; wider ones blur products of angles and rates, which makes
the coupling a fifth too small at 12 ms."""
REACH: Final = 6.0
"""Half length of the kernel in standard deviations [-]: a constant angle has no acceleration
then."""
MOST: Final = 20.0
"""Factor by which a positive parameter may leave the guess before [-]."""
LINEAR: Final = (*(each.name for each in NINE), "f1", "f2")
"""Parameters in which the equations are linear."""


def regressed(
    trials: Sequence[FitTrial], guess: Guess, free: Freedom, reach: float
) -> Guess | None:
    """Guess whose free linear parameters are those of a regression, mended to be a leg's.

    Args:
        trials: runs in fixed setups.
        guess: what is not free, and what is believed where runs say nothing.
        free: what may change.
        reach: distance of the foot tip along either direction, l1 + l3 = l2 [m].

    Returns:
        The guess; none if nothing that is free is linear, or the runs are too short.
    """
    names = [name for name in LINEAR if name in free.names]
    blocks = [block for trial in trials if (block := _rows(trial, guess, names, reach)) is not None]
    if not names or not blocks:
        return None
    before = guess.values[[INDEX[name] for name in names]]
    scales = [PARAMETERS[name].scale for name in names]
    size = np.where(np.array(scales) > 0.0, scales, before)
    slopes = np.concatenate([slope for slope, _ in blocks]) * size
    change = np.linalg.lstsq(slopes, np.concatenate([left for _, left in blocks]), rcond=1e-6)[0]
    values = guess.values.copy()
    for name, start, step in zip(names, before, change * size, strict=True):
        found = float(start + step)
        if PARAMETERS[name].positive:
            found = float(np.clip(found, start / MOST, start * MOST))
        values[INDEX[name]] = found
    shaped = mended(values, reach) if "B" in free.names else values
    return Guess(values=shaped, starts=np.zeros_like(guess.starts))


def _rows(
    trial: FitTrial, guess: Guess, names: Sequence[str], reach: float
) -> tuple[Floats, Floats] | None:
    """Torques of one run by its free parameters (m, p), and those that the guess leaves (m,)."""
    q, v, a, motors = _smoothed(trial)
    if not len(q):
        return None
    torques = _torques(q, v, a, motors)
    found, slope = equation_parameters(guess.values, reach, trial.setup)
    by_free = slope[:SHARPNESS, [INDEX[name] for name in names]]
    flat = torques.reshape(-1, SHARPNESS)
    return flat @ by_free, -flat @ found[:SHARPNESS]


def _torques(q: Floats, v: Floats, a: Floats, motors: Floats) -> Floats:
    """Torques that each parameter of the equations stands for, on both angles (n, 2, 13)."""
    found = np.zeros((len(q), 2, SHARPNESS))
    lean = q[:, 0] - q[:, 1]
    for joint, sign in ((0, 1.0), (1, -1.0)):
        other = 1 - joint
        found[:, joint, INERTIA + joint] = a[:, joint]
        turned = np.cos(lean) * a[:, other] + sign * np.sin(lean) * v[:, other] ** 2
        found[:, joint, COUPLING] = turned
        found[:, joint, MOMENT + joint] = np.sin(q[:, joint])
        found[:, joint, STIFFNESS + joint] = q[:, joint] - motors[:, joint]
        found[:, joint, DAMPING + joint] = v[:, joint]
        found[:, joint, FRICTION + joint] = np.tanh(v[:, joint] / FRICTION_WIDTH)
    return found


def _smoothed(trial: FitTrial) -> tuple[Floats, Floats, Floats, Floats]:
    """Angles, rates, accelerations and motor positions of the rows but those at the ends (m, 2)."""
    step = float(trial.time[-1] - trial.time[0]) / (len(trial.time) - 1)
    half = int(np.ceil(REACH * WIDTH / step))
    if len(trial.time) <= 2 * half + 1:
        nothing = np.zeros((0, 2))
        return nothing, nothing, nothing, nothing
    at = np.arange(-half, half + 1) * step / WIDTH
    bell = np.exp(-0.5 * at**2)
    bell /= bell.sum()
    # The position of row k + 1 is held from row k to row k + 1.
    motors = trial.motor_pos.copy()
    motors[:-1] = 0.5 * (trial.motor_pos[:-1] + trial.motor_pos[1:])

    def through(kernel: Floats, values: Floats) -> Floats:
        return np.stack([np.convolve(each, kernel, mode="valid") for each in values.T], axis=1)

    return (
        through(bell, trial.joint_pos),
        through(-at * bell / WIDTH, trial.joint_pos),
        through((at**2 - 1.0) * bell / WIDTH**2, trial.joint_pos),
        through(bell, motors),
    )
