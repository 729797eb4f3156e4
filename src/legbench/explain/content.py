"""An explanation as plain values, for JSON."""

from dataclasses import asdict
from typing import Any

from legbench.explain.apart import ProposedExperiment
from legbench.explain.explanation import Explanation, JudgedFit
from legbench.explain.fitting import CauseFit
from legbench.explain.words import sentences


def explanation_content(found: Explanation) -> dict[str, Any]:
    """Everything that was found; sizes in the units that stand beside them."""
    target = found.target
    return {
        "design": found.design.name,
        "complete": found.complete,
        "target": {**asdict(target), "setup": str(target.setup), "shape": [*target.shape]},
        "perfect": _judged(found.perfect),
        "effects": [
            {
                "cause": row.cause.name,
                "size": row.size,
                "unit": row.cause.unit or "1",
                "ratings": [*row.ratings],
                "change": row.change,
            }
            for row in found.sensitivities
        ],
        "screened": [
            {"cause": row.cause.name, "whole": row.whole, "other": row.other}
            for row in found.screened
        ],
        "singles": [_fit(fit) for fit in found.singles],
        "pairs": [_fit(fit) for fit in found.pairs],
        "judged": [_judged(judged) for judged in found.judged],
        "reaching": found.reaching,
        "alike": [fit.name for fit in found.alike],
        "motor_ends": [{**asdict(end), "setup": str(end.setup)} for end in found.ends],
        "proposals": [_proposal(each) for each in found.proposals],
        "sentences": sentences(found),
    }


def _fit(fit: CauseFit) -> dict[str, Any]:
    return {
        "causes": [
            {"cause": cause.name, "size": size, "unit": cause.unit or "1"}
            for cause, size in zip(fit.causes, fit.sizes, strict=True)
        ],
        "ratings": [*fit.ratings],
        "misfit": fit.misfit,
        "worst": fit.worst,
        "within": fit.within,
        "monotone": fit.monotone,
        "stretch": fit.stretch,
    }


def _judged(judged: JudgedFit) -> dict[str, Any]:
    return {
        **_fit(judged.fit),
        "checks": [asdict(check) for check in judged.checks],
        "jump": None if judged.hop is None else asdict(judged.hop),
    }


def _proposal(proposal: ProposedExperiment) -> dict[str, Any]:
    rows = zip(proposal.names, proposal.ratings.tolist(), proposal.posture.tolist(), strict=True)
    return {
        "setup": str(proposal.setup),
        "z2": proposal.z2,
        "dz2": proposal.dz2,
        "told_apart": proposal.told,
        "pairs": proposal.pairs,
        "nearest": proposal.nearest,
        "nearest_names": [*proposal.nearest_names],
        "predictions": [
            {"causes": name, "ratings": ratings, "posture": posture}
            for name, ratings, posture in rows
        ],
    }
