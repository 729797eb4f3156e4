"""Basin maps of random legs over two random coordinates against brute force.

    python scripts/check_basins.py [--maps 15] [--points 40] [--seed 0]

Map after map takes the next of the fifteen pairs of an apex's six coordinates, a random leg with
random settings that has a stable periodic hop, and a window of random size around it. Each cell is
followed by the batched DOP853 of scripts/reference until its fate is known, as the definition of a
basin says. A cell that differs lies on an edge if the reference alone gives another fate for one of
the twelve starts 1e-7 of the map's units beside it. Exit status 1 if another cell differs.
"""

import argparse
import sys
import tempfile
import time
from itertools import combinations
from pathlib import Path

import numpy as np

sys.path.append(str(Path(__file__).parents[1] / "tests" / "modes"))

from brute_basins import task_around
from random_hops import random_case, tools_of
from reference.basins import Cells, edges, fates
from reference.dop853 import Accuracy

from legbench.errors import LegbenchError
from legbench.modes.basin import BasinTask, Fate, map_basin
from legbench.modes.fixed_point import fixed_point
from legbench.modes.hop import NAMES, settle

PAIRS = list(combinations(range(len(NAMES)), 2))
"""Pairs of coordinates, by their places [-]."""
SETTLING = 60
"""Hops in which a leg finds its periodic hop [-]."""
TOLERANCE = 1e-12
"""Tolerance with which the periodic hop is sought [-]."""
STABLE = 0.7
"""Largest multiplier of a periodic hop that is mapped: others need many hops to return [-]."""
ROUGH = Accuracy(1e-9, 1e-11)
"""Tolerances of brute force; cells that differ are followed once more with finer ones."""
SPANS = (2.0, 12.0)
"""Smallest and largest half width of a map, in the map's units [-]."""


def random_map(number: int, points: int) -> BasinTask:
    """A random leg that hops, and a window around its hop."""
    random = np.random.default_rng((2, number))
    for _ in range(1000):
        case = random_case(random)
        tools = tools_of(case, TOLERANCE)
        if tools is None:
            continue
        leg, law = tools
        try:
            found = fixed_point(leg, law, settle(leg, law, case.start, SETTLING)[-1])
        except LegbenchError:
            continue
        if abs(found.multipliers[0]) < STABLE:
            pair, design = PAIRS[number % len(PAIRS)], case.design
            return task_around(design, case.config, found.apex, pair, points, random, SPANS)
    raise SystemExit(f"map {number}: no leg with a stable hop in 1000")


def cells_of(tasks: list[BasinTask]) -> Cells:
    """Cells of maps, one map after the other, row by row."""
    starts, centres, designs, configs = [], [], [], []
    for task in tasks:
        across, up = task.across.values(), task.up.values()
        centre = np.repeat(task.centre.vector()[:, np.newaxis], len(across) * len(up), axis=1)
        start = centre.copy()
        start[NAMES.index(task.across.name)] = np.tile(across, len(up))
        start[NAMES.index(task.up.name)] = np.repeat(up, len(across))
        starts.append(start)
        centres.append(centre)
        designs += [task.design] * start.shape[1]
        configs += [task.jump] * start.shape[1]
    return Cells(
        designs=designs,
        configs=configs,
        centres=np.concatenate(centres, axis=1),
        starts=np.concatenate(starts, axis=1),
        hops=tasks[0].hops,
        near=tasks[0].near,
    )


def mapped(task: BasinTask) -> list[str]:
    """Fates of a map's cells, row by row, as the package finds them."""
    with tempfile.TemporaryDirectory() as folder:
        found = map_basin(task, Path(folder) / "map.jsonl", workers=1)
    return [Fate(fate).name.lower() for fate in found.ravel().tolist()]


def compare(numbers: range, points: int) -> tuple[int, int]:
    """Print how some maps differ; return the numbers of wrong cells and of those on an edge."""
    tasks = [random_map(number, points) for number in numbers]
    told = [fate for task in tasks for fate in mapped(task)]
    cells = cells_of(tasks)
    wanted = fates(cells, ROUGH)
    differ = [
        cell for cell, pair in enumerate(zip(told, wanted, strict=True)) if pair[0] != pair[1]
    ]
    beside = dict(zip(differ, edges(cells, differ), strict=True))
    bad = on_edge = 0
    for place, (number, task) in enumerate(zip(numbers, tasks, strict=True)):
        mine = range(place * points**2, (place + 1) * points**2)
        counts = {fate: 0 for fate in sorted({wanted[cell] for cell in mine})}
        lines, wrong = [], 0
        for cell in mine:
            counts[wanted[cell]] += 1
            if cell not in beside or beside[cell] == [told[cell]]:
                continue  # the finer reference agrees
            row, column = divmod(cell - mine.start, points)
            edge = len(beside[cell]) > 1
            wrong += not edge
            lines.append(
                f"{'edge' if edge else 'WRONG'}: cell ({column}, {row}), map {told[cell]}, brute "
                f"force {' or '.join(beside[cell])}, start {cells.starts[:, cell].tolist()}"
            )
        bad, on_edge = bad + wrong, on_edge + len(lines) - wrong
        print(
            f"map {number}, {task.design.name}, {task.across.name} and "
            f"{task.up.name}: {wrong} of {points**2} cells differ, {len(lines) - wrong} more "
            f"on an edge; {counts}",
            *lines,
            sep="\n  ",
            flush=True,
        )
    return bad, on_edge


def main() -> int:
    """Print a line a map, and one a cell that differs."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--maps", type=int, default=len(PAIRS), help="number of maps [-]")
    parser.add_argument("--points", type=int, default=40, help="points a side of a map [-]")
    parser.add_argument("--seed", type=int, default=0, help="number of the first map [-]")
    parser.add_argument("--together", type=int, default=3, help="maps in one batch [-]")
    flags = parser.parse_args()
    bad = on_edge = 0
    began, end = time.monotonic(), flags.seed + flags.maps
    for first in range(flags.seed, end, flags.together):
        numbers = range(first, min(first + flags.together, end))
        wrong, grazing = compare(numbers, flags.points)
        bad, on_edge, done = bad + wrong, on_edge + grazing, numbers.stop - flags.seed
        left = (time.monotonic() - began) / done * (flags.maps - done) / 60.0
        print(f"{done} of {flags.maps} maps, {left:.0f} min left", file=sys.stderr, flush=True)
    print(
        f"{flags.maps} maps, {flags.maps * flags.points**2} cells: {bad} differ, {on_edge} more "
        "on an edge"
    )
    return int(bad > 0)


if __name__ == "__main__":
    raise SystemExit(main())
