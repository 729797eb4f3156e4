"""The only while-loop: observation in, command out, one row a cycle."""

import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Protocol

from legbench.clock import AbstractClock, VirtualClock
from legbench.control import AbstractController
from legbench.control.check import CommandError, check_command
from legbench.errors import LegbenchError, PlantFault
from legbench.failures import defined_at, failed, own_lines
from legbench.interrupts import StopFlag
from legbench.limits.safety import OVERRUNS
from legbench.onlooker import Onlooker
from legbench.plant.abstract import AbstractPlant
from legbench.signals import Command, Floats, Observation

Progress = Callable[[int, int], None]
"""Function that is called now and then, and at the end, with cycles done and cycles in all."""
PROGRESS_EVERY = 250
"""Number of cycles between two calls of the progress function."""


class RowSink(Protocol):
    """Part of a recording that the loop needs."""

    def append(
        self, command: Command, observation: Observation, cycle_us: float, late_us: float
    ) -> None:
        """Take one row; must not wait."""
        ...


@dataclass(frozen=True, slots=True, kw_only=True)
class Outcome:
    """Outcome of a run: how it ended."""

    status: str
    """Status of the run: `complete`, `interrupted` (^C) or `fault`."""
    cause: str | None
    """Short name of the fault, if one ended the run."""
    message: str | None
    """Message for the user about the end; none if there is nothing to say."""
    cycles: int
    wall_time: float
    """Wall time of all cycles [s]."""
    time: float = 0.0
    """Plant time of the last observation [s]."""


def run(
    plant: AbstractPlant,
    controller: AbstractController,
    cycles: int,
    *,
    clock: AbstractClock | None = None,
    sink: RowSink | None = None,
    stop: StopFlag | None = None,
    progress: Progress | None = None,
    now: Callable[[], float] = time.perf_counter,
) -> Outcome:
    """Control a plant for a number of cycles.

    A run that has lasted its time then comes to rest in the controller's first posture
    (`AbstractPlant.rest`), which adds no row. A stop that comes before the first row ends the run
    there, with no cycle; from the first row on it ends the run between two rows.

    The first fault ends the run and is returned as its cause; every row until then is kept. What
    the controller raises, or returns instead of a command, is a fault, too ("controller failed"),
    and so is what the plant raises beside its faults ("plant failed"). A fault of missed ticks
    shows the controller if its step took longer than a period. Faults and exceptions of any kind
    close the plant before anything else happens: drives come to rest while disks are still busy.
    `progress` ends nothing, whatever it raises. The time `now` [s] measures cycles.

    Raises:
        PlantFault: the plant did not get to its start.
        RecordingError: the recording failed.
    """
    clock, stop = clock or VirtualClock(), stop or StopFlag()
    began = False
    try:
        stop.raises = True
        observation = _start(plant)
        began, stop.raises = True, False
        watched = progress if isinstance(progress, Onlooker) else Onlooker("progress", progress)
        outcome = _cycle(plant, controller, observation, cycles, clock, sink, stop, watched, now)
        return _to_rest(plant, controller.start_motor_pos, outcome, stop)
    except BaseException as error:
        stop.raises = False
        plant.close()
        if not began and isinstance(error, KeyboardInterrupt) and stop.is_set:
            return Outcome(status="interrupted", cause=None, message=None, cycles=0, wall_time=0.0)
        raise


def _start(plant: AbstractPlant) -> Observation:
    """Reset a plant; raises PlantFault also where it raises what no plant should."""
    try:
        return plant.reset()
    except LegbenchError:
        raise
    except Exception as error:
        plant.close()
        raise failed("plant", "on its way to the start", error, own_lines(error)) from error


def _cycle(
    plant: AbstractPlant,
    controller: AbstractController,
    observation: Observation,
    cycles: int,
    clock: AbstractClock,
    sink: RowSink | None,
    stop: StopFlag,
    progress: Onlooker,
    now: Callable[[], float],
) -> Outcome:
    """The loop itself, from the first observation on."""
    began = previous = now()
    cycle, cycle_us = 0, 0.0
    fault = _reset(plant, controller, observation)
    clock.start()
    while fault is None and cycle < cycles and not stop.is_set:
        late = clock.wait(cycle)
        asked = now()
        try:
            command = controller.step(observation)
            check_command(command, observation)
        except Exception as error:  # Whatever it is, the drives stop first.
            plant.close()
            fault = controller_failed(controller, error, observation.time)
            break
        took = now() - asked
        if sink is not None:
            sink.append(command, observation, cycle_us, 1e6 * late)
        cycle += 1
        try:
            observation = plant.step(command)
        except Exception as error:
            plant.close()
            fault = _plant_failed(error, observation, controller, took / plant.period)
            break
        if cycle % PROGRESS_EVERY == 0 or cycle == cycles:
            progress(cycle, cycles)
        ended = now()
        cycle_us, previous = 1e6 * (ended - previous), ended
    wall_time = now() - began
    status, cause, message = _ending(fault, stop)
    return Outcome(
        status=status,
        cause=cause,
        message=message,
        cycles=cycle,
        wall_time=wall_time,
        time=observation.time,
    )


def _ending(fault: PlantFault | None, stop: StopFlag) -> tuple[str, str | None, str | None]:
    """Return status, cause and message of a loop that has ended."""
    if fault is not None:
        return "fault", fault.cause, str(fault)
    return "interrupted" if stop.is_set else "complete", None, None


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


def _reset(
    plant: AbstractPlant, controller: AbstractController, observation: Observation
) -> PlantFault | None:
    """Show a controller the leg at rest; returns the fault of the run if that fails."""
    try:
        controller.reset(observation)
    except Exception as error:
        plant.close()
        return controller_failed(controller, error, observation.time)
    return None


def controller_failed(controller: AbstractController, error: Exception, time: float) -> PlantFault:
    """Return the fault that shows a controller's own lines; where it was told, its `step`.

    Args:
        controller: what has failed.
        error: what it has raised, or what is wrong with its command.
        time: plant time at which it was asked [s].
    """
    told = isinstance(error, CommandError | PlantFault)
    lines = defined_at(type(controller.law).step) if told else own_lines(error)
    return failed("controller", f"at t = {time:.3f} s", error, lines, told=told)


def _plant_failed(
    error: Exception, seen: Observation, controller: AbstractController, periods: float
) -> PlantFault:
    """Return the fault of a plant; of missed ticks with the step that took as many `periods`."""
    if not isinstance(error, PlantFault):
        return failed("plant", f"after t = {seen.time:.3f} s", error, own_lines(error))
    if error.cause != OVERRUNS or periods <= 1.0:
        return error
    what = f"{error}; the controller's step took {periods:.3g} periods"
    lines = defined_at(type(controller.law).step)
    return PlantFault(OVERRUNS, "".join([what, *(f"\n  {line}" for line in lines)]))
