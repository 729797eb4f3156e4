"""The leg on paper: equations of motion, impact and hybrid integration, without a simulator."""

from typing import TYPE_CHECKING

from legbench.analytic.contact import land
from legbench.analytic.model import LegModel
from legbench.analytic.state import LegState, Regime, Transition, energy, flying, standing
from legbench.analytic.terms import Bars, FloatingTerms, PairTerms, floating_terms, stance_terms
from legbench.lazily import lazy_names

if TYPE_CHECKING:
    from legbench.analytic.hybrid import HybridLeg
    from legbench.analytic.smooth import Accuracy, RungeKutta

__all__ = [
    "Accuracy",
    "Bars",
    "FloatingTerms",
    "HybridLeg",
    "LegModel",
    "LegState",
    "PairTerms",
    "Regime",
    "RungeKutta",
    "Transition",
    "energy",
    "floating_terms",
    "flying",
    "land",
    "stance_terms",
    "standing",
]

# scipy alone takes several times as long to import as NumPy, and the compiled leg needs none of it.
__getattr__ = lazy_names(
    __name__,
    {
        "Accuracy": "legbench.analytic.smooth",
        "HybridLeg": "legbench.analytic.hybrid",
        "RungeKutta": "legbench.analytic.smooth",
    },
)
