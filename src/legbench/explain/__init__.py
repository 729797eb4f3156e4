"""Explanations: which imperfections of a leg reproduce the ratings that were measured on it.

    believed = load_design("models/prototype.toml")
    found = explain(believed, step_target("text"), causes_named(None), pairs=True)
    found.best.imperfections          # what an experiment file takes

Thousands of imperfect legs are rated at once (`rate_many`), each as a run on the analytic plant
would be.
"""

from typing import TYPE_CHECKING

from legbench.lazily import lazy_names

if TYPE_CHECKING:
    from legbench.explain.causes import CAUSES, Cause, causes_named, combined
    from legbench.explain.engine import rate_many
    from legbench.explain.explanation import Explanation, explain
    from legbench.explain.fitting import CauseFit, fit_pairs, fit_singles
    from legbench.explain.rating import Shapes
    from legbench.explain.targets import Target, step_target

__all__ = [
    "CAUSES",
    "Cause",
    "CauseFit",
    "Explanation",
    "Shapes",
    "Target",
    "causes_named",
    "combined",
    "explain",
    "fit_pairs",
    "fit_singles",
    "rate_many",
    "step_target",
]
__getattr__ = lazy_names(
    __name__,
    {
        "CAUSES": "legbench.explain.causes",
        "Cause": "legbench.explain.causes",
        "CauseFit": "legbench.explain.fitting",
        "Explanation": "legbench.explain.explanation",
        "Shapes": "legbench.explain.rating",
        "Target": "legbench.explain.targets",
        "causes_named": "legbench.explain.causes",
        "combined": "legbench.explain.causes",
        "explain": "legbench.explain.explanation",
        "fit_pairs": "legbench.explain.fitting",
        "fit_singles": "legbench.explain.fitting",
        "rate_many": "legbench.explain.engine",
        "step_target": "legbench.explain.targets",
    },
)
