"""A file that does not import."""

import legbench.signals


def half() -> float:
    return legbench.signals.no_such_name  # pyright: ignore


LENGTH = half()
