"""Running an experiment from Python: one call that returns what was recorded."""

from pathlib import Path

from legbench.experiment.data import Experiment
from legbench.experiment.running import record, record_in_memory
from legbench.interrupts import stop_on_interrupt
from legbench.loop import Progress
from legbench.recording.layout import INTERRUPTED
from legbench.recording.reader import Recording, load


def run(
    experiment: Experiment, out: Path | str | None = None, *, progress: Progress | None = None
) -> Recording:
    """Run an experiment in virtual time and return its recording.

    A run that a fault ends is returned as well: `Recording.complete` is false then, and
    `description.cause` and the message of the last event say why.

    Args:
        experiment: what to run.
        out: folder under which the run folder is made; None keeps the run in memory alone. Drives
            on a wire, which keep their own time, need one.
        progress: called every 250 cycles with cycles done and cycles in all; silent by default.

    Raises:
        ConfigError: settings that the leg or the plant refuses; nothing has moved.
        BusError, DriveError: a bus or a drive is not what it should be; before the first cycle.
        PlantFault: something went wrong on the way to the start posture.
        RecordingError: the folder cannot be written.
        KeyboardInterrupt: ^C; the plant was stopped first, and a run folder holds every row.
    """
    with stop_on_interrupt(raises=True) as stop:
        if out is None:
            recording = record_in_memory(experiment, stop=stop, progress=progress)
        else:
            finished = record(experiment, Path(out), stop=stop, progress=progress)
            recording = load(finished.path)
    if recording.manifest.get("status") == INTERRUPTED:
        raise KeyboardInterrupt(
            f"{recording.path} was interrupted after {len(recording.time)} rows"
        )
    return recording
