"""Numbers that carry their derivative along.

A `Dual` is a float with a gradient. Whatever is computed from it by sums, products, quotients and
`DUAL`'s functions carries the gradient of the result; comparisons see the value alone. So a
control law or an equation differentiates itself.
"""

import math
from dataclasses import fields, is_dataclass, replace
from typing import Any, Self

import numpy as np

from legbench.analytic.equations import SCALAR, Ops, Pair
from legbench.signals import Floats


class Dual(float):
    """A value with its gradient (n,)."""

    __slots__ = ("gradient",)
    gradient: Floats

    def __new__(cls, value: float, gradient: Floats) -> Self:
        """Give a value a gradient."""
        made = super().__new__(cls, value)
        made.gradient = gradient
        return made

    def __add__(self, other: float) -> "Dual":
        """Sum."""
        return Dual(float(self) + float(other), self.gradient + gradient(other))

    def __sub__(self, other: float) -> "Dual":
        """Difference."""
        return Dual(float(self) - float(other), self.gradient - gradient(other))

    def __rsub__(self, other: float) -> "Dual":
        """Difference from a plain number."""
        return Dual(float(other) - float(self), gradient(other) - self.gradient)

    def __mul__(self, other: float) -> "Dual":
        """Product rule."""
        change = float(other) * self.gradient + float(self) * gradient(other)
        return Dual(float(self) * float(other), change)

    def __truediv__(self, other: float) -> "Dual":
        """Quotient rule."""
        ratio = float(self) / float(other)
        return Dual(ratio, (self.gradient - ratio * gradient(other)) / float(other))

    def __rtruediv__(self, other: float) -> "Dual":
        """Quotient of a plain number."""
        ratio = float(other) / float(self)
        return Dual(ratio, (gradient(other) - ratio * self.gradient) / float(self))

    def __neg__(self) -> "Dual":
        """Other sign."""
        return Dual(-float(self), -self.gradient)

    __radd__, __rmul__ = __add__, __mul__


def gradient(value: float) -> Floats:
    """Gradient of a dual number; a plain float has gradient 0."""
    return value.gradient if isinstance(value, Dual) else np.zeros(1)


def seeds(values: Floats) -> list[Dual]:
    """Numbers (n,) with respect to which everything is differentiated."""
    return [
        Dual(value, row) for value, row in zip(values.tolist(), np.eye(len(values)), strict=True)
    ]


def _sin(angle: float) -> Dual:
    return Dual(math.sin(angle), math.cos(angle) * gradient(angle))


def _cos(angle: float) -> Dual:
    return Dual(math.cos(angle), -math.sin(angle) * gradient(angle))


def _sqrt(value: float) -> Dual:
    root = math.sqrt(value)
    return Dual(root, 0.5 / root * gradient(value))


DUAL = Ops(sin=_sin, cos=_cos, sqrt=_sqrt)


def without_gradients(value: Any) -> Any:
    """Constants as plain floats, computing with plain functions.

    Args:
        value: a number, or tuples and frozen dataclasses of numbers.
    """
    if isinstance(value, Ops):
        return SCALAR
    if isinstance(value, Dual):
        return float(value)
    if isinstance(value, tuple):
        return tuple(without_gradients(part) for part in value)
    if is_dataclass(value) and not isinstance(value, type):
        parts = {part.name: getattr(value, part.name) for part in fields(value)}
        return replace(value, **{name: without_gradients(part) for name, part in parts.items()})
    return value


def floats(pair: Pair) -> Pair:
    """A pair without gradients."""
    return float(pair[0]), float(pair[1])
