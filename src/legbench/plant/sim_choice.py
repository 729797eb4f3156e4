"""Choosing the simulated leg; imports MuJoCo only when it is opened."""

from dataclasses import dataclass
from typing import ClassVar

from legbench.guests import load_text
from legbench.limits.safety import SafetyLimits
from legbench.plant.design_limits import open_limited
from legbench.plant.opening import Leg, OpenPlant


@dataclass(frozen=True, slots=True, kw_only=True)
class SimChoice:
    """Settings of the simulated plant, in MuJoCo."""

    kind: ClassVar[str] = "sim"
    imperfect: ClassVar[bool] = True
    limits: SafetyLimits | None = None
    """Safety limits, by default none [a limits file]."""

    def open(self, leg: Leg) -> OpenPlant:
        """Open the leg in MuJoCo; raises ConfigError if the limits are looser than the design."""
        plant = load_text("legbench.plant.sim:SimPlant")
        opened = plant(leg.design, leg.options, leg.start, leg.servo, leg.imperfections, leg.seed)
        return open_limited(opened, self.limits, leg)
