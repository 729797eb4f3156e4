"""Check of a command before a plant or a recording sees it."""

from math import isfinite
from operator import index

import numpy as np

from legbench.signals import Command, Observation

LAST_PHASE = 127
"""Largest phase that a recording can hold: it stores them as int8."""
FLOAT64 = np.dtype(np.float64)


class CommandError(ValueError):
    """A command that no plant can follow; says what the controller returned instead of one."""


def check_command(command: object, seen: Observation) -> None:
    """Check a command against the observation that it answers.

    A right command of one leg costs a third of a microsecond; what is wrong with one is only
    looked for once something is.

    Raises:
        CommandError: it is no `Command`, its arrays are not float64 of the observation's shape
            (..., 2) and integers of its shape (...), or a number in it cannot be.
    """
    if type(command) is Command and command.motor_pos.__class__ is np.ndarray:
        motor_pos = command.motor_pos
        if motor_pos.shape == (2,) == seen.motor_pos.shape and motor_pos.dtype is FLOAT64:
            first, second = motor_pos.tolist()
            try:
                # `index` takes integers of any kind, but neither floats nor arrays of many.
                if isfinite(first + second) and 0 <= index(command.phase) <= LAST_PHASE:
                    return
            except TypeError:
                pass
    _explain(command, seen.motor_pos.shape)


def _explain(command: object, shape: tuple[int, ...]) -> None:
    """Raise CommandError for what is wrong, if anything is; a batch always comes here."""
    if not isinstance(command, Command):
        raise CommandError(f"step returned {_short(command)}, not a Command")
    motor_pos: object = command.motor_pos
    if not isinstance(motor_pos, np.ndarray) or motor_pos.dtype != FLOAT64:
        raise CommandError(f"motor_pos is {_short(motor_pos)}, not an array of float64")
    if motor_pos.shape != shape:
        raise CommandError(f"motor_pos has shape {motor_pos.shape}, not {shape} as was seen")
    if not np.all(np.isfinite(motor_pos)):
        raise CommandError(f"motor_pos is {_short(motor_pos)}; it must be finite [rad]")
    phase = np.asarray(command.phase)
    if phase.dtype.kind not in "iu":
        raise CommandError(f"phase is {_short(command.phase)}, not an integer")
    if phase.shape != shape[:-1]:
        raise CommandError(f"phase has shape {phase.shape}, not {shape[:-1]} as was seen")
    if not np.all((phase >= 0) & (phase <= LAST_PHASE)):
        raise CommandError(f"phase is {_short(command.phase)}; it must be 0 to {LAST_PHASE}")


def _short(value: object) -> str:
    """Return what a value is in a few words, however large it is."""
    text = repr(value).replace("\n", "")
    return text if len(text) <= 80 else f"{text[:77]}..."
