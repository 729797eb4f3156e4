"""Checks of recorded data that need no model: rates, gaps, stops, encoders that stand still."""

from dataclasses import dataclass
from typing import Final

import numpy as np

from legbench.design.leg import Limits
from legbench.identify.trial import FitTrial
from legbench.signals import Bools, Floats, Ints

RATE_ERROR: Final = 1e-3
"""Largest share by which rows may come faster or slower than the control period [-]."""
GAP: Final = 1.5
"""Control periods from which two rows have a gap between them [-]."""
FROZEN: Final = 0.05
"""Time for which a reading may stay the same while the rest moves [s]."""
EDGE: Final = 20
"""Rows at both ends of such a stretch that do not count [-]."""
LEAST_SWING: Final = 0.02
"""Smallest swing of the other signal meanwhile [rad]."""
OTHERS_MOVE: Final = 20.0
"""Standard deviations that the other link has to move by meanwhile [-]."""
LIMITED_COUNTS: Final = 3.0
"""Standard deviations by which a leg may be seen beyond a stop that it does not touch [-]."""


@dataclass(frozen=True, slots=True, kw_only=True)
class DataFinding:
    """Something about the data of a run that is not as it should be."""

    run: str
    what: str
    """Short name: rate, gap, stop, frozen, swapped, sign, delay, time_base, or a parameter."""
    text: str
    """Sentence with values, limits and units."""
    hopeless: bool = False
    """Whether nothing can be learned from the run before it is mended."""


def check_data(trial: FitTrial, limits: Limits) -> list[DataFinding]:
    """Find what is wrong with the data of one run by itself."""
    found = [*_rate(trial), *_stops(trial, limits), *_frozen_links(trial), *_frozen_motors(trial)]
    return [
        DataFinding(run=trial.name, what=what, text=text, hopeless=what == "frozen")
        for what, text in found
    ]


def _rate(trial: FitTrial) -> list[tuple[str, str]]:
    gaps = np.diff(trial.time)
    found = []
    wide = gaps > GAP * trial.period
    if wide.any():
        first = int(np.flatnonzero(wide)[0])
        found.append(
            (
                "gap",
                f"{int(wide.sum())} gaps of up to {1e3 * float(gaps.max()):.3g} ms, the first at "
                f"{trial.time[first]:.3f} s; rows are due every {1e3 * trial.period:.3g} ms, and "
                "what the motors did meanwhile is not known",
            )
        )
    if not np.all(gaps > 0.0):
        found.append(("gap", "time stands still or runs backwards"))
    rate = float(np.median(gaps)) / trial.period
    if abs(rate - 1.0) > RATE_ERROR:
        found.append(
            (
                "time_base",
                f"rows come every {1e3 * float(np.median(gaps)):.5g} ms, and the run says "
                f"{1e3 * trial.period:.5g} ms: time is stretched by {1e2 * (rate - 1.0):+.2g} %",
            )
        )
    return found


def _stops(trial: FitTrial, limits: Limits) -> list[tuple[str, str]]:
    """Joints that touch their stops, which the equations of a fit do not have."""
    found = []
    q1, q2 = trial.joint_pos.T
    slack = LIMITED_COUNTS * float(trial.sigma.max())
    for name, angle, (low, high) in (("hip", q1, limits.hip), ("knee", q2 - q1, limits.knee)):
        beyond = max(low - float(angle.min()), float(angle.max()) - high)
        if beyond > slack:
            found.append(
                (
                    "stop",
                    f"the {name} touches its stop by {beyond:.3g} rad (range {low:g} to {high:g} "
                    "rad), and a fit knows no stops: take a smaller amplitude",
                )
            )
    return found


def _frozen_links(trial: FitTrial) -> list[tuple[str, str]]:
    found = []
    for joint in (0, 1):
        other = trial.joint_pos[:, 1 - joint]
        still = _frozen(trial, trial.joint_pos[:, joint], other, float(trial.sigma[1 - joint]))
        if still is not None:
            begin, end, swing = still
            found.append(
                (
                    "frozen",
                    f"link encoder {joint + 1} stands still from {begin:.3f} to {end:.3f} s, "
                    f"while q{2 - joint} moves by {swing:.3g} rad: frozen",
                )
            )
    return found


def _frozen_motors(trial: FitTrial) -> list[tuple[str, str]]:
    found = []
    for joint in (0, 1):
        command = trial.applied_pos[:, joint]
        sigma = trial.motors[joint].sigma
        still = _frozen(trial, trial.motor_pos[:, joint], command, sigma)
        if still is not None:
            begin, end, swing = still
            found.append(
                (
                    "frozen",
                    f"motor encoder {joint + 1} stands still from {begin:.3f} to {end:.3f} s, "
                    f"while its command moves by {swing:.3g} rad: frozen",
                )
            )
    return found


def _frozen(
    trial: FitTrial, values: Floats, other: Floats, sigma: float
) -> tuple[float, float, float] | None:
    """Longest stretch of one value during which another signal swings: begin, end, swing."""
    begins, ends = stretches(np.diff(values) == 0.0)
    longest: tuple[float, float, float] | None = None
    for begin, end in zip(begins.tolist(), ends.tolist(), strict=True):
        length = trial.time[end] - trial.time[begin]
        # A motor that reacts early or late to a step of its command does not stand still.
        inner = other[begin + EDGE : end - EDGE]
        swing = float(np.ptp(inner)) if len(inner) else 0.0
        if length < FROZEN or swing < OTHERS_MOVE * sigma or swing < LEAST_SWING:
            continue
        if longest is None or length > longest[1] - longest[0]:
            longest = float(trial.time[begin]), float(trial.time[end]), swing
    return longest


def stretches(flags: Bools) -> tuple[Ints, Ints]:
    """Begin and end of each stretch of true flags (n,), as indices of the rows around them."""
    edges = np.diff(np.concatenate([[0], flags.astype(np.int8), [0]]))
    begins, ends = np.flatnonzero(edges == 1), np.flatnonzero(edges == -1)
    return begins.astype(np.int64), ends.astype(np.int64)
