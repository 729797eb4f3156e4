"""Choosing the paper's equations; imports SciPy only when they are opened."""

from dataclasses import asdict, dataclass, replace
from typing import ClassVar

from legbench.guests import load_text
from legbench.limits.safety import SafetyLimits
from legbench.plant.design_limits import open_limited
from legbench.plant.opening import Leg, OpenPlant


@dataclass(frozen=True, slots=True, kw_only=True)
class AnalyticChoice:
    """Settings of the analytic plant, which computes the paper's equations."""

    kind: ClassVar[str] = "analytic"
    imperfect: ClassVar[bool] = True
    limits: SafetyLimits | None = None
    """Safety limits, by default none [a limits file]."""

    def open(self, leg: Leg) -> OpenPlant:
        """Open the leg of the equations.

        Raises:
            ConfigError: the limits are looser than the design, or the boom is shorter than the leg.
        """
        make = load_text("legbench.plant.analytic:AnalyticPlant")
        accuracy = load_text("legbench.analytic.smooth:Accuracy")()
        plant = make(
            leg.design,
            leg.options.setup,
            leg.start,
            leg.servo,
            accuracy,
            imperfections=leg.imperfections,
            seed=leg.seed,
        )
        opened = open_limited(plant, self.limits, leg)
        return replace(opened, facts={"accuracy": asdict(accuracy)} | opened.facts)
