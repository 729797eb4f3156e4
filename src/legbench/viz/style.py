"""Colours and words of every picture, shared by the viewer and the print figures."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from legbench.phases import LARGEST_CODE, PhaseInfo, Role
from legbench.signals import Floats, Ints

Rgb = tuple[int, int, int]
Colours = NDArray[np.uint8]

STANCE: Rgb = (226, 88, 60)
FLIGHT: Rgb = (66, 133, 244)
MODE_1: Rgb = (230, 159, 0)
"""Colour of the polar mode w1."""
MODE_2: Rgb = (0, 172, 193)
"""Colour of the radial mode w2."""
FIRST: Rgb = (232, 110, 80)
"""Colour of component 1 of a series, such as q1 or tau1."""
SECOND: Rgb = (74, 144, 226)
FIRST_FAINT: Rgb = (150, 92, 78)
"""Colour of the desired value of component 1 of a series."""
SECOND_FAINT: Rgb = (74, 104, 142)
ACCENT: Rgb = (124, 179, 66)
FORCE: Rgb = (240, 180, 40)
GREY: Rgb = (128, 128, 128)
"""Grey that is readable on the viewer's dark and light themes."""
SEGMENT: Rgb = (150, 152, 160)
TRUNK: Rgb = (52, 104, 172)
BAR_GREEN: Rgb = (67, 160, 88)
BAR_BLACK: Rgb = (96, 98, 104)

COMPONENTS: tuple[Rgb, ...] = (FIRST, SECOND, ACCENT, MODE_1, MODE_2, GREY)
"""Colours of the components of a controller's own signal, in turn."""

PHASES: dict[Role, tuple[Rgb, ...]] = {
    Role.REST: ((120, 120, 128), (150, 150, 158), (92, 92, 100), (170, 164, 150)),
    Role.ACTING: ((214, 130, 40), (142, 108, 190), (158, 158, 120), (0, 150, 136)),
    Role.STANCE: ((236, 140, 96), (178, 60, 84), (0, 150, 136), STANCE),
    Role.FLIGHT: ((142, 108, 190), FLIGHT, (110, 170, 250), (84, 96, 200)),
}
"""Colours of a controller's phases, by their role for the leg."""

UNDECLARED: Rgb = (70, 70, 76)
"""Colour of a phase that no controller has declared."""

PERIODS_SHOWN = 20
"""Periods over which the colours run; later ones keep the last colour (the paper rates 20)."""

# Viridis at 17 equal steps: the colour map without matplotlib.
_VIRIDIS = np.array(
    [
        [68, 1, 84],
        [72, 24, 106],
        [71, 45, 123],
        [66, 64, 134],
        [59, 82, 139],
        [51, 99, 141],
        [44, 114, 142],
        [38, 130, 142],
        [33, 145, 140],
        [31, 160, 136],
        [40, 174, 128],
        [63, 188, 115],
        [94, 201, 98],
        [132, 212, 75],
        [173, 220, 48],
        [216, 226, 25],
        [253, 231, 37],
    ],
    dtype=np.float64,
)


@dataclass(frozen=True, slots=True, kw_only=True)
class AxisTitle:
    """Title of one axis: plain text for the viewer, mathematics for print."""

    text: str
    math: str


X1 = AxisTitle(text="x1 [rad]", math=r"$x_1$ [rad]")
X2 = AxisTitle(text="x2 [m]", math=r"$x_2$ [m]")
Q1 = AxisTitle(text="q1 [rad]", math=r"$q_1$ [rad]")
Q2 = AxisTitle(text="q2 [rad]", math=r"$q_2$ [rad]")
Z2 = AxisTitle(text="z2 [rad]", math=r"$z_2$ [rad]")
DZ2 = AxisTitle(text="dz2/dt [rad/s]", math=r"$\dot z_2$ [rad/s]")

POLAR_LEAST = 0.01
"""Shortest range of x1 that a plot shows [rad]: purely radial motion looks like a line."""

POLAR, JOINT, MODAL = "foot tip, polar", "joint space", "modal phase"
"""Titles of the three panels of Figs. 4 and 6."""


def viridis(fraction: Floats) -> Colours:
    """Colours (n, 3) of numbers (n,) in [0, 1]: dark violet, green, yellow."""
    knots = np.linspace(0.0, 1.0, len(_VIRIDIS))
    channels = [np.interp(fraction, knots, _VIRIDIS[:, channel]) for channel in range(3)]
    return np.round(np.stack(channels, axis=-1)).astype(np.uint8)


def period_colours(periods: NDArray[np.int64]) -> Colours:
    """Colours (n, 3) of period numbers (n,) on the viewer's dark or light ground."""
    share = np.minimum(periods, PERIODS_SHOWN - 1) / (PERIODS_SHOWN - 1)
    return viridis(0.25 + 0.70 * share)


def stance_colours(stance: NDArray[np.bool_]) -> Colours:
    """Colours (n, 3) of stance and flight."""
    palette = np.array([FLIGHT, STANCE], dtype=np.uint8)
    return palette[stance.astype(np.intp)]


def phase_colours(phases: Sequence[PhaseInfo]) -> dict[int, Rgb]:
    """Colour by the code of a phase: its role chooses the palette, its code the place in it.

    Phases of one role have different colours as long as the palette has any left.
    """
    taken: dict[int, Rgb] = {}
    for phase in phases:
        palette = PHASES[phase.role]
        turns = [palette[(phase.code + step) % len(palette)] for step in range(len(palette))]
        free = [colour for colour in turns if colour not in taken.values()]
        taken[phase.code] = (free or turns)[0]
    return taken


def colours_by_code(phases: Sequence[PhaseInfo], codes: Ints) -> Colours:
    """Colours (n, 3) of the phases with these codes (n,)."""
    palette = np.tile(np.array(UNDECLARED, dtype=np.uint8), (LARGEST_CODE + 1, 1))
    for code, colour in phase_colours(phases).items():
        palette[code] = colour
    return palette[np.clip(codes, 0, LARGEST_CODE)]


def faint(colour: Rgb) -> Rgb:
    """Return a colour half way to grey."""
    red, green, blue = ((own + grey) // 2 for own, grey in zip(colour, GREY, strict=True))
    return (red, green, blue)


def packed(colour: Rgb) -> int:
    """Colour as 0xRRGGBBAA, as rerun's state configuration requires it."""
    red, green, blue = colour
    return red << 24 | green << 16 | blue << 8 | 0xFF


def unit(colour: Rgb) -> tuple[float, float, float]:
    """Colour as three numbers in [0, 1], as matplotlib requires it."""
    red, green, blue = colour
    return (red / 255.0, green / 255.0, blue / 255.0)
