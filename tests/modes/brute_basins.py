"""Basin cells by brute force: the compiled leg at its finest, and DOP853 with dense events."""

from dataclasses import replace

import numpy as np
from dense_hop import DenseHop
from dense_rules import Rules

from legbench.analytic import LegModel, flying
from legbench.analytic.taylor import TaylorLeg
from legbench.control import JumpConfig
from legbench.design import LegDesign
from legbench.errors import ConfigError
from legbench.modes.basin import BasinTask, Fate, GridAxis, attraction_in, fate_of
from legbench.modes.drive import JumpLaw
from legbench.modes.fixed_point import UNITS, fixed_point
from legbench.modes.hop import NAMES, Apex, settle

FINEST = 1e-15
NEIGHBOUR = 1e-7
"""Size of the disturbances that tell a cell on an edge of the basin, in the map's units [-]."""
ENDINGS = {"stands": Fate.STANDS, "fell": Fate.FELL, "fault": Fate.FAULT}


def random_task(design: LegDesign, seed: int, points: int) -> BasinTask:
    """A window of random size over two random coordinates, around the leg's periodic hop."""
    config, random = JumpConfig(), np.random.default_rng(seed)
    law = JumpLaw(config, design)
    leg = TaylorLeg(LegModel.of(design), probe=law.probe)
    start = Apex(height=0.27, speed=0.0, z1=0.0, z2=0.6, dz1=0.0, dz2=0.0)
    centre = fixed_point(leg, law, settle(leg, law, start, 60)[-1]).apex
    first, second = random.choice(6, 2, replace=False).tolist()
    return task_around(design, config, centre, (first, second), points, random)


def task_around(
    design: LegDesign,
    config: JumpConfig,
    centre: Apex,
    pair: tuple[int, int],
    points: int,
    random: np.random.Generator,
    spans: tuple[float, float] = (1.0, 6.0),
) -> BasinTask:
    """A window of random size, within `spans` map units, over two coordinates around a hop."""
    axes = []
    for place in pair:
        span = float(random.uniform(*spans)) * float(UNITS[place])
        middle = float(centre.vector()[place] + random.uniform(-0.5, 0.5) * span)
        axes.append(
            GridAxis(name=NAMES[place], low=middle - span, high=middle + span, count=points)
        )
    return BasinTask(
        design=design,
        jump=config,
        motor=(0.0, 0.0),
        undamped=False,
        centre=centre,
        across=axes[0],
        up=axes[1],
    )


def start_at(task: BasinTask, column: int, row: int) -> Apex:
    """The start of a cell."""
    vector = task.centre.vector()
    vector[NAMES.index(task.across.name)] = task.across.values()[column]
    vector[NAMES.index(task.up.name)] = task.up.values()[row]
    return Apex.of(vector)


def fate_by_dense(task: BasinTask, start: Apex) -> Fate:
    """What becomes of a start, by DOP853."""
    model, at = LegModel.of(task.design), start
    config = task.jump or JumpConfig()
    for _ in range(task.hops):
        try:
            flying(model, *at.angles(), at.state(model).trunk_pos, (0.0, 0.0))
        except ConfigError:
            return Fate.BURIED
        hop = DenseHop(model, Rules(config, task.design))
        story = hop.run(at.height, at.speed, *at.angles())
        if story.ending != "apex":
            return ENDINGS[story.ending]
        at = Apex.of(np.array(story.apex))
        if np.max(np.abs(at.vector() - task.centre.vector()) / UNITS) < task.near:
            return Fate.RETURNS
    return Fate.WANDERS


def on_an_edge(task: BasinTask, start: Apex) -> bool:
    """Whether starts beside this one end otherwise, at the finest tolerance."""
    leg, drive = replace(task, tolerance=FINEST).tools()
    fates = {
        fate_of(leg, drive, task, Apex.of(start.vector() + NEIGHBOUR * row * UNITS))
        for row in np.vstack([np.eye(6), -np.eye(6), np.zeros((1, 6))])
    }
    return len(fates) > 1


def differing(task: BasinTask, dense: int, seed: int) -> tuple[list[str], int]:
    """Cells whose fate differs from brute force, one line each, and how many lie on an edge.

    All cells are compared with the finest tolerance, `dense` random ones with DOP853, too.
    """
    (leg, drive), attraction = task.tools(), attraction_in(task)
    fine, _ = replace(task, tolerance=FINEST).tools()
    random, wrong, edges = np.random.default_rng(seed), [], 0
    count = task.across.count * task.up.count
    chosen = set(random.choice(count, min(dense, count), replace=False).tolist())
    for cell in range(count):
        row, column = divmod(cell, task.across.count)
        start = start_at(task, column, row)
        told = fate_of(leg, drive, task, start, attraction)
        others = [fate_of(fine, drive, task, start)]
        if cell in chosen:
            others.append(fate_by_dense(task, start))
        if any(other is not told for other in others):
            if on_an_edge(task, start):
                edges += 1
            else:
                wrong.append(f"({column}, {row}) {told.name}, brute force {others}: {start}")
    return wrong, edges
