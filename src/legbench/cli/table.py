"""Tables of figures of runs, for people."""

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Any

from legbench.metrics import Comparison, Summary
from legbench.metrics.rating_text import rated_lines
from legbench.metrics.soundness import LARGEST_RESIDUAL, Soundness

RESIDUAL = "energy residual"
"""Label of the energy that nothing explains."""
Row = tuple[str, float, str, float]
"""Row of a table: label, value, unit, and factor from SI to that unit."""


def print_summary(summary: Summary) -> None:
    """Print the figures of a run; those that it does not show are left out."""
    print(f"run               {summary.run}")
    ending = (summary.status or "unknown") + (f": {summary.cause}" if summary.cause else "")
    unsound = summary.numerics == Soundness.UNSOUND
    print(f"ended             {ending}{', but its numerics are unsound' if unsound else ''}")
    if summary.limited_cycles:
        print(f"{'limited':<17} {limited(summary)}")
    for line in rated_lines(summary):
        print(f"{f'P^r {line.kind}':<17} {line.text}")
    if summary.jumps:
        print(f"{'jumps':<17} {summary.jumps}")
    for label, value, unit, factor in _rows(summary):
        if label == RESIDUAL and value > LARGEST_RESIDUAL:
            print(f"{label:<17} {residual_text(summary)}")
        elif math.isfinite(value):
            print(f"{label:<17} {value * factor:.4g} {unit}")
    for warning in summary.warnings:
        print(f"{'note':<17} {warning}")


def residual_text(summary: Summary) -> str:
    """Say what an energy residual above its bound means: unsound numerics, or rows too sparse."""
    if summary.numerics != Soundness.UNSOUND:
        return "unknown: between rows that are not those of every cycle energy flows unseen"
    return (
        f"{summary.energy_residual:.3g} times the peak kinetic energy came from or went to "
        f"nowhere; up to {LARGEST_RESIDUAL:g} a run is sound"
    )


def limited(summary: Summary) -> str:
    """Say in how many cycles, and by how much, the limits changed the command."""
    worst = ", ".join(f"{value:.3g}" for value in summary.limited_max)
    return f"{summary.limited_cycles} cycles, by up to {worst} rad (motor 1, 2)"


def warned(events: Sequence[Mapping[str, Any]]) -> str:
    """Say which warnings of the bus file drives sent in a run, each once; empty without any."""
    heard = [text for event in events for text in event.get("warnings", ())]
    return ", ".join(
        text if count == 1 else f"{text} ({count} times)" for text, count in Counter(heard).items()
    )


def print_comparison(comparison: Comparison) -> None:
    """Print how another run differs; figures that one of the two does not show are left out."""
    print()
    print(f"{'against':<17} {comparison.other}")
    print(f"{'':<17} {comparison.other_name} minus {comparison.run_name}")
    for label, value, unit, factor in _differences(comparison):
        if math.isfinite(value):
            print(f"{label:<17} {value * factor:.4g} {unit}")
    for label, values, unit, factor in (
        ("lift-off", comparison.liftoff, "ms", 1e3),
        ("touchdown", comparison.touchdown, "ms", 1e3),
        ("apex height", comparison.apex_height, "%", 1e2),
    ):
        known = [factor * value for value in values if math.isfinite(value)]
        if known:
            largest = max(known, key=abs)
            ends = f"{known[0]:+.4g} first, {largest:+.4g} largest, {known[-1]:+.4g} last"
            print(f"{label:<17} {ends} of {len(known)} [{unit}]")


def _rows(summary: Summary) -> tuple[Row, ...]:
    return (
        ("trunk excursion", summary.trunk_excursion, "mm", 1e3),
        ("foot clearance", summary.foot_clearance, "mm", 1e3),
        ("drift, 3 jumps", summary.drift, "mm", 1e3),
        ("hopping", summary.hop_freq, "Hz", 1.0),
        ("polar angle, max", summary.polar_max, "rad", 1.0),
        ("loop gap, max", summary.loop_gap_max, "um", 1e6),
        (RESIDUAL, summary.energy_residual, "of the peak kinetic energy", 1.0),
        ("duration", summary.duration, "s", 1.0),
        ("speed", summary.real_time_factor, "x real time", 1.0),
    )


def _differences(comparison: Comparison) -> tuple[Row, ...]:
    landing = f"rad before the first touchdown at {comparison.first_touchdown:.4g} s"
    common = f"rad over {comparison.duration:.4g} s"
    means = f"between the means, about the {comparison.rating_reference}"
    return (
        ("|dq|, max", comparison.joint_before_touchdown, landing, 1.0),
        ("|dz2|, max", comparison.z2_before_touchdown, landing, 1.0),
        ("|dq|, max", comparison.joint_max, common, 1.0),
        ("|dz2|, max", comparison.z2_max, common, 1.0),
        ("P^r stance", comparison.rating_stance, means, 1.0),
        ("P^r flight", comparison.rating_flight, means, 1.0),
        ("P^r periods", comparison.rating_periods, means, 1.0),
    )
