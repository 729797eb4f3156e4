"""The knee angle q2 - q1 as a limit of two commanded motor positions; pure."""

from collections.abc import Sequence

from legbench.errors import ConfigError

Range = tuple[float, float]


def knee_of(pair: Sequence[float]) -> float:
    """Return q2 - q1 of a leg's two angles [rad]."""
    return pair[1] - pair[0]


def check_knee(name: str, knee: Range, boxes: Sequence[Range]) -> None:
    """Refuse a knee range that the ranges of the two angles leave no room for.

    Raises:
        ConfigError: it is empty, or no pair of angles lies in all three ranges.
    """
    (low1, high1), (low2, high2) = boxes
    if not knee[0] < knee[1]:
        raise ConfigError(f"{name} is [{knee[0]:g}, {knee[1]:g}] rad; low must be below high")
    if high2 - low1 < knee[0] or low2 - high1 > knee[1]:
        raise ConfigError(
            f"{name} is [{knee[0]:g}, {knee[1]:g}] rad, but the ranges of the two angles allow "
            f"q2 - q1 from {low2 - high1:g} to {high2 - low1:g} rad only; widen one of them"
        )


def project(wanted: Sequence[float], knee: Range, boxes: Sequence[Range]) -> tuple[float, float]:
    """Move two positions within their boxes until their knee is within its range, too.

    Both give way by the same amount, which keeps q1 + q2, the direction of the leg; where one
    reaches the end of its box the other one gives way for both.

    Args:
        wanted: the two positions, within their boxes [rad].
        knee: range of q2 - q1 [rad].
        boxes: range of each position [rad].
    """
    first, second = wanted
    excess = min(max(second - first, knee[0]), knee[1]) - (second - first)
    if excess == 0.0:
        return first, second
    (low1, high1), (low2, high2) = boxes
    first = min(max(first - 0.5 * excess, low1), high1)
    second = min(max(first + _nearest(knee, excess), low2), high2)
    return min(max(second - _nearest(knee, excess), low1), high1), second


def _nearest(knee: Range, excess: float) -> float:
    """End of the range that a position was short of (positive excess) or beyond."""
    return knee[0] if excess > 0.0 else knee[1]
