"""Running an experiment into a run folder."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from legbench.clock import AbstractClock
from legbench.control import AbstractController, make_controller
from legbench.control.needs import needs_of, run_on
from legbench.errors import ConfigError, RecordingError
from legbench.experiment.data import Experiment
from legbench.experiment.manifest import guests_of, manifest_of
from legbench.experiment.start import start_of, targets_of
from legbench.interrupts import StopFlag, shielded
from legbench.loop import Outcome, Progress, run
from legbench.mjcf import model_text
from legbench.onlooker import Onlooker
from legbench.plant.opening import Needs
from legbench.plant.start import Start
from legbench.plants import Leg, OpenPlant, open_plant
from legbench.recording.memory import MemoryRun
from legbench.recording.reader import Recording
from legbench.recording.writer import RunWriter
from legbench.verdict import answered, stopped_well


@dataclass(frozen=True, slots=True, kw_only=True)
class Finished:
    """Run that has ended, with its folder and its outcome."""

    path: Path
    outcome: Outcome


@dataclass(frozen=True, slots=True, kw_only=True)
class Prepared:
    """Experiment whose plant is open and waits for its reset."""

    experiment: Experiment
    controller: AbstractController
    start: Start
    xml: str
    """MJCF text of the model."""
    opened: OpenPlant

    @property
    def name(self) -> str:
        """Hint in the name of the run."""
        return f"{self.experiment.controller.kind}-{self.experiment.design.name}"

    def manifest(self, folder: Path | None) -> dict[str, Any]:
        """Manifest of the run in `folder`; raises as `manifest_of`."""
        period = self.opened.plant.period
        return manifest_of(self.experiment, self.start, self.xml, period, self.opened.facts, folder)


def record(
    experiment: Experiment,
    out: Path,
    *,
    clock: AbstractClock | None = None,
    stop: StopFlag | None = None,
    progress: Progress | None = None,
    on_started: Callable[[Path], None] | None = None,
    on_note: Callable[[str], None] | None = None,
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
        on_note: called with each line that a person should know before anything moves.

    Raises:
        ConfigError: settings that the leg or the plant refuses; nothing is written.
        KeyboardInterrupt: interrupted before the plant began to go to its start.
        BusError, DriveError: a bus or a drive is not what it should be; before the first cycle.
        PlantFault: something went wrong on the way to the start posture.
        RecordingError: the folder cannot be written, or the disk failed on the way; what was
            written by then stays readable.
    """
    watching, starting = Onlooker("progress", progress), Onlooker("on_started", on_started)
    noting = Onlooker("on_note", on_note)
    with _prepared(experiment) as ready:
        for line in ready.opened.notes:
            noting(line)
        manifest, realtime = ready.manifest(out / "run"), ready.opened.realtime
        with _recording(out, manifest, ready.name, realtime=realtime) as writer:
            _begin(writer, ready)
            starting(writer.path)
            outcome = _driven(ready, writer, (noting, starting, watching), clock, stop)
    return Finished(path=writer.path, outcome=outcome)


def record_in_memory(
    experiment: Experiment, *, stop: StopFlag | None = None, progress: Progress | None = None
) -> Recording:
    """Run an experiment in virtual time and leave nothing on disk.

    Args:
        experiment: what to run; a controller or plant that was written in a notebook will do.
        stop: ends the run when it is set.
        progress: told now and then how far the run is; its first failure is an event of the run.

    Raises:
        ConfigError: settings that the leg or the plant refuses, or drives whose pace is the
            machine's clock: a run on the bench must survive the end of this process.
        PlantFault: something went wrong on the way to the start posture.
    """
    watching = Onlooker("progress", progress)
    with _prepared(experiment) as ready:
        if ready.opened.realtime:
            raise ConfigError("drives run in real time and are recorded in a folder only; give out")
        writer = MemoryRun(ready.manifest(None), name=ready.name)
        _driven(ready, writer, (watching,), None, stop)
    return writer.recording()


@contextmanager
def _prepared(experiment: Experiment) -> Iterator[Prepared]:
    """Build the controller and open the plant of an experiment; it is closed in the end."""
    start = start_of(experiment)
    leg = Leg(
        design=experiment.design,
        options=experiment.options,
        start=start,
        servo=experiment.servo,
        imperfections=experiment.imperfections,
        seed=experiment.seed,
        needs=Needs(
            controller=experiment.controller.kind,
            signals=needs_of(experiment.controller),
            run_on=run_on,
        ),
    )
    controller = make_controller(experiment.controller, targets_of(experiment))
    imperfections = experiment.imperfections
    built = imperfections.leg_of(experiment.design), experiment.options.built(imperfections)
    xml = model_text(*built)
    opened = open_plant(experiment.plant, leg)
    with opened.plant:
        yield Prepared(
            experiment=experiment, controller=controller, start=start, xml=xml, opened=opened
        )


def _driven(
    ready: Prepared,
    writer: RunWriter | MemoryRun,
    onlookers: Sequence[Onlooker],
    clock: AbstractClock | None,
    stop: StopFlag | None,
) -> Outcome:
    """Run the loop and end the run; the last of the onlookers is told the progress."""
    opened = ready.opened
    try:
        outcome = run(
            opened.plant,
            ready.controller,
            max(1, round(ready.experiment.duration / opened.plant.period)),
            clock=clock or opened.clock,
            sink=writer,
            stop=stop,
            progress=onlookers[-1],
        )
    except BaseException as error:
        opened.plant.close()
        _tell(writer, opened, onlookers, writer.rows * opened.plant.period)
        _add_trouble(error, opened.trouble())
        raise
    return _end(writer, opened, onlookers, outcome)


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


def _begin(writer: RunWriter, ready: Prepared) -> None:
    """Put model, guests and logs into the run folder; raises RecordingError."""
    try:
        (writer.path / "leg.xml").write_text(ready.xml, encoding="utf-8")
        for guest in guests_of(ready.experiment):
            (writer.path / guest.name).write_bytes(guest.content)
        ready.opened.start_log(writer)
    except OSError as error:
        raise RecordingError(f"{writer.path}: {error}") from error


def _end(
    writer: RunWriter | MemoryRun,
    opened: OpenPlant,
    onlookers: Sequence[Onlooker],
    outcome: Outcome,
) -> Outcome:
    """Close the plant, then the run, and record what both report; returns how the run has ended."""
    outcome = answered(outcome, opened.gone())
    opened.plant.close()
    outcome = stopped_well(outcome, opened.trouble())
    _tell(writer, opened, onlookers, outcome.time)
    message = {} if outcome.message is None else {"message": outcome.message}
    writer.event(outcome.time, "end", status=outcome.status, cause=outcome.cause, **message)
    writer.close(outcome.status, outcome.cause)
    return outcome


def _tell(
    writer: RunWriter | MemoryRun, opened: OpenPlant, onlookers: Sequence[Onlooker], time: float
) -> None:
    """Write what the plant and the onlookers have to tell of a run that ended at `time` [s]."""
    for event, detail in opened.events().items():
        writer.event(time, event, **detail)
    for each in onlookers:
        if each.failure is not None:
            writer.event(time, "onlooker failed", who=each.name, error=each.failure)


def _add_trouble(error: BaseException, trouble: str | None) -> None:
    """Add to an exception, once, a note on what a person beside the plant has to know."""
    if trouble is not None and trouble not in getattr(error, "__notes__", ()):
        error.add_note(trouble)
