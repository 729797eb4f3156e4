"""Ticks of an axis and their labels."""

import math
from itertools import pairwise

STEPS = (1.0, 2.0, 2.5, 5.0, 10.0)
"""Mantissas of a readable step."""


def tick_step(low: float, high: float, count: int) -> float:
    """The smallest readable step that makes at most `count` intervals of the range."""
    raw = (high - low) / count
    power = 10.0 ** math.floor(math.log10(raw))
    return next(step * power for step in STEPS if step * power >= raw * (1.0 - 1e-9))


def ticks(low: float, high: float, count: int = 5) -> list[float]:
    """Multiples of a readable step inside [low, high]."""
    step = tick_step(low, high, count)
    first, last = math.ceil(low / step - 1e-9), math.floor(high / step + 1e-9)
    return [index * step for index in range(first, last + 1)]


def tick_labels(values: list[float]) -> list[str]:
    """Labels of the values, with as many decimals as tell them apart and no negative zero."""
    spacing = min((b - a for a, b in pairwise(values)), default=1.0)
    decimals = 0
    while decimals < 9 and abs(round(spacing, decimals) - spacing) > 1e-6 * spacing:
        decimals += 1
    return [f"{round(value, decimals) + 0.0:.{decimals}f}" for value in values]
