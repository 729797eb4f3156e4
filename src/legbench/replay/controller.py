"""Recorded observations through a controller, whose commands are compared with the recorded."""

from dataclasses import dataclass

import numpy as np

from legbench.control.check import check_command
from legbench.errors import LegbenchError
from legbench.failures import failed, own_lines
from legbench.loop import PROGRESS_EVERY, Progress
from legbench.recording.columns import Layout
from legbench.recording.reader import Recording
from legbench.replay.comparison import Replayed, columns_of
from legbench.replay.observations import exact_times, observations, require_every_row
from legbench.replay.recorded import RecordedController
from legbench.signals import Command, Floats

COMMANDED = ("command_pos", "phase")
"""Signals that every controller gives, besides those of its own."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ControllerReplay:
    """Commands of a controller that has seen what was recorded."""

    commands: Replayed
    """Commands, phases and the controller's own signals, recorded and replayed."""


def replay_controller(
    recording: Recording, controller: RecordedController, progress: Progress | None = None
) -> ControllerReplay:
    """Show a controller what was recorded, row by row, and collect its commands.

    Nothing that it commands has an effect: from the first command that differs on, an edited
    controller sees a leg that obeyed another one.

    Args:
        recording: the run.
        controller: that of the run, or an edited one.
        progress: told now and then how far it is.

    Raises:
        RecordingError: a run that has no rows, or lacks some.
        ConfigError: the leg refuses the settings.
        PlantFault: the controller failed; its cause is "controller failed".
    """
    times = exact_times(recording, require_every_row(recording))
    law, count = controller.build(), len(times)
    layout = Layout(own=controller.controller.describe().signals)
    own = sum(len(signal.columns) for signal in layout.own)
    motor_pos, phase = np.empty((count, 2)), np.empty(count, dtype=np.int8)
    signals = np.full((count, own), np.nan)
    for row, seen in enumerate(observations(recording, times)):
        try:
            if row == 0:
                law.reset(seen)
            command = law.step(seen)
            check_command(command, seen)
        except LegbenchError:
            raise
        except Exception as error:  # Whatever a law of somebody else does.
            when = f"in its replay at t = {seen.time:.3f} s"
            raise failed("controller", when, error, own_lines(error)) from error
        _keep(command, motor_pos[row], signals[row])
        phase[row] = command.phase
        if progress is not None and ((row + 1) % PROGRESS_EVERY == 0 or row + 1 == count):
            progress(row + 1, count)
    return ControllerReplay(commands=_compared(recording, layout, motor_pos, phase, signals))


def _keep(command: Command, motor_pos: Floats, signals: Floats) -> None:
    motor_pos[:] = command.motor_pos
    if command.signals is not None:
        signals[:] = command.signals


def _compared(
    recording: Recording, layout: Layout, motor_pos: Floats, phase: np.ndarray, signals: Floats
) -> Replayed:
    """Commands beside those of the run; own signals that only one of both has are left out."""
    own = columns_of(layout, tuple(signal.name for signal in layout.own))
    values = {"command_pos_1": motor_pos[:, 0], "command_pos_2": motor_pos[:, 1], "phase": phase}
    values |= dict(zip(own, signals.T, strict=True))
    names = [name for name in values if name in recording.columns]
    return Replayed(
        time=recording.time,
        recorded={name: recording.columns[name] for name in names},
        replayed={name: values[name] for name in names},
        units={name: layout.units[name] for name in names},
    )
