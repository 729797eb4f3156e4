"""The only while-loop: observation in, command out, one row a cycle."""

import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Protocol

from legbench.clock import AbstractClock, VirtualClock
from legbench.control import AbstractController
from legbench.errors import PlantFault
from legbench.interrupts import StopFlag
from legbench.plant.abstract import AbstractPlant
from legbench.signals import Command, Floats, Observation

Progress = Callable[[int, int], None]
"""Called now and then, and at the end, with cycles done and cycles in all."""
PROGRESS_EVERY = 250
"""Cycles between two calls of the progress function."""


class RowSink(Protocol):
    """What the loop needs of a recording."""

    def append(
        self, command: Command, observation: Observation, cycle_us: float, late_us: float
    ) -> None:
        """Take one row; must not wait."""
        ...


@dataclass(frozen=True, slots=True, kw_only=True)
class Outcome:
    """How a run ended."""

    status: str
    """`complete`, `interrupted` (^C) or `fault`."""
    cause: str | None
    """Short name of the fault, if one ended the run."""
    message: str | None
    """What to tell the user about it."""
    cycles: int
    wall_time: float
    """[s]"""


def run(
    plant: AbstractPlant,
    controller: AbstractController,
    cycles: int,
    *,
    clock: AbstractClock | None = None,
    sink: RowSink | None = None,
    stop: StopFlag | None = None,
    progress: Progress | None = None,
) -> Outcome:
    """Control a plant for a number of cycles.

    A run that has lasted its time then comes to rest in the controller's first posture
    (`AbstractPlant.rest`), which adds no row. The first fault ends the run and is returned as its
    cause; every row until then is kept. An exception of any kind closes the plant before anything
    else happens: drives come to rest while disks are still busy. A stop that comes before the first
    row ends the run there, with no cycle; from the first row on it ends the run between two rows.

    Raises:
        PlantFault: the plant did not get to its start.
        RecordingError: the recording failed.
    """
    clock, stop = clock or VirtualClock(), stop or StopFlag()
    began = False
    try:
        stop.raises = True
        observation = plant.reset()
        controller.reset(observation)
        began, stop.raises = True, False
        outcome = _cycle(plant, controller, observation, cycles, clock, sink, stop, progress)
        return _to_rest(plant, controller.start_motor_pos, outcome, stop)
    except BaseException as error:
        stop.raises = False
        plant.close()
        if not began and isinstance(error, KeyboardInterrupt) and stop.is_set:
            return Outcome(status="interrupted", cause=None, message=None, cycles=0, wall_time=0.0)
        raise


def _cycle(
    plant: AbstractPlant,
    controller: AbstractController,
    observation: Observation,
    cycles: int,
    clock: AbstractClock,
    sink: RowSink | None,
    stop: StopFlag,
    progress: Progress | None,
) -> Outcome:
    """The loop itself, from the first observation on."""
    began = time.perf_counter()
    previous = began
    cycle_us = 0.0
    cycle = 0
    fault: PlantFault | None = None
    clock.start()
    while cycle < cycles and not stop.is_set:
        late = clock.wait(cycle)
        command = controller.step(observation)
        if sink is not None:
            sink.append(command, observation, cycle_us, 1e6 * late)
        cycle += 1
        try:
            observation = plant.step(command)
        except PlantFault as error:
            fault = error
            break
        if progress is not None and (cycle % PROGRESS_EVERY == 0 or cycle == cycles):
            progress(cycle, cycles)
        now = time.perf_counter()
        cycle_us, previous = 1e6 * (now - previous), now
    wall_time = time.perf_counter() - began
    if fault is not None:
        ending = ("fault", fault.cause, str(fault))
    elif stop.is_set:
        ending = ("interrupted", None, None)
    else:
        ending = ("complete", None, None)
    status, cause, message = ending
    return Outcome(status=status, cause=cause, message=message, cycles=cycle, wall_time=wall_time)


def _to_rest(plant: AbstractPlant, motor_pos: Floats, outcome: Outcome, stop: StopFlag) -> Outcome:
    """End a run that has lasted its time at rest; ^C and faults end it at once, there as well."""
    if outcome.status != "complete":
        return outcome
    try:
        message = plant.rest(motor_pos, lambda: stop.is_set)
    except PlantFault as error:
        text = f"after its last row, on the way to rest: {error}"
        return replace(outcome, status="fault", cause=error.cause, message=text)
    return replace(outcome, status="interrupted" if stop.is_set else "complete", message=message)
