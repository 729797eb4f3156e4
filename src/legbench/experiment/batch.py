"""Running many experiments in step, each to the bit as it runs alone."""

import time
from collections.abc import Hashable, Sequence
from typing import final

import numpy as np

from legbench.control import AbstractController, LegTargets, make_controllers
from legbench.errors import ConfigError, PlantFault
from legbench.experiment.alike import alike, runs_in_batch
from legbench.experiment.data import Experiment
from legbench.experiment.manifest import manifest_of
from legbench.experiment.start import targets_of
from legbench.loop import PROGRESS_EVERY, Progress, controller_failed
from legbench.plant.backlash import rest_of
from legbench.plant.batch import FAILED, BatchPlant
from legbench.plant.start import PERIOD, Start
from legbench.plants import SimChoice
from legbench.recording.columns import Layout
from legbench.recording.layout import COMPLETE, FAULT
from legbench.recording.memory import MemoryRun
from legbench.recording.reader import Recording
from legbench.recording.rows import BATCH_ROWS, LegRows, RowLayout


def run_batch(
    experiments: Sequence[Experiment],
    *,
    threads: int | None = None,
    progress: Progress | None = None,
) -> list[Recording]:
    """Run experiments in virtual time, side by side, and return their recordings in order.

    Every column but `cycle_us` is that of the experiment run alone, to the bit, in whatever company
    and on however many threads it runs. A leg that faults keeps its cause, its rows end there, and
    the others go on. Manifests lack the hash of the model, whose text nobody has made.

    Args:
        experiments: on the simulated plant, without limits; everything else is each one's own.
        threads: how many threads step the legs; by default one a processor.
        progress: told now and then how many cycles of how many are done, all groups together.

    Raises:
        ConfigError: another plant, limits, or settings that a leg refuses.
    """
    for place, each in enumerate(experiments):
        if not runs_in_batch(each):
            raise ConfigError(
                f"experiment {place} of the batch is on plant '{each.plant.kind}'"
                f"{' under limits' if isinstance(each.plant, SimChoice) else ''}; a batch runs on "
                "plant 'sim' without limits: run it alone"
            )
    groups: dict[Hashable, list[int]] = {}
    for place, each in enumerate(experiments):
        groups.setdefault(alike(each), []).append(place)
    made = [LegGroup([experiments[place] for place in group]) for group in groups.values()]
    total, done = sum(group.cycles for group in made), 0
    found: dict[int, Recording] = {}
    for group, places in zip(made, groups.values(), strict=True):
        group.run(threads, progress, done, total)
        done += group.cycles
        found |= zip(places, group.recordings(), strict=True)
    return [found[place] for place in range(len(experiments))]


def start_together(experiments: Sequence[Experiment]) -> tuple[AbstractController, Start]:
    """The controller of experiments that are alike, and the states that they begin in.

    Raises:
        ConfigError: settings that a leg refuses.
    """
    first = targets_of(experiments[0])
    targets = LegTargets(
        designs=[each.design for each in experiments],
        support=first.support,
        meaning=first.meaning,
        convention=first.convention,
    )
    controller = make_controllers([each.controller for each in experiments], targets)
    motor_pos = controller.start_motor_pos
    flaws = [each.imperfections for each in experiments]
    rest = rest_of(targets.designs, targets.support, motor_pos, flaws)
    return controller, Start(joint_pos=rest, motor_pos=motor_pos)


