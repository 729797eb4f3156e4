"""Rows of a run that move the motors of a resimulation."""

from collections.abc import Iterator
from enum import StrEnum
from typing import Final, final

import numpy as np

from legbench.errors import ConfigError, RecordingError
from legbench.recording.answers import DRIVES, between_answers, unanswered
from legbench.recording.reader import Recording
from legbench.signals import Command, Floats

STILL: Final = 1e-3
"""Way of a motor from its first position that ends the rest before a run's first action [rad]."""
SAME: Final = 1e-9
"""Difference below which two readings are the same count, computed twice [rad]."""
MOST_REST: Final = 500
"""Largest number of rows at rest that are looked at."""


class MotionSource(StrEnum):
    """Rows of a run that move the motors of a resimulation."""

    COMMANDS = "commands"
    """Commands, which the servo of the plant follows; on drives as the limits let them through."""
    MOTORS = "motors"
    """Measured motor positions, where perfect motors are put."""


@final
class Moved:
    """Positions to which the motors of a resimulation are told to go, row by row.

    Attributes:
        on_drives: whether the run was one on drives.
        stale: rows in which each drive had not answered, so that its last answer is repeated
            (n, 2).
        first: positions of the motors before the first row (2,) [rad].
        measured: whether the motors go where they were measured.
        joint_pos: measured link angles (n, 2) [rad].
    """

    def __init__(self, recording: Recording, source: MotionSource) -> None:
        """Take the rows of a run.

        Raises:
            ConfigError: its commands were never sent.
            RecordingError: it does not know its motors in every row.
        """
        run, self.measured = recording.description, source is MotionSource.MOTORS
        self.on_drives = run.plant == DRIVES
        if source is MotionSource.COMMANDS and run.looks_only:
            raise ConfigError(
                f"{recording.path} was read only: its commands moved nothing; use --resimulate "
                "motors"
            )
        self._command = recording["command_pos"]
        self._sent = recording["applied_pos"] if self.on_drives else None
        needed = recording["motor_pos"] if self.measured else self._command
        if not np.isfinite(needed).all():
            raise RecordingError(
                f"{recording.path} does not know its {source.value} in every row: it cannot be "
                "resimulated from them"
            )
        self.stale = unanswered(recording)
        self._motor_pos = between_answers(recording["motor_pos"], self.stale)
        known = run.initial_state
        measured = self.on_drives and self.measured
        start = None if known is None or measured else np.array(known.motor_pos)
        self.first: Floats = self._motor_pos[0] if start is None else start
        names = [signal.name for signal in run.layout.own]
        own = [recording[name].reshape(len(needed), -1) for name in names]
        self._own = np.concatenate(own, axis=1) if own else None
        self._phase, self.joint_pos = recording["phase"], recording["joint_pos"]

    def command(self, row: int) -> Command:
        """Command of a row as it was recorded."""
        own = None if self._own is None else self._own[row]
        phase = np.asarray(self._phase[row])
        return Command(motor_pos=self._command[row], phase=phase, signals=own)

    def between(self, row: int, steps: int) -> Iterator[Floats]:
        """Positions (2,) on the way from a row to the next one, in a number of steps [rad]."""
        if not self.measured:
            # What the limits let through of a command is recorded in the row after it.
            sent = self._command[row] if self._sent is None else self._sent[row + 1]
            yield from (sent for _ in range(steps))
            return
        start, end = self._motor_pos[row], self._motor_pos[row + 1]
        for step in range(1, steps):
            yield start + (step / steps) * (end - start)
        yield end

    @property
    def count(self) -> float | None:
        """Count of the link encoders [rad], the smallest difference of two readings; none if
        nothing was read but one value.
        """
        apart = np.concatenate([np.diff(np.unique(each)) for each in self.joint_pos.T])
        return float(apart.min()) if len(apart := apart[apart > SAME]) else None

    def rest(self) -> Floats:
        """Link angles of the rows before the motors first move (m, 2) [rad]."""
        away = np.any(np.abs(self._motor_pos - self._motor_pos[0]) > STILL, axis=1)
        rows = int(np.argmax(away)) if away.any() else len(away)
        return self.joint_pos[: min(rows, MOST_REST)]
