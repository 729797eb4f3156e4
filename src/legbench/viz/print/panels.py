"""Panels of a print figure, row by row: the planes, the differences, the own signals."""

from dataclasses import dataclass

from legbench.viz.print._matplotlib import Axes, Figure

WIDTH_INCH, PLANES_INCH, OWN_INCH = 10.0, 3.7, 2.2
"""Width of a figure, heights of the row of planes and of each row of own signals [inch]."""
COMPARED_INCH = (3.84, 2.56)
"""Heights of the rows of planes and of differences, if there are both [inch]."""
OWN_COLUMNS = 3
"""Largest number of own signals in a row."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Panels:
    """Panels of a figure."""

    planes: list[Axes]
    """Polar, joint and modal plane."""
    differences: list[Axes]
    """Differences to other runs over time, of the radial mode and of the joints; or none."""
    own: list[Axes]
    """Signals of the controller over time, one panel each."""


def size_of(compared: bool, own: int) -> tuple[float, float]:
    """Width and height of a figure [inch], see `panels_of`."""
    return WIDTH_INCH, sum(_heights(compared, own))


def panels_of(figure: Figure, compared: bool, own: int) -> Panels:
    """Make the panels of a figure.

    Args:
        figure: the figure, as large as `size_of` says.
        compared: make the two panels of differences.
        own: number of own signals; a row that is not full is shared out among its panels.
    """
    if not (compared or own):
        planes = [figure.add_subplot(1, 3, place) for place in (1, 2, 3)]
        return Panels(planes=planes, differences=[], own=[])
    heights = _heights(compared, own)
    grid = figure.add_gridspec(len(heights), 6, height_ratios=heights)
    last = len(heights) - len(_in_rows(own))
    return Panels(
        planes=[figure.add_subplot(grid[0, first : first + 2]) for first in (0, 2, 4)],
        differences=[
            figure.add_subplot(grid[1, first : first + 3]) for first in (0, 3) if compared
        ],
        own=[
            figure.add_subplot(grid[last + row, first : first + 6 // count])
            for row, count in enumerate(_in_rows(own))
            for first in range(0, 6, 6 // count)
        ],
    )


def _in_rows(own: int) -> list[int]:
    """Number of own signals in each of their rows."""
    return [min(OWN_COLUMNS, own - first) for first in range(0, own, OWN_COLUMNS)]


def _heights(compared: bool, own: int) -> list[float]:
    above = COMPARED_INCH if compared else (PLANES_INCH,)
    return [*above, *(OWN_INCH for _ in _in_rows(own))]
