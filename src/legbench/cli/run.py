"""`legbench run`: a controller drives a leg, the run is recorded and rated."""

import threading
import time
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from legbench.cli.output import note, print_json, report_error, timed_progress
from legbench.cli.run_chosen import chosen_by
from legbench.errors import MissingExtraError
from legbench.experiment.data import Experiment

if TYPE_CHECKING:
    from legbench.experiment.running import Finished
    from legbench.viz.live.launch import LiveView


LOOK_PERIOD = 0.2
"""Period of the looks whether a page is served [s]."""


def plays_alone(experiment: Experiment) -> bool:
    """Whether a plant runs in virtual time and may be paced; drives on a wire keep their own."""
    if experiment.plant.kind != "can":
        return True
    from legbench.plants import EMULATED, CanChoice

    return isinstance(experiment.plant, CanChoice) and experiment.plant.interface == EMULATED


def period_of(experiment: Experiment) -> float:
    """Period of the cycles of an experiment, on drives that of their bus file [s].

    Raises:
        ConfigError: that file is none.
    """
    from legbench.drives.setup.bus_file import load_bus
    from legbench.plant.start import PERIOD
    from legbench.plants import CanChoice

    plant = experiment.plant
    return load_bus(plant.bus_file).period if isinstance(plant, CanChoice) else PERIOD


@dataclass(slots=True)
class Watching:
    """Live view of a run, if there is one."""

    serve: bool
    view: "LiveView | None" = None

    def start(self, run: Path) -> None:
        """Open the view; where there is none, a note says so and the run goes on."""
        from legbench.viz.live.launch import start_live

        try:
            self.view = start_live(run, serve=self.serve)
        except MissingExtraError as error:
            note(f"legbench: {error}")
            return
        if self.serve:
            # The run does not wait for the page, which takes a second to be there.
            threading.Thread(target=self._tell, args=(self.view, run), daemon=True).start()

    @staticmethod
    def _tell(view: "LiveView", run: Path) -> None:
        """Say where the page is, as soon as it is there."""
        while view.alive:
            if view.served:
                note(f"watch at {view.url}; `legbench replay {run} --serve` shows it again")
                return
            time.sleep(LOOK_PERIOD)
        note(f"legbench: the page is not served; {run}/live.log says why, the run goes on unseen")

    def stop(self) -> None:
        """Let the view show the last rows, and end."""
        if self.view is not None:
            self.view.stop()


def main(arguments: list[str]) -> int:
    """Run `legbench run`: a controller drives a leg, and the run is recorded.

    Returns:
        0 when the run came to its end or was stopped by ^C after its first row, 1 when a fault
        ended it or a drive kept its power, 130 when ^C came before the first row.
    """
    asked = chosen_by(arguments)
    from legbench.cli.waived import note_waived_of
    from legbench.clock import WallClock
    from legbench.experiment.running import record
    from legbench.interrupts import stop_on_interrupt

    chosen, experiment = asked.arguments, asked.experiment
    note_waived_of(experiment.plant)
    watched = chosen.view or chosen.serve
    watching = Watching(serve=chosen.serve)
    paced = watched or chosen.real_time
    alone = paced and plays_alone(experiment)
    clock = WallClock(period_of(experiment)) if alone else None
    with stop_on_interrupt(raises=True) as stop:
        finished = record(
            experiment,
            chosen.out,
            clock=clock,
            stop=stop,
            progress=timed_progress(),
            on_note=report_error,
            on_started=watching.start if watched else None,
        )
    watching.stop()
    return _report(finished, as_json=chosen.json)


def _report(finished: "Finished", *, as_json: bool) -> int:
    """Print how a run has ended and its figures; returns the exit status."""
    from legbench.cli.table import limited, print_summary, warned
    from legbench.metrics import summarise
    from legbench.metrics.soundness import Soundness
    from legbench.recording.reader import load

    if finished.outcome.status == "interrupted" and finished.outcome.cycles == 0:
        report_error(f"interrupted before the first row; {finished.path} holds 0 rows")
        return 130
    if finished.outcome.message is not None:
        note(f"legbench: {finished.outcome.message}")
    recording = load(finished.path)
    summary = summarise(recording)
    if warnings := warned(recording.events):
        note(f"legbench: drives sent what the bus file lists as warnings: {warnings}")
    if summary.limited_cycles:
        note(
            f"legbench: the limits changed the command in {limited(summary)}: the leg ran "
            "something else than it was asked to, by command_speed or motor_range of the limits; "
            "the event 'limited' in events.jsonl tells which"
        )
    if summary.numerics == Soundness.UNSOUND:
        note(
            "legbench: the numerics of this run are unsound, its motion is not that of the leg; "
            "its warnings say why"
        )
    if as_json:
        print_json(summary.to_json())
    else:
        print_summary(summary)
    return 1 if finished.outcome.status == "fault" else 0
