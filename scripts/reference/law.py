"""The jump controller without sampling, as rules of one leg on one linear function of its angles.

Both the load and the fold of the leg are `y = s (k2 q2 - k1 q1) / k`, s = sqrt(1/2), k the softer
spring, up to constants that depend on the motors: `load = (k y - offset) / standing` with
`offset = s (k2 m2 - k1 m1)`, and the fold is y itself while the motors stand still.
"""

import math
from dataclasses import dataclass

import numpy as np

from legbench.control import JumpConfig
from legbench.design import LegDesign

GRAVITY = 9.81
"""Acceleration of gravity [m/s^2]."""
NEVER = 1e6
"""Level that no angle reaches [rad], and a time that no hop reaches [s]."""
SCALE = math.sqrt(0.5)


@dataclass(frozen=True, slots=True, kw_only=True)
class Settings:
    """Numbers of one leg's controller."""

    probe: tuple[float, float]
    """Factors of q1 and q2 in y [-]."""
    folded: tuple[float, float]
    """Motors that carry the standing leg at z2 + dz2 [rad]."""
    stretched: tuple[float, float]
    """Motors that carry it at z2 - dz2 [rad]."""
    landed: float
    """The y above which a leg is loaded, its motors folded [rad]."""
    lifted: float
    """The y below which a push has lifted the leg, its motors stretched [rad]."""
    turn: float
    """Way back from an extreme of y that shows it [rad]."""
    touchdown_time: float
    """Time for which the load of a touchdown lasts [s]."""
    release_time: float
    """Time from release to flight [s]."""

    @classmethod
    def of(cls, config: JumpConfig, design: LegDesign) -> "Settings":
        """Settings of a leg from its statics: `q_d = q + g(q) / k` with g of Appendix I."""
        trunk, (m1, m2, m3) = design.trunk_mass, (part.mass for part in design.segments)
        (c1, c2, c3), (l1, l2, l3) = (part.com for part in design.segments), design.lengths
        t1 = (trunk + m1) * l1 - c1 * m1
        t2 = (trunk + m1 + m2) * l2 - c2 * m2
        t3 = (trunk + m1 + m2 + m3) * l3 - c3 * m3
        (k1, k2), soft = design.stiffness, min(design.stiffness)

        def torque(z2: float) -> tuple[float, float]:
            sine = math.sin(SCALE * z2)
            return GRAVITY * sine * (t1 + t3), -GRAVITY * sine * t2

        def motors(z2: float) -> tuple[float, float]:
            g1, g2 = torque(z2)
            return -SCALE * z2 + g1 / k1, SCALE * z2 + g2 / k2

        g1, g2 = torque(config.z2 + config.dz2)
        standing = SCALE * (g1 - g2)
        folded, stretched = motors(config.z2 + config.dz2), motors(config.z2 - config.dz2)

        def level(share: float, motor: tuple[float, float]) -> float:
            return (share * standing + SCALE * (k2 * motor[1] - k1 * motor[0])) / soft

        return cls(
            probe=(-SCALE * k1 / soft, SCALE * k2 / soft),
            folded=folded,
            stretched=stretched,
            landed=level(config.touchdown_load, folded),
            lifted=level(config.release_load, stretched),
            turn=config.apex_turn,
            touchdown_time=config.touchdown_time,
            release_time=config.release_time,
        )


class Law:
    """State of one leg's controller, which begins in flight and without load.

    Attributes:
        phase: flight, compress, push or release.
        alarm: time at which `wake` is due [s].
        upper, lower: values of y at which `rise` and `fall` are due [rad].
        turning: 1 if the next minimum of y is due, -1 if its next maximum is, 0 if neither.
        motor: motor positions [rad].
    """

    def __init__(self, settings: Settings) -> None:
        self.settings = settings
        self._enter("flight")

    def rise(self, time: float) -> str:
        """Handle a rise of y through the upper level; return what it means."""
        if self.phase == "push":
            self._release(time)
            return "turned"
        self.alarm = time + self.settings.touchdown_time
        self.upper, self.lower = NEVER, self.settings.landed
        return "loaded"

    def fall(self, time: float, y: float) -> str:
        """Handle a fall of y through the lower level; return what it means."""
        match self.phase:
            case "compress":
                self._enter("push")
                self.turning, self.lower = 1, self.settings.lifted
                self.upper = y + self.settings.turn
                return "turned"
            case "push":
                self._release(time)
                return "released"
            case _:
                self._enter("flight")
                return "unloaded"

    def extreme(self, y: float) -> None:
        """Handle what may be the largest y of a compression, or the smallest of a push."""
        if self.phase == "compress":
            self.lower = max(self.lower, y - self.settings.turn)
        elif self.phase == "push":
            self.upper = min(self.upper, y + self.settings.turn)

    def wake(self, y: float) -> str:
        """Handle the alarm: a load has lasted, or the release is over."""
        if self.phase == "flight":
            self._enter("compress")
            self.turning, self.lower = -1, y - self.settings.turn
            return "touched"
        self._enter("flight")
        return "waited"

    @property
    def settled(self) -> bool:
        """Whether an apex may be told now."""
        return self.phase in ("flight", "release")

    def _release(self, time: float) -> None:
        self._enter("release")
        self.alarm = time + self.settings.release_time

    def _enter(self, phase: str) -> None:
        settings = self.settings
        self.phase, self.alarm, self.turning = phase, NEVER, 0
        self.upper = settings.landed if phase == "flight" else NEVER
        self.lower = -NEVER
        self.motor = settings.stretched if phase == "push" else settings.folded


def probes(settings: list[Settings]) -> np.ndarray:
    """Factors of the probe of many legs (2, n)."""
    return np.array([each.probe for each in settings]).T
