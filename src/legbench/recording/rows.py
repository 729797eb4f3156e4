"""Rows in memory: what the control loop pays for remembering one cycle."""

from typing import Final, final

import numpy as np

from legbench.errors import ConfigError
from legbench.recording.layout import COLUMNS, TIME
from legbench.signals import SIGNALS, Command, Floats, Observation

BATCH_ROWS: Final = 50
"""Rows handed to the disk at once: 50 ms at 1 kHz."""

VECTORS: Final = (
    "command_pos",
    "applied_pos",
    "motor_pos",
    "joint_pos",
    "joint_vel",
    "spring_torque",
    "trunk_pos",
    "trunk_vel",
    "foot_pos",
    "contact_force",
    "energy",
    "loop_gap",
)
"""Signals of two components in the order in which `Block.put` joins them."""

SCALARS: Final = (TIME, "phase", "contact", "cycle_us", "late_us")
"""What follows them in a row; time in seconds here."""

WIDTH: Final = 2 * len(VECTORS)
NO_TRUTH: Final[Floats] = np.full(12, np.nan)


def _places() -> dict[str, int]:
    """Return the place in a row of each column on disk."""
    columns = {signal.name: signal.columns for signal in SIGNALS}
    names = [column for vector in VECTORS for column in columns[vector]] + list(SCALARS)
    return {name: place for place, name in enumerate(names)}


PLACES: Final[dict[str, int]] = _places()
DISK_ORDER: Final = np.array([PLACES[name] for name in (TIME, *COLUMNS)])
"""Picks the columns of a row in their order on disk, time first."""


@final
class Block:
    """Fifty rows that the loop fills and the disk thread empties.

    Attributes:
        values: the rows (BATCH_ROWS, len(PLACES)), laid out as `PLACES` says.
        count: how many of them are filled.
    """

    __slots__ = ("_rows", "_vectors", "count", "values")

    def __init__(self) -> None:
        self.values: Floats = np.zeros((BATCH_ROWS, len(PLACES)))
        self.count = 0
        self._rows = list(self.values)
        self._vectors = [row[:WIDTH] for row in self._rows]

    def put(self, command: Command, seen: Observation, cycle_us: float, late_us: float) -> None:
        """Copy one cycle into the next row; the arrays stay the caller's.

        Raises:
            ConfigError: the arrays are not those of one leg, shape (2,).
        """
        truth = seen.truth
        measured = (
            command.motor_pos,
            seen.applied_pos,
            seen.motor_pos,
            seen.joint_pos,
            seen.joint_vel,
            seen.spring_torque,
        )
        if truth is None:
            arrays = (*measured, NO_TRUTH)
            contact = np.nan
        else:
            arrays = (
                *measured,
                truth.trunk_pos,
                truth.trunk_vel,
                truth.foot_pos,
                truth.contact_force,
                truth.energy,
                truth.loop_gap,
            )
            contact = truth.contact
        try:
            np.concatenate(arrays, out=self._vectors[self.count])
        except ValueError as error:
            shapes = sorted({np.shape(array) for array in arrays})
            raise ConfigError(f"a run records one leg, shapes (2,), not {shapes}") from error
        row = self._rows[self.count]
        row[WIDTH] = seen.time
        row[WIDTH + 1] = command.phase
        row[WIDTH + 2] = contact
        row[WIDTH + 3] = cycle_us
        row[WIDTH + 4] = late_us
        self.count += 1

    def columns(self) -> Floats:
        """Return the filled rows (1 + len(COLUMNS), count), contiguous, in their disk order."""
        return np.ascontiguousarray(self.values[: self.count].T[DISK_ORDER])
