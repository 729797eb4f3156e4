"""Basin of a periodic hop: a grid of starts, each followed until its end is known.

Rows of the grid are written to a file as they are finished, so an interrupted map continues where
it stopped. The file begins with everything that decides the map; another map is refused.
"""

import json
import math
import multiprocessing
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor, as_completed
from contextlib import contextmanager
from dataclasses import asdict, dataclass, replace
from enum import IntEnum
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from legbench.analytic import LegModel
from legbench.analytic.compiled import TOLERANCE
from legbench.analytic.taylor import MAP_TOLERANCE, TaylorLeg
from legbench.control import JumpConfig
from legbench.design import LegDesign
from legbench.design.toml import design_to_mapping
from legbench.errors import ConfigError, UnwritableError
from legbench.interrupts import children_without_interrupts, ignore_interrupts, shielded
from legbench.modes.attraction import Attraction, find_attraction
from legbench.modes.drive import AbstractDrive, JumpLaw, Passive
from legbench.modes.fixed_point import UNITS
from legbench.modes.hop import NAMES, Apex, Ending, return_map
from legbench.reading import parse_json
from legbench.signals import Floats, Ints

Progress = Callable[[int, int], None]
LARGE = 1000
"""Number of cells from which on it pays to look for the neighbourhood that attracts [-]."""


class Fate(IntEnum):
    """Outcome of the hops from one start."""

    RETURNS = 0
    """The leg ends in the periodic hop."""
    WANDERS = 1
    """The leg still hops, but is not (yet) near the periodic hop."""
    STANDS = 2
    """The leg stops hopping and stands."""
    FELL = 3
    """The leg leans so far that it falls."""
    FAULT = 4
    """The integration failed."""
    BURIED = 5
    """The foot would be below the ground at the start."""


ENDINGS = {Ending.STANDS: Fate.STANDS, Ending.FELL: Fate.FELL, Ending.FAULT: Fate.FAULT}


@dataclass(frozen=True, slots=True, kw_only=True)
class GridAxis:
    """Axis of the grid: a coordinate of the apex and its range.

    Raises:
        ConfigError: an unknown number of the apex, or an empty range.
    """

    name: str
    """One of the apex's six numbers."""
    low: float
    high: float
    count: int

    def __post_init__(self) -> None:
        if self.name not in NAMES:
            raise ConfigError(f"axis '{self.name}' is unknown; an apex has {', '.join(NAMES)}")
        if not (self.low < self.high and self.count >= 2):
            raise ConfigError(
                f"axis {self.name} runs from {self.low:g} to {self.high:g} in {self.count} points; "
                "it needs low < high and two points or more"
            )

    def values(self) -> Floats:
        """The grid points (count,)."""
        return np.linspace(self.low, self.high, self.count)


@dataclass(frozen=True, slots=True, kw_only=True)
class BasinTask:
    """Everything that decides a basin map.

    Raises:
        ConfigError: both axes the same, or no hop at all.
    """

    design: LegDesign
    jump: JumpConfig | None
    """Settings of the jump controller; if there are none, the motors are held at `motor`."""
    motor: tuple[float, float]
    """Motor positions without a jump controller [rad]."""
    undamped: bool
    centre: Apex
    """The periodic hop; starts differ from it along the axes only."""
    across: GridAxis
    up: GridAxis
    hops: int = 25
    """Number of hops after which a start counts as `Fate.WANDERS`."""
    tolerance: float = MAP_TOLERANCE
    """Tolerance of the integration; far below `near`, which decides [-]."""
    near: float = 0.05
    """Distance from the periodic hop that counts as returned, in `fixed_point.UNITS` [-]."""

    def __post_init__(self) -> None:
        if self.across.name == self.up.name:
            raise ConfigError(f"both axes are {self.up.name}; a map needs two different ones")
        if self.hops < 1:
            raise ConfigError(f"hops is {self.hops}; it must be 1 or more")

    def text(self) -> str:
        """One line of JSON; equal for equal questions."""
        content = asdict(self) | {"design": design_to_mapping(self.design)}
        return json.dumps(content, sort_keys=True)

    def tools(self) -> tuple[TaylorLeg, AbstractDrive]:
        """The compiled leg and its drive."""
        model = LegModel.of(self.design, undamped=self.undamped)
        drive = JumpLaw(self.jump, self.design) if self.jump else Passive(self.motor)
        return TaylorLeg(model, probe=drive.probe, tolerance=self.tolerance), drive


def fate_of(
    leg: TaylorLeg,
    drive: AbstractDrive,
    task: BasinTask,
    start: Apex,
    attraction: Attraction | None = None,
) -> Fate:
    """Outcome of the hops from a start, followed until it is known.

    An `attraction` tells of many legs some hops earlier that they will return.
    """
    wanted, at, before = task.centre.vector(), start, math.inf
    for hop in range(task.hops):
        try:
            done = return_map(leg, drive, at)
        except ConfigError:
            return Fate.BURIED
        if done.after is None:
            return ENDINGS[done.ending]
        at, vector = done.after, done.after.vector()
        if np.max(np.abs(vector - wanted) / UNITS) < task.near:
            return Fate.RETURNS
        if attraction is not None:
            distance = attraction.distance(vector)
            if max(before, distance) <= attraction.radius:
                left = task.hops - 1 - hop
                if attraction.hops_to(task.near, distance) <= left:
                    return Fate.RETURNS
            before = distance
    return Fate.WANDERS


