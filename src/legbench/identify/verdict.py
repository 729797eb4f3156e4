"""Whether estimates are to be trusted, and every reason why not."""

from typing import Final

from legbench.identify.adequacy import SIGNIFICANT
from legbench.identify.alternatives import named
from legbench.identify.outcome import Identification

UNCERTAIN: Final = 0.2
"""Half width of an interval, as a share of the value, from which a parameter is not known [-]."""


def reasons_against(outcome: Identification) -> list[str]:
    """Reasons not to trust an outcome; none if there is nothing against it."""
    found = [f"{each.run}: {each.text}" for each in outcome.findings]
    if not outcome.converged:
        found.append("the fit has not converged; give it a better start or fewer free parameters")
    if outcome.gate is not None and outcome.gate.weak:
        found.append(
            f"weak: the runs hardly show some direction (condition {outcome.gate.condition:.0f})"
        )
    found += [f"weak: {pair} are hard to tell apart" for pair in outcome.alike]
    found += _not_white(outcome)
    found += _explained(outcome)
    for each in outcome.held_out:
        if not each.good:
            found.append(f"a held-out run is not predicted: {each.text}")
    return found


def _not_white(outcome: Identification) -> list[str]:
    return [
        f"{each.run}, q{each.joint}: residuals hang together, {each.coloured:.2g} rad where the "
        f"encoders explain {each.allowed:.2g} rad (rms {each.rms:.2g} rad, noise "
        f"{each.sigma:.2g} rad)"
        for each in outcome.residuals
        if not each.white
    ]


def _explained(outcome: Identification) -> list[str]:
    """What else would explain the data, where something does."""
    if outcome.alternatives:
        best = "; or ".join(each.text for each in named(outcome.alternatives))
        return [f"something that was held is wrong: {best}"]
    suspects = [score.name for score in outcome.scores if score.gain > SIGNIFICANT]
    if suspects:
        return [f"something that was held is wrong, such as {', '.join(suspects)}"]
    return []
