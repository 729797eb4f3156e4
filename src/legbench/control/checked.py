"""Check of a guest's law: its commands are checked, its observations cannot be altered."""

from typing import final

import numpy as np

from legbench.control.abstract import AbstractController
from legbench.errors import ConfigError, PlantFault
from legbench.phases import ControllerDescription
from legbench.signals import Command, Floats, Observation

LAW = {
    "start_motor_pos": "start_motor_pos [rad]",
    "reset": "reset(observation)",
    "step": "step(observation) -> Command",
}
"""Members that a law must have, and how each is written."""
CAUSE = "controller failed"
"""Cause of a run that a law has ended."""
JOINTS = 2


@final
class Checked(AbstractController):
    """Law of one leg, of any class: its commands are checked, its observations are read-only.

    Lists and other sequences of numbers are converted; anything else ends the run before the row
    is recorded. A law that writes into what it sees gets NumPy's error at its own line.

    Raises:
        ConfigError: the law lacks something, or its first posture is no pair of motor positions.
    """

    def __init__(self, law: AbstractController, description: ControllerDescription) -> None:
        missing = [text for name, text in LAW.items() if getattr(law, name, None) is None]
        if missing:
            raise ConfigError(
                f"{type(law).__name__} is no control law: it lacks {', '.join(missing)}"
            )
        self._law = law
        self._codes = {phase.code: phase.name for phase in description.phases}
        self._width = sum(max(1, len(signal.components)) for signal in description.signals)
        try:
            self._start = _floats(law.start_motor_pos, JOINTS, "start_motor_pos")
        except PlantFault as error:
            raise ConfigError(str(error)) from None

    @property
    def start_motor_pos(self) -> Floats:
        """Start posture of the law, as an array (2,) [rad]."""
        return self._start

    @property
    def law(self) -> AbstractController:
        """Law of the guest, whose source a fault shows."""
        return self._law

    def reset(self, observation: Observation) -> None:
        """Show the law the leg at rest."""
        _protect(observation)
        self._law.reset(observation)

    def step(self, observation: Observation) -> Command:
        """Ask the law and check its answer.

        Raises:
            PlantFault: it is no command, or has a wrong shape, an unknown phase or signals other
                than those that the controller declares.
        """
        _protect(observation)
        command = self._law.step(observation)
        if not isinstance(command, Command):
            raise _failed(f"step returned {_shown(command)}; it must return a Command")
        motor_pos, phase, signals = command.motor_pos, command.phase, command.signals
        if self._fits(motor_pos, JOINTS) and self._knows(phase):
            if signals is None and self._width == 0:
                return command
            if signals is not None and self._fits(signals, self._width):
                return command
        return Command(
            motor_pos=_floats(motor_pos, JOINTS, "motor_pos"),
            phase=self._phase(phase),
            signals=self._signals(signals),
        )

    def _knows(self, phase: object) -> bool:
        if type(phase) is not np.ndarray or phase.shape != () or phase.dtype != np.int64:
            return False
        return phase.item() in self._codes

    @staticmethod
    def _fits(values: object, count: int) -> bool:
        return (
            type(values) is np.ndarray and values.shape == (count,) and values.dtype == np.float64
        )

    def _phase(self, phase: object) -> np.ndarray:
        code = np.asarray(phase)
        if code.shape != () or code.dtype.kind not in "iu" or int(code) not in self._codes:
            known = ", ".join(f"{code} ({name})" for code, name in self._codes.items())
            raise _failed(f"phase is {_shown(phase)}; the controller declares {known}")
        return code.astype(np.int64)

    def _signals(self, signals: object) -> Floats | None:
        if self._width == 0:
            if signals is not None:
                raise _failed("signals are given, but describe() declares none")
            return None
        if signals is None:
            raise _failed(f"signals are missing; describe() declares {self._width} values")
        return _floats(signals, self._width, "signals")


def _floats(values: object, count: int, name: str) -> Floats:
    """Return a sequence of numbers as an array (count,)."""
    try:
        array = np.asarray(values, dtype=np.float64)
    except (TypeError, ValueError):
        raise _failed(f"{name} is {_shown(values)}; it must be {count} numbers") from None
    if array.shape != (count,):
        raise _failed(f"{name} has shape {array.shape}; one leg needs ({count},)")
    return array


def _failed(what: str) -> PlantFault:
    return PlantFault(CAUSE, what)


def _shown(value: object) -> str:
    text = repr(value)
    return text if len(text) <= 60 else f"{text[:57]}..."


def _protect(observation: Observation) -> None:
    """Make the arrays of an observation read-only: they are what is recorded."""
    observation.motor_pos.setflags(write=False)
    observation.joint_pos.setflags(write=False)
    observation.joint_vel.setflags(write=False)
    observation.spring_torque.setflags(write=False)
    observation.applied_pos.setflags(write=False)
    truth = observation.truth
    if truth is not None:
        truth.trunk_pos.setflags(write=False)
        truth.trunk_vel.setflags(write=False)
        truth.foot_pos.setflags(write=False)
        truth.contact_force.setflags(write=False)
        truth.energy.setflags(write=False)
        truth.loop_gap.setflags(write=False)
