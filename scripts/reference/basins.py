"""Fates of many starts by brute force: every cell of a basin is followed hop by hop."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from reference.dop853 import Accuracy
from reference.hops import Hops
from reference.law import SCALE
from reference.legs import Legs, foot
from reference.verdicts import NEIGHBOUR, UNITS

from legbench.control import JumpConfig
from legbench.design import LegDesign
from legbench.signals import Bools, Floats

TOGETHER = 5000
"""Largest number of hops in a batch [-]."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Cells:
    """Starts of legs that hop, each around a periodic hop."""

    designs: Sequence[LegDesign]
    configs: Sequence[JumpConfig]
    """Leg and settings of each start."""
    centres: Floats
    """Periodic hops (6, n)."""
    starts: Floats
    """Starts (6, n)."""
    hops: int
    """Hops after which a start wanders [-]."""
    near: float
    """Distance from the periodic hop that counts as returned, in `UNITS` [-]."""


def fates(cells: Cells, accuracy: Accuracy | None = None) -> list[str]:
    """Fate of each start: `returns`, `wanders`, `stands`, `fell`, `fault` or `buried`."""
    at, legs = cells.starts.copy(), Legs.of(cells.designs)
    open_ = np.arange(at.shape[1])
    found = np.full(open_.size, "wanders", dtype="<U8")
    for _ in range(cells.hops):
        below = buried(legs.take(open_), at[:, open_])
        found[open_[below]] = "buried"
        open_ = open_[~below]
        ended = np.full(open_.size, "", dtype="<U8")
        for first in range(0, open_.size, TOGETHER):
            some = open_[first : first + TOGETHER]
            designs, configs = ([x[i] for i in some] for x in (cells.designs, cells.configs))
            stories = Hops(designs, configs, at[:, some], accuracy).run()
            at[:, some] = np.array([story.apex for story in stories]).T
            ended[first : first + TOGETHER] = [story.ending for story in stories]
        apart = np.abs(at[:, open_] - cells.centres[:, open_]).T / UNITS
        returned = (ended == "apex") & (np.max(apart, axis=1, initial=0.0) < cells.near)
        found[open_] = np.where(returned, "returns", np.where(ended == "apex", "wanders", ended))
        open_ = open_[(ended == "apex") & ~returned]
    return found.tolist()


def buried(legs: Legs, starts: Floats) -> Bools:
    """Whether the foot is below the ground at apexes (6, n)."""
    height, _, z1, z2, _, _ = starts
    y = SCALE * np.array([z1 - z2, z1 + z2, np.zeros_like(z1), np.zeros_like(z1)])
    return height + foot(legs, y)[0] < 0.0


def edges(cells: Cells, some: Sequence[int]) -> list[list[str]]:
    """Different fates of each of some starts and of the twelve beside it; one if on no edge."""
    if not some:
        return []
    units = np.concatenate([np.zeros((1, 6)), np.eye(6), -np.eye(6)]).T * UNITS[:, np.newaxis]
    width, columns = units.shape[1], np.repeat(some, units.shape[1])
    beside = Cells(
        designs=[cells.designs[i] for i in columns],
        configs=[cells.configs[i] for i in columns],
        centres=cells.centres[:, columns],
        starts=cells.starts[:, columns] + NEIGHBOUR * np.tile(units, len(some)),
        hops=cells.hops,
        near=cells.near,
    )
    found = fates(beside)
    return [sorted(set(found[width * i : width * (i + 1)])) for i in range(len(some))]
