"""Words in a film's pictures: the time, and a scale as long as it says."""

from functools import cache
from typing import Final

import numpy as np

from legbench.viz.film._imageio import Image as Picture
from legbench.viz.film._imageio import ImageDraw, ImageFont
from legbench.viz.film.offscreen import Image

LENGTHS_MM: Final = (1, 2, 5, 10, 20, 50, 100, 200, 500, 1000, 2000, 5000)
"""Lengths that the scale may have [mm]."""
LONGEST: Final = 0.3
"""Longest scale, as a share of the picture's width [-]."""
SMALLEST_SIZE: Final = 11
"""Smallest size of the words that can be read [pixels]."""
HEIGHT_SHARE: Final = 0.032
"""Size of the words, as a share of the picture's height [-]."""
INK: Final = (30, 32, 38)
"""Colour of words and scale, dark on the sky and on the ground."""


def scale_length_mm(scale: float, width: int) -> int:
    """Length of the longest scale that fits a picture of that `width` [mm].

    Args:
        scale: pixels a metre at the leg [1/m].
        width: width of the picture [pixels].
    """
    room = LONGEST * width
    fitting = [length for length in LENGTHS_MM if 1e-3 * length * scale <= room]
    return fitting[-1] if fitting else LENGTHS_MM[0]


def labelled(image: Image, time: float, scale: float) -> Image:
    """Return a picture with the time above its lower left corner, and under it the scale.

    Args:
        image: picture (height, width, 3).
        time: plant time that it shows [s].
        scale: pixels a metre at the leg [1/m].
    """
    height, width = image.shape[:2]
    size = max(SMALLEST_SIZE, round(HEIGHT_SHARE * height))
    length = scale_length_mm(scale, width)
    picture = Picture.fromarray(image)
    pen, font = ImageDraw.Draw(picture), _font(size)
    left, foot = size, height - size
    right = left + round(1e-3 * length * scale)
    thick = max(2, size // 7)
    pen.line([(left, foot), (right, foot)], fill=INK, width=thick)
    for end in (left, right):
        pen.line([(end, foot - 2 * thick), (end, foot + 2 * thick)], fill=INK, width=thick)
    pen.text((left, foot - 3 * thick), f"{length} mm", fill=INK, font=font, anchor="lb")
    pen.text(
        (left, foot - 3 * thick - 1.5 * size), f"{time:.3f} s", fill=INK, font=font, anchor="lb"
    )
    return np.array(picture)


@cache
def _font(size: int) -> ImageFont.FreeTypeFont | ImageFont.ImageFont:
    """Font that Pillow brings along, in a size [pixels]."""
    return ImageFont.load_default(size)
