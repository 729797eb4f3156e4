"""How far a leg's springs differ from their design, learned from what they do; pure."""

from typing import final

LEARNING_TIME = 1.0
"""Time constant in which the mismatch of the springs is learned, and first time for it: two hops. A
leg that has only begun to sway is still watched by its sway [s]."""
MISMATCH = 0.06
"""Largest share by which both springs may differ from the design, each to another side [-]."""


@final
class SpringMismatch:
    """Springs that are stiffer or softer than the design says, as far as they differ.

    Torque that is unexplained in proportion to how far the springs are wound, for seconds, is
    theirs; an encoder that dies leaves a torque of its own. Least squares that forget.

    Attributes:
        share: unexplained torque per torque by which the springs are wound [-].
    """

    def __init__(self, torque: float, period: float) -> None:
        """Begin with springs as designed; those wound by less than a torque [N m] tell little."""
        self._memory, self._torque = round(LEARNING_TIME / period), torque
        self._least = torque**2
        self._seen, self._product, self._square = 0, 0.0, 0.0
        self.share = 0.0

    @property
    def known(self) -> bool:
        """Whether it has been learned for long enough."""
        return self._seen >= self._memory

    def learn(self, polar: float, wound: float) -> None:
        """Take what the likeliest support leaves unexplained in a cycle.

        Args:
            polar: torque along q1 + q2, infinite if the knee rules out all supports [N m].
            wound: torque by which the springs are wound [N m].
        """
        self._seen = min(self._seen + 1, self._memory)
        if abs(polar) > self._torque + MISMATCH * abs(wound):
            return  # That much is no spring's.
        gain = 1.0 / self._seen
        self._product += gain * (polar * wound - self._product)
        self._square += gain * (wound * wound - self._square)
        share = self._product / (self._square + self._least)
        self.share = min(max(share, -MISMATCH), MISMATCH)
