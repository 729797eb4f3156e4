"""The two parallel bars of the leg on paper: trunk to shank, and thigh to foot."""

from typing import Any, Final, Protocol

import numpy as np

from legbench.mjcf import Linkage
from legbench.signals import Floats
from legbench.viz import style

CRANK: Final = Linkage().crank_length
"""Length of the cranks [m], that of the model: a design leaves it free."""
WIDTH: Final = 1.6
"""Width of the lines [pt]."""


class Canvas(Protocol):
    """Protocol of what draws lines, as a matplotlib Axes does."""

    def plot(self, *args: Any, **kwargs: Any) -> Any:
        """Draw lines."""
        ...


def draw_bars(canvas: Canvas, points: Floats, per_metre: float) -> Floats:
    """Draw both bars with their cranks, and return their four pivots off the joints (4, 2).

    The green one is parallel to the thigh and keeps the shank parallel to a crank at the trunk; the
    black one is parallel to the shank and keeps the foot parallel to the thigh.

    Args:
        canvas: where to draw.
        points: hip, knee, ankle and tip on the canvas (4, 2).
        per_metre: units of the canvas in a metre [1/m].
    """
    hip, knee, ankle = points[:3]
    along_thigh, along_shank = (
        per_metre * CRANK * (end - start) / np.linalg.norm(end - start)
        for start, end in ((hip, knee), (knee, ankle))
    )
    green = np.array([hip, hip + along_shank, knee + along_shank])
    black = np.array([knee, knee + along_thigh, ankle + along_thigh])
    for corners, colour in ((green, style.BAR_GREEN), (black, style.BAR_BLACK)):
        canvas.plot(*corners.T, color=style.unit(colour), linewidth=WIDTH, solid_joinstyle="round")
    return np.concatenate([green[1:], black[1:]])
