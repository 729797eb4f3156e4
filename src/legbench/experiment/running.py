"""Running an experiment into a run folder."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from legbench.clock import AbstractClock
from legbench.control import make_controller
from legbench.errors import RecordingError
from legbench.experiment.data import Experiment
from legbench.experiment.manifest import guests_of, manifest_of
from legbench.experiment.start import start_of, targets_of
from legbench.loop import Outcome, Progress, StopFlag, run
from legbench.mjcf import model_text
from legbench.plant.start import PERIOD
from legbench.plants import Leg, OpenPlant, open_plant
from legbench.recording.writer import RunWriter


@dataclass(frozen=True, slots=True, kw_only=True)
class Finished:
    """A run that has ended, one way or another."""

    path: Path
    outcome: Outcome


def record(
    experiment: Experiment,
    out: Path,
    *,
    clock: AbstractClock | None = None,
    stop: StopFlag | None = None,
    progress: Progress | None = None,
    on_started: Callable[[Path], None] | None = None,
) -> Finished:
    """Run an experiment, in virtual time by default, and leave a run folder under `out`.

    Args:
        experiment: what to run.
        out: folder of the runs, made if need be.
        clock: when cycles begin; by default as the plant paces itself.
        stop: ends the run when it is set.
        progress: told now and then how far the run is.
        on_started: told the run folder before the first cycle.

    Raises:
        ConfigError: settings that the leg or the plant refuses; nothing is written.
        BusError, DriveError: a bus or a drive is not what it should be; before the first cycle.
        PlantFault: something went wrong on the way to the start posture.
        RecordingError: the folder cannot be written, or the disk failed on the way; what was
            written by then stays readable.
    """
    controller = make_controller(experiment.controller, targets_of(experiment))
    start = start_of(experiment)
    leg = Leg(
        design=experiment.design, options=experiment.options, start=start, servo=experiment.servo
    )
    xml = model_text(experiment.design, experiment.options)
    opened = open_plant(experiment.plant, leg)
    with opened.plant:
        manifest = manifest_of(experiment, start, xml, opened.facts, out / "run")
        name = f"{experiment.controller.kind}-{experiment.design.name}"
        with RunWriter.create(out, manifest, name=name) as writer:
            _begin(writer, experiment, xml, opened, on_started)
            outcome = run(
                opened.plant,
                controller,
                round(experiment.duration / PERIOD),
                clock=clock or opened.clock,
                sink=writer,
                stop=stop,
                progress=progress,
            )
            _end(writer, opened, outcome)
    return Finished(path=writer.path, outcome=outcome)


def _begin(
    writer: RunWriter,
    experiment: Experiment,
    xml: str,
    opened: OpenPlant,
    on_started: Callable[[Path], None] | None,
) -> None:
    """Put model, guests and logs into the run folder; raises RecordingError."""
    try:
        (writer.path / "leg.xml").write_text(xml, encoding="utf-8")
        for guest in guests_of(experiment):
            (writer.path / guest.name).write_bytes(guest.content)
        opened.start_log(writer.path)
        if on_started is not None:
            on_started(writer.path)
    except OSError as error:
        raise RecordingError(f"{writer.path}: {error}") from error


def _end(writer: RunWriter, opened: OpenPlant, outcome: Outcome) -> None:
    """Close the plant, then the run, with what both have to tell."""
    opened.plant.close()
    for event, detail in opened.events().items():
        writer.event(outcome.cycles * PERIOD, event, **detail)
    writer.event(outcome.cycles * PERIOD, "end", status=outcome.status, cause=outcome.cause)
    writer.close(outcome.status, outcome.cause)
