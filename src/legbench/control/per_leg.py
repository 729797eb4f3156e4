"""Settings of a batch: the same for all legs, or each leg's own."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from legbench.control.setpoint import check_delay


def each_config(config: Any) -> Sequence[Any]:
    """Return the settings one by one, a single one alone."""
    return config if isinstance(config, Sequence) else (config,)


def setting(config: Any, name: str) -> Any:
    """Return a number of the settings: a plain one of one leg's, an array (n,) of each leg's."""
    if isinstance(config, Sequence):
        return np.array([getattr(each, name) for each in config])
    return getattr(config, name)


def check_delays(config: Any) -> None:
    """Refuse a time at rest that never ends or has no meaning; raises ConfigError."""
    for each in each_config(config):
        check_delay(each.delay)
