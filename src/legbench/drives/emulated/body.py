"""Mechanical loads that the motors of an emulated bus move."""

from collections.abc import Callable, Sequence

Body = Callable[[tuple[float, ...]], tuple[Sequence[float], Sequence[float]]]
"""Function that moves the body for one period, from the motor positions [rad] to the link
positions [rad] and spring torques [N m] at its end."""


def stiff_body(motor_pos: tuple[float, ...]) -> tuple[Sequence[float], Sequence[float]]:
    """A body without springs: the links are where the motors are."""
    return motor_pos, (0.0,) * len(motor_pos)
