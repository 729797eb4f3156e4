"""Results for other programs, in which numbers that JSON lacks are null."""

import math
from collections.abc import Mapping
from typing import Any


def null_for_nan(value: Any) -> Any:
    """Copy of a JSON-like value in which every number that is not finite is None.

    Mappings and sequences are searched to any depth; tuples become lists, as in JSON.
    """
    if isinstance(value, Mapping):
        return {key: null_for_nan(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [null_for_nan(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value
