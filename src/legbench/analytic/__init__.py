"""The leg on paper: equations of motion, impact and hybrid integration, without a simulator."""

from legbench.analytic.hybrid import HybridLeg, land
from legbench.analytic.model import LegModel
from legbench.analytic.smooth import Accuracy, Method
from legbench.analytic.state import LegState, Regime, Transition, energy, flying, standing
from legbench.analytic.terms import Bars, FloatingTerms, PairTerms, floating_terms, stance_terms

__all__ = [
    "Accuracy",
    "Bars",
    "FloatingTerms",
    "HybridLeg",
    "LegModel",
    "LegState",
    "Method",
    "PairTerms",
    "Regime",
    "Transition",
    "energy",
    "floating_terms",
    "flying",
    "land",
    "stance_terms",
    "standing",
]
