"""Caveats of a run in words: what it does not show although its reader may look for it."""

import numpy as np

from legbench.metrics.analysis import Analysis
from legbench.metrics.roles import FLIGHT, STATES, resting
from legbench.signals import MEASURED


def warnings_of(run: Analysis) -> list[str]:
    """Sentences that say why a run has no rating, or by what stand-in it was measured."""
    if len(run.time) == 0:
        return ["the run has no rows: there is nothing to rate"]
    found: list[str] = []
    described = run.description
    says_rest = bool(resting(run["phase"], described.phases).all())
    if run.first_action == len(run.time):
        found.append(
            f"no control action: all {len(run.time)} rows are at rest and the command does not move"
        )
    elif says_rest:
        found.append(
            "controller"
            f" {described.controller} names no phase but rest: it is taken to act from"
            f" {run.time[run.first_action]:g} s on, where its command first moves"
        )
    unknown = [name for name in MEASURED if not np.isfinite(run[name]).any()]
    if unknown:
        found.append(
            f"{' and '.join(unknown)} are not known in any row, as of drives with one encoder that "
            "send no torque: what follows from them is null"
        )
    if "joint_pos" in unknown:
        return found
    rated = run.ratings.chosen
    if described.jumps and not run.has_truth and not _tells_stance(run):
        found.append(
            "no stance and no flight is known: the run has no truth, and no phase of controller"
            f" {described.controller} has the role stance or flight"
        )
    elif not (rated.stance or rated.flight or rated.periods):
        what = _why_no_hop(run) if described.jumps else _why_no_period(described.counting.smallest)
        found.append(f"nothing was rated: {what}")
    return found


def _why_no_period(smallest: float) -> str:
    """Say why a leg in a fixed setup has no period that counts, of an amplitude above one [rad]."""
    less = f", or by less than the {smallest:.3g} rad that count" if smallest > 0.0 else ""
    return f"z2 did not turn back and forth once after the first control action{less}"


def _why_no_hop(run: Analysis) -> str:
    """Say why a jumping leg has neither a complete stance nor a complete flight."""
    if np.any(run.states[run.first_action :] == FLIGHT):
        return "no stance or flight lies complete within the run; give it a longer duration"
    return "the leg never leaves the ground; push harder (a larger dz2)"


def _tells_stance(run: Analysis) -> bool:
    return any(phase.role in STATES for phase in run.description.phases)
