"""Zero errors and noise of motor and link encoders, from the experiment's seed alone."""

from collections.abc import Sequence
from typing import Final, final

import numpy as np

from legbench.imperfections import Imperfections
from legbench.signals import Floats

AXES: Final = 4
"""Number of noises in a reading: two motors, then two links; all are drawn whoever is noisy, so
that a motor's noise is the same with and without noise on the links."""
BLOCK: Final = 256
"""Number of readings whose noise is drawn at once; it changes no number."""


@final
class EncoderErrors:
    """Errors of the encoders of one leg, or of one leg a row.

    The noise of a reading depends on the leg's seed and on how many readings came before it since
    the reset, and on nothing else.

    Attributes:
        motor: error of the motor encoders in this reading (..., 2) [rad].
        link: error of the link encoders in this reading (..., 2) [rad].
    """

    def __init__(
        self,
        imperfections: Imperfections | Sequence[Imperfections],
        seeds: int | Sequence[int] = 0,
    ) -> None:
        """Collect the errors of one leg, or of a batch with one seed for each leg."""
        one = isinstance(imperfections, Imperfections)
        legs = [imperfections] if one else list(imperfections)
        self._seeds = [seeds] * len(legs) if isinstance(seeds, int) else list(seeds)
        zero = np.array([leg.link_zero or (0.0, 0.0) for leg in legs])
        sigma = np.array(
            [(*(leg.motor_noise or (0.0, 0.0)), *(leg.link_noise or (0.0, 0.0))) for leg in legs]
        )
        self._zero = zero[0] if one else zero
        self._sigma, self._one = sigma, one
        self.exact = not (zero.any() or sigma.any())
        self._noisy = np.flatnonzero(sigma.any(axis=-1))
        self.reset()

    def reset(self) -> None:
        """Begin the noise anew."""
        self._random = [np.random.default_rng(self._seeds[leg]) for leg in self._noisy]
        drawn = BLOCK if self._random else 0
        self._block: Floats = np.zeros((drawn, len(self._sigma), AXES))
        self._next = BLOCK
        self.motor: Floats = np.zeros_like(self._zero)
        self.link: Floats = self._zero

    def advance(self) -> None:
        """Go on to the errors of the next reading."""
        if not self._random:
            return
        if self._next == BLOCK:
            for leg, random in zip(self._noisy, self._random, strict=True):
                self._block[:, leg] = random.standard_normal((BLOCK, AXES)) * self._sigma[leg]
            self._next = 0
        noise = self._block[self._next, 0] if self._one else self._block[self._next]
        self._next += 1
        self.motor, self.link = noise[..., :2].copy(), self._zero + noise[..., 2:]
