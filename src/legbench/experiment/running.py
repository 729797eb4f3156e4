"""Running an experiment into a run folder."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from legbench.clock import AbstractClock
from legbench.control import make_controller
from legbench.errors import RecordingError
from legbench.experiment.data import Experiment
from legbench.experiment.manifest import guests_of, manifest_of
from legbench.experiment.start import start_of, targets_of
from legbench.interrupts import StopFlag, shielded
from legbench.loop import Outcome, Progress, run
from legbench.mjcf import model_text
from legbench.onlooker import Onlooker
from legbench.plant.start import PERIOD
from legbench.plants import Leg, OpenPlant, open_plant
from legbench.recording.writer import RunWriter
from legbench.verdict import answered, stopped_well


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

    A run whose drives could not be shown to be without power in the end is a fault, whatever it
    was until then. An interruption before the run folder is there leaves nothing behind; one
    before the first row leaves a folder that says `interrupted` and holds no rows.

    Args:
        experiment: what to run.
        out: folder of the runs, made if need be.
        clock: when cycles begin; by default as the plant paces itself.
        stop: ends the run when it is set.
        progress: told now and then how far the run is.
        on_started: told the run folder before the first cycle. Neither can end the run: the first
            failure of each is an event of the run, and it is not called again.

    Raises:
        ConfigError: settings that the leg or the plant refuses; nothing is written.
        KeyboardInterrupt: interrupted before the plant began to go to its start.
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
    watching, starting = Onlooker("progress", progress), Onlooker("on_started", on_started)
    opened = open_plant(experiment.plant, leg)
    with opened.plant:
        manifest = manifest_of(experiment, start, xml, opened.facts, out / "run")
        name = f"{experiment.controller.kind}-{experiment.design.name}"
        with _recording(out, manifest, name, realtime=opened.realtime) as writer:
            _begin(writer, experiment, xml, opened)
            starting(writer.path)
            try:
                outcome = run(
                    opened.plant,
                    controller,
                    round(experiment.duration / PERIOD),
                    clock=clock or opened.clock,
                    sink=writer,
                    stop=stop,
                    progress=watching,
                )
            except BaseException as error:
                opened.plant.close()
                _tell(writer, opened, (starting, watching), writer.rows * PERIOD)
                _add_trouble(error, opened.trouble())
                raise
            outcome = _end(writer, opened, (starting, watching), outcome)
    return Finished(path=writer.path, outcome=outcome)


@contextmanager
def _recording(
    out: Path, manifest: dict[str, Any], name: str, *, realtime: bool
) -> Iterator[RunWriter]:
    """Write a new run; one that is interrupted while its folder is made is closed as usual."""
    with ExitStack() as stack:
        with shielded():
            writer = RunWriter.create(out, manifest, name=name, realtime=realtime)
            stack.enter_context(writer)
        yield writer


def _begin(writer: RunWriter, experiment: Experiment, xml: str, opened: OpenPlant) -> None:
    """Put model, guests and logs into the run folder; raises RecordingError."""
    try:
        (writer.path / "leg.xml").write_text(xml, encoding="utf-8")
        for guest in guests_of(experiment):
            (writer.path / guest.name).write_bytes(guest.content)
        opened.start_log(writer.path)
    except OSError as error:
        raise RecordingError(f"{writer.path}: {error}") from error


def _end(
    writer: RunWriter, opened: OpenPlant, onlookers: Sequence[Onlooker], outcome: Outcome
) -> Outcome:
    """Close the plant, then the run, with what both have to tell; how it has really ended."""
    outcome = answered(outcome, opened.gone())
    opened.plant.close()
    outcome = stopped_well(outcome, opened.trouble())
    _tell(writer, opened, onlookers, outcome.time)
    writer.event(outcome.time, "end", status=outcome.status, cause=outcome.cause)
    writer.close(outcome.status, outcome.cause)
    return outcome


def _tell(writer: RunWriter, opened: OpenPlant, onlookers: Sequence[Onlooker], time: float) -> None:
    """Write what the plant and the onlookers have to tell of a run that ended at `time` [s]."""
    for event, detail in opened.events().items():
        writer.event(time, event, **detail)
    for each in onlookers:
        if each.failure is not None:
            writer.event(time, "onlooker failed", who=each.name, error=each.failure)


def _add_trouble(error: BaseException, trouble: str | None) -> None:
    """Give an exception what a person beside the plant has to know as a note, once."""
    if trouble is not None and trouble not in getattr(error, "__notes__", ()):
        error.add_note(trouble)
