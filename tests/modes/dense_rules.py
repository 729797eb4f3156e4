"""The jump controller's rules in continuous time, apart from the levels of a probe."""

import math
from collections.abc import Callable, Sequence
from typing import Any

from legbench.control import JumpConfig, LegTargets
from legbench.design import LegDesign
from legbench.design.statics import Support

SCALE = math.sqrt(0.5)
Condition = Callable[[float, Sequence[float]], float]
"""Function of time and state that is positive once the event is due."""


class Rules:
    """The jump controller's rules on the angles of a leg, in continuous time."""

    def __init__(self, config: JumpConfig, design: LegDesign) -> None:
        targets = LegTargets(designs=design, support=Support.FOOT)
        self.config, (self.k1, self.k2) = config, design.stiffness
        folded = targets.motor_at(config.z2 + config.dz2, "z2 + dz2")
        stretched = targets.motor_at(config.z2 - config.dz2, "z2 - dz2")
        self.motors = {"push": tuple(stretched.tolist()), "": tuple(folded.tolist())}
        rest = targets.link_at_rest(folded)
        self.standing = -self.torque(self.motors[""], rest.tolist())
        self.phase, self.since, self.loaded, self.extreme = "flight", 0.0, False, 0.0

    def torque(self, motor: Any, q: Any) -> float:
        """Modal spring torque along z2 [N m]."""
        return SCALE * (self.k2 * (motor[1] - q[1]) - self.k1 * (motor[0] - q[0]))

    @property
    def motor(self) -> Any:
        """Where the motors are [rad]."""
        return self.motors.get(self.phase, self.motors[""])

    def load(self, q: Any) -> float:
        """Share of the load of standing."""
        return -self.torque(self.motor, q) / self.standing

    def fold(self, q: Any) -> float:
        """Motor less deflection along z2 [rad]."""
        motor = SCALE * (self.motor[1] - self.motor[0])
        return motor - self.torque(self.motor, q) / min(self.k1, self.k2)

    def conditions(self) -> dict[str, Condition]:
        """What ends the phase."""
        c = self.config
        match self.phase:
            case "flight" if self.loaded:
                return {
                    "unloaded": lambda _, y: c.touchdown_load - self.load(y[:2]),
                    "touched": lambda t, _: t - self.since - c.touchdown_time,
                }
            case "flight":
                return {"loaded": lambda _, y: self.load(y[:2]) - c.touchdown_load}
            case "compress":
                return {"turned": lambda _, y: self.extreme - self.fold(y[:2]) - c.apex_turn}
            case "push":
                return {
                    "released": lambda _, y: c.release_load - self.load(y[:2]),
                    "turned": lambda _, y: self.fold(y[:2]) - self.extreme - c.apex_turn,
                }
            case _:
                return {"waited": lambda t, _: t - self.since - c.release_time}

    def look(self, q: Any) -> None:
        """Keep the extreme of the fold."""
        if self.phase == "compress":
            self.extreme = max(self.extreme, self.fold(q))
        elif self.phase == "push":
            self.extreme = min(self.extreme, self.fold(q))

    def obey(self, what: str, time: float, q: Any) -> None:
        """Go over to what comes next."""
        if what in ("loaded", "unloaded"):
            self.loaded, self.since = what == "loaded", time
            return
        before = {"touched": "compress", "waited": "flight", "released": "release"}
        after = "push" if self.phase == "compress" else "release"
        self.phase = before.get(what, after)
        self.since, self.loaded, self.extreme = time, False, self.fold(q)
