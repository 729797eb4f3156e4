"""Outcome of an identification in words and as one JSON object."""

from dataclasses import asdict
from typing import Any

from legbench.identify.outcome import Estimate, Identification
from legbench.identify.parameters import PARAMETERS


def lines_of(outcome: Identification) -> list[str]:
    """Lines for people: verdict, data, estimates, residuals, held-out runs, reasons."""
    verdict = "trusted" if outcome.trusted else "not to be trusted"
    lines = [f"verdict           {verdict}", f"runs              {', '.join(outcome.runs)}"]
    if rows := sum(outcome.left_out):
        lines.append(f"left out          {rows} rows in which a drive had not answered")
    if outcome.estimates:
        lines += ["", *_fit_lines(outcome), "", *_estimate_lines(outcome)]
        lines += ["", *_residual_lines(outcome)]
    if outcome.held_out:
        lines += ["", *(f"held out          {each.text}" for each in outcome.held_out)]
    if outcome.alternatives:
        lines += ["", *(f"alternative       {each.text}" for each in outcome.alternatives)]
    if outcome.reasons:
        lines += ["", "Not to be trusted because"]
        lines += [f"  - {reason}" for reason in outcome.reasons]
    return lines


def _fit_lines(outcome: Identification) -> list[str]:
    gate = outcome.gate
    condition = "" if gate is None else f"{gate.condition:.3g}"
    return [
        f"condition         {condition} of the scaled Jacobian",
        f"fit               {outcome.agreeing} of {outcome.starts} starts agree, "
        f"{outcome.evaluations} evaluations",
    ]


def _estimate_lines(outcome: Identification) -> list[str]:
    head = f"{'':<12} {'value':>12} {'95 % interval':>28} {'change':>9}  unit"
    return [head, *(_estimate_line(each) for each in outcome.estimates)]


def _estimate_line(each: Estimate) -> str:
    interval = f"{each.low:.6g} .. {each.high:.6g}"
    change = f"{1e2 * (each.value / each.before - 1.0):+.2f} %" if each.before else ""
    return f"{each.name:<12} {each.value:>12.6g} {interval:>28} {change:>9}  {each.unit}"


def _residual_lines(outcome: Identification) -> list[str]:
    lines = [f"{'residuals [urad]':<36} {'rms':>8} {'noise':>8} {'coloured':>9} {'allowed':>8}"]
    for each in outcome.residuals:
        name = f"{each.run} q{each.joint}"
        numbers = (each.rms, each.sigma, each.coloured, each.allowed)
        rms, sigma, coloured, allowed = (f"{1e6 * value:.0f}" for value in numbers)
        mark = "" if each.white else "  not white"
        lines.append(f"{name[-36:]:<36} {rms:>8} {sigma:>8} {coloured:>9} {allowed:>8}{mark}")
    return lines


def content_of(outcome: Identification) -> dict[str, Any]:
    """The outcome as one JSON object, in SI units."""
    gate = outcome.gate
    return {
        "trusted": outcome.trusted,
        "reasons": list(outcome.reasons),
        "runs": list(outcome.runs),
        "left_out": list(outcome.left_out),
        "findings": [asdict(each) for each in outcome.findings],
        "estimates": {each.name: asdict(each) for each in outcome.estimates},
        "correlation": None if outcome.correlation is None else outcome.correlation.tolist(),
        "values": None
        if outcome.values is None
        else dict(zip(PARAMETERS, outcome.values.tolist(), strict=True)),
        "gate": None if gate is None else asdict(gate) | {"open": gate.open, "weak": gate.weak},
        "residuals": [asdict(each) | {"white": each.white} for each in outcome.residuals],
        "scores": [asdict(each) for each in outcome.scores],
        "alternatives": [asdict(each) for each in outcome.alternatives],
        "held_out": [asdict(each) | {"good": each.good} for each in outcome.held_out],
        "fit": {
            "starts": outcome.starts,
            "agreeing": outcome.agreeing,
            "evaluations": outcome.evaluations,
            "converged": outcome.converged,
        },
    }
