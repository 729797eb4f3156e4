"""Names of a package that are loaded when they are asked for, not when it is imported (PEP 562)."""

import sys

TYPE_CHECKING = False
"""Type checkers take it for true; `typing` itself costs a tenth of what NumPy costs to import."""
if TYPE_CHECKING:
    from collections.abc import Callable, Mapping
    from typing import Any


def lazy_names(package: str, homes: "Mapping[str, str]") -> "Callable[[str], Any]":
    """A module's `__getattr__` for names that live elsewhere.

    Args:
        package: `__name__` of the module.
        homes: name -> module that defines it.
    """

    def get(name: str) -> "Any":
        if name not in homes:
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        __import__(homes[name])
        return getattr(sys.modules[homes[name]], name)

    return get
