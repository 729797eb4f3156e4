"""Measured signals that controllers need, and which of those built in can do without some; pure."""

from collections.abc import Collection

from legbench.control.registry import CONTROLLERS
from legbench.guests import load_text
from legbench.signals import MEASURED


def needs_of(settings: object) -> frozenset[str]:
    """Names of the measured signals without which a controller cannot run.

    A class of settings says so by `needs: ClassVar[tuple[str, ...]]`; one that does not, such as a
    guest's, needs all. `motor_pos` stands for motors that follow commands behind their springs,
    too: a drive whose position loop is closed over the link has none.
    """
    return frozenset(getattr(_class_of(settings), "needs", MEASURED))


def run_on(known: Collection[str]) -> tuple[str, ...]:
    """Kinds of the built-in controllers that can run where only these signals are known."""
    found = {kind: load_text(text) for kind, text in CONTROLLERS.builtin.items()}
    return tuple(kind for kind, one in found.items() if needs_of(one) <= frozenset(known))


def _class_of(settings: object) -> type:
    return settings if isinstance(settings, type) else type(settings)
