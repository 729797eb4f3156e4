"""A run's figures for people."""

import math

from legbench.metrics import Summary

Row = tuple[str, float, str, float]
"""Label, value, unit, factor from SI to that unit."""


def print_summary(summary: Summary) -> None:
    """Print what a run showed; figures that it does not show are left out."""
    print(f"run               {summary.run}")
    ending = summary.status or "unknown"
    print(f"ended             {ending}" + (f": {summary.cause}" if summary.cause else ""))
    for name, values in (
        ("P^r stance", summary.rating_stance),
        ("P^r flight", summary.rating_flight),
        ("P^r periods", summary.rating_periods),
    ):
        if values:
            print(f"{name:<17} {_ratings(values)}")
    if summary.jumps:
        print(f"{'jumps':<17} {summary.jumps}")
    for label, value, unit, factor in _rows(summary):
        if math.isfinite(value):
            print(f"{label:<17} {value * factor:.4g} {unit}")


def _ratings(values: list[float]) -> str:
    return f"{min(values):.4f} lowest, {values[-1]:.4f} last of {len(values)}"


def _rows(summary: Summary) -> tuple[Row, ...]:
    return (
        ("trunk excursion", summary.trunk_excursion, "mm", 1e3),
        ("foot clearance", summary.foot_clearance, "mm", 1e3),
        ("drift, 3 jumps", summary.drift, "mm", 1e3),
        ("hopping", summary.hop_freq, "Hz", 1.0),
        ("polar angle, max", summary.polar_max, "rad", 1.0),
        ("loop gap, max", summary.loop_gap_max, "um", 1e6),
        ("energy residual", summary.energy_residual, "of the peak kinetic energy", 1.0),
        ("duration", summary.duration, "s", 1.0),
        ("speed", summary.real_time_factor, "x real time", 1.0),
    )