def attraction_in(task: BasinTask) -> Attraction | None:
    """Neighbourhood of the periodic hop from which every leg returns, if there is one.

    Motors that are held give no derivative at a touchdown without speed, and so no neighbourhood.
    """
    if task.jump is None:
        return None
    (leg, drive), (exact, _) = task.tools(), replace(task, tolerance=TOLERANCE).tools()
    return find_attraction(leg, exact, drive, task.centre, task.near, task.hops)


_worker: tuple[BasinTask, TaylorLeg, AbstractDrive] | None = None


def _start_worker(task: BasinTask) -> None:
    global _worker
    _worker = (task, *task.tools())


def _start_process(task: BasinTask) -> None:
    # ^C goes to the whole group; a worker that dies of it takes the queue's lock along, and the
    # one who tidies up waits for ever.
    ignore_interrupts()
    _start_worker(task)


def _row(attraction: Attraction | None, index: int) -> tuple[int, list[int]]:
    if _worker is None:
        raise RuntimeError("the worker was not started")
    task, leg, drive = _worker
    places = {name: NAMES.index(name) for name in (task.across.name, task.up.name)}
    vector = task.centre.vector()
    vector[places[task.up.name]] = task.up.values()[index]
    fates = []
    for value in task.across.values():
        vector[places[task.across.name]] = value
        fates.append(int(fate_of(leg, drive, task, Apex.of(vector), attraction)))
    return index, fates


def _read(path: Path, task: BasinTask) -> dict[int, list[int]]:
    """Rows that an earlier run has finished; a last line that was cut off is left out."""
    lines = path.read_text(encoding="utf-8").splitlines()
    if not lines or lines[0] != task.text():
        raise ConfigError(
            f"{path} belongs to another map; give a new file or remove it to start afresh"
        )
    rows: dict[int, list[int]] = {}
    for line in lines[1:]:
        try:
            entry = parse_json(line)
            index, fates = int(entry["row"]), [int(fate) for fate in entry["fates"]]
        except (ValueError, KeyError, TypeError):
            continue
        if len(fates) == task.across.count and 0 <= index < task.up.count:
            rows[index] = fates
    return rows


def map_basin(
    task: BasinTask, path: Path, *, workers: int = 2, progress: Progress | None = None
) -> Ints:
    """Fates (up, across) of the whole grid; written to `path` row by row.

    Raises:
        ConfigError: `path` holds the rows of another task, or cannot be written; no worker.
    """
    if workers < 1:
        raise ConfigError(f"workers is {workers}; a map needs 1 process or more")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        rows = _read(path, task) if path.exists() else {}
        text = "\n".join([task.text(), *(_line(*row) for row in sorted(rows.items()))])
        path.write_text(text + "\n", encoding="utf-8")
        todo = [index for index in range(task.up.count) if index not in rows]
        with path.open("a", encoding="utf-8") as file:
            for index, fates in _rows(task, todo, workers):
                rows[index] = fates
                file.write(_line(index, fates) + "\n")
                file.flush()
                if progress is not None:
                    progress(len(rows), task.up.count)
    except OSError as error:
        raise UnwritableError(f"{path} cannot be written: {error}") from error
    return np.array([rows[index] for index in range(task.up.count)], dtype=np.int64)


def _line(index: int, fates: list[int]) -> str:
    return json.dumps({"row": index, "fates": fates})


def _rows(task: BasinTask, todo: list[int], workers: int) -> Iterator[tuple[int, list[int]]]:
    if not todo:
        return
    large = len(todo) * task.across.count >= LARGE
    if workers == 1:
        _start_worker(task)
        yield from map(partial(_row, attraction_in(task) if large else None), todo)
        return
    with _pool(task, workers) as pool:
        # A submission starts a worker if none is idle; one that ^C reached while it loads its
        # modules would die before it could ignore it. They load while the neighbourhood is sought.
        with children_without_interrupts():
            for _ in range(workers):
                pool.submit(int)
        row = partial(_row, attraction_in(task) if large else None)
        with children_without_interrupts():
            futures = [pool.submit(row, index) for index in todo]
        for future in as_completed(futures):
            yield future.result()


@contextmanager
def _pool(task: BasinTask, workers: int) -> Iterator[ProcessPoolExecutor]:
    """Pool of new processes; they are not forked, since a compiled leg does not survive a fork."""
    context: Any = multiprocessing.get_context("spawn")
    with shielded():  # A ^C in the middle would leave semaphores behind, with a warning of them.
        pool = ProcessPoolExecutor(
            workers, mp_context=context, initializer=_start_process, initargs=(task,)
        )
    try:
        yield pool
    finally:
        pool.shutdown(cancel_futures=True)