@final
class LegGroup:
    """Experiments whose legs are stepped together.

    Attributes:
        cycles: how many the longest of them lasts.
    """

    def __init__(self, experiments: Sequence[Experiment]) -> None:
        """Make controller and start; raises ConfigError where a leg refuses its settings."""
        self._experiments = experiments
        self._controller, self._start = start_together(experiments)
        self._wanted = np.array([round(each.duration / PERIOD) for each in experiments])
        self.cycles = int(self._wanted.max())
        self._runs = [
            MemoryRun(
                manifest_of(each, self._start_of(leg), None, PERIOD, {}, None),
                name=f"{each.controller.kind}-{each.design.name}",
            )
            for leg, each in enumerate(experiments)
        ]
        self._plant: BatchPlant | None = None
        self._lost: dict[int, tuple[int, PlantFault]] = {}

    def run(self, threads: int | None, progress: Progress | None, done: int, total: int) -> None:
        """Run them all, `done` of `total` cycles being over before."""
        plant = self._plant = self.open(threads)
        layout = Layout(own=self._experiments[0].controller.describe().signals)
        rows = LegRows(len(self._experiments), RowLayout(layout))
        seen = plant.reset()
        self._controller.reset(seen)
        self._lose(seen.time, 0)
        before, cycle_us, first = time.perf_counter(), 0.0, 0
        for cycle in range(self.cycles):
            command = self._controller.step(seen)
            self._lose(seen.time, cycle)
            if len(self._lost) == len(self._runs):
                break
            rows.put(command, seen, cycle_us)
            seen = plant.step(command)
            if rows.count == BATCH_ROWS:
                self._hand_out(rows, first)
                first = cycle + 1
            ended = cycle + 1 == self.cycles
            if progress is not None and ((cycle + 1) % PROGRESS_EVERY == 0 or ended):
                progress(done + cycle + 1, total)
            now = time.perf_counter()
            cycle_us, before = 1e6 * (now - before), now
        self._hand_out(rows, first)

    def open(self, threads: int | None = None) -> BatchPlant:
        """Make the plant of all legs."""
        experiments = self._experiments
        return BatchPlant(
            [each.design for each in experiments],
            experiments[0].options,
            self._start,
            [each.servo for each in experiments],
            threads,
            [each.imperfections for each in experiments],
            [each.seed for each in experiments],
        )

    def recordings(self) -> list[Recording]:
        """Return what was recorded, in order; runs whose leg faulted say so."""
        return [self._ended(leg, run) for leg, run in enumerate(self._runs)]

    def _start_of(self, leg: int) -> Start:
        return Start(joint_pos=self._start.joint_pos[leg], motor_pos=self._start.motor_pos[leg])

    def _lose(self, time: float, rows: int) -> None:
        """Remember the legs that their controller cannot go on with, after so many rows."""
        for leg, error in self._controller.leg_errors.items():
            if leg not in self._lost:
                fault = controller_failed(self._controller.law_of(leg), error, time)
                self._lost[leg] = rows, fault

    def _end_of(self, leg: int) -> tuple[int, float, PlantFault | None]:
        """Rows of a leg so far as they are known, the time of its end [s], and what ended it."""
        wanted, plant = int(self._wanted[leg]), self._plant
        cycle = -1 if plant is None else int(plant.fault_cycles[leg])
        rows, fault = self._lost.get(leg, (wanted + 1, None))
        if plant is not None and 0 <= cycle <= min(wanted, rows):
            # What the plant made of the last command is not seen any more.
            found = PlantFault(plant.causes[leg] or FAILED, plant.messages[leg] or "")
            return cycle, (cycle - 1) * PERIOD, found
        # A controller that fails after the last row has nothing left to command.
        return (rows, rows * PERIOD, fault) if rows < wanted else (wanted, wanted * PERIOD, None)

    def _hand_out(self, rows: LegRows, first: int) -> None:
        """Give each leg its rows from the cycle `first` on, up to its end."""
        for leg, run in enumerate(self._runs):
            count = min(self._end_of(leg)[0] - first, rows.count)
            if count > 0:
                run.extend(rows.columns(leg, count))
        rows.count = 0

    def _ended(self, leg: int, run: MemoryRun) -> Recording:
        _, time, fault = self._end_of(leg)
        status, cause = (COMPLETE, None) if fault is None else (FAULT, fault.cause)
        message = {} if fault is None else {"message": str(fault)}
        run.event(time, "end", status=status, cause=cause, **message)
        run.close(status, cause)
        return run.recording()
