"""A file that does not import."""

import legbench.signals


def half() -> float:
    return legbench.signals.no_such_name  # pyrefly: ignore[missing-attribute]


LENGTH = half()
