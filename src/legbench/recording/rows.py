"""Rows in memory, into which the control loop copies each cycle."""

from typing import Final, final

import numpy as np

from legbench.errors import ConfigError
from legbench.recording.columns import ONE_LEG, Layout
from legbench.recording.layout import TIME
from legbench.signals import Command, Floats, Ints, Observation

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
"""Signals of two components in the order in which `RowBlock.put` joins them; own ones follow."""

TRUTH: Final = 12
"""Components of the signals that only a simulation knows, the last of those."""


@final
class RowLayout:
    """Places of a run's columns in a row in memory, where one copy takes many of them.

    Each leg's vectors come first, then the time, each leg's phase and contact, and what belongs
    to the cycle.

    Attributes:
        size: numbers in a row.
        time: place of the time, in seconds here.
        disk_order: places of the columns in their order on disk, time first.
        shape: shape of a leg's pair, (2,) for one leg, (legs, 2) for several.
        own: components of own signals of a leg.
    """

    def __init__(self, layout: Layout) -> None:
        legs, self.own = layout.legs, sum(len(signal.columns) for signal in layout.own)
        width = 2 * len(VECTORS) + self.own
        self.time = legs * width
        self.size = self.time + 3 + 2 * legs
        self.shape = (2,) if legs == 1 else (legs, 2)
        starts = {name: 2 * place for place, name in enumerate(VECTORS)}
        start = 2 * len(VECTORS)
        for signal in layout.own:
            starts[signal.name] = start
            start += len(signal.columns)
        single = {"cycle_us": self.size - 2, "late_us": self.size - 1}
        places = {TIME: self.time}
        for signal in layout.signals:
            for leg, names in enumerate(layout.columns_of(signal)):
                if signal.name in starts:
                    first = leg * width + starts[signal.name]
                elif signal.name in single:
                    first = single[signal.name]
                else:
                    first = self.time + 1 + leg + (0 if signal.name == "phase" else legs)
                places |= {name: first + place for place, name in enumerate(names)}
        self.disk_order: Ints = np.array([places[name] for name in (TIME, *layout.names)])


ONE_LEG_ROWS: Final = RowLayout(ONE_LEG)


@final
class RowBlock:
    """Fifty rows that the loop fills and the disk empties.

    Attributes:
        values: the rows (BATCH_ROWS, size), laid out as its `RowLayout` says.
        count: how many of them are filled.
    """

    __slots__ = (
        "_contact",
        "_layout",
        "_no_signals",
        "_no_truth",
        "_phase",
        "_rows",
        "_time",
        "_vectors",
        "count",
        "values",
    )

    def __init__(self, layout: RowLayout = ONE_LEG_ROWS) -> None:
        self.values: Floats = np.zeros((BATCH_ROWS, layout.size))
        self.count = 0
        self._layout, self._time = layout, layout.time
        ahead = layout.shape[:-1]
        legs = 1 if not ahead else ahead[0]
        self._rows = list(self.values)
        self._vectors = [row[: layout.time].reshape(*ahead, -1) for row in self._rows]
        self._no_truth: Floats = np.full((*ahead, TRUTH), np.nan)
        no_signals: Floats = np.full((*ahead, layout.own), np.nan)
        self._no_signals = (no_signals,) if layout.own else ()
        # A plain place is a third faster than a slice of one.
        phase, contact = layout.time + 1, layout.time + 1 + legs
        self._phase = slice(phase, contact) if ahead else phase
        self._contact = slice(contact, contact + legs) if ahead else contact

    def put(self, command: Command, seen: Observation, cycle_us: float, late_us: float) -> None:
        """Copy one cycle into the next row; the arrays stay the caller's.

        Raises:
            ConfigError: the arrays are not those of the run's legs, or the controller's own
                signals are not those that it declared.
        """
        truth = seen.truth
        signals = self._no_signals if command.signals is None else (command.signals,)
        measured = (
            command.motor_pos,
            seen.applied_pos,
            seen.motor_pos,
            seen.joint_pos,
            seen.joint_vel,
            seen.spring_torque,
        )
        if truth is None:
            arrays = (*measured, self._no_truth, *signals)
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
                *signals,
            )
            contact = truth.contact
        try:
            # By place: keywords cost a twentieth of the call.
            np.concatenate(arrays, -1, self._vectors[self.count])
        except ValueError as error:
            raise self._refusal(arrays[: len(arrays) - len(signals)], command.signals) from error
        row, time = self._rows[self.count], self._time
        row[time] = seen.time
        row[self._phase] = command.phase
        row[self._contact] = contact
        row[-2] = cycle_us
        row[-1] = late_us
        self.count += 1

    def columns(self) -> Floats:
        """Return the filled rows (columns with time, count), contiguous, in their disk order."""
        return np.ascontiguousarray(self.values[: self.count].T[self._layout.disk_order])

    def _refusal(self, arrays: tuple[Floats, ...], signals: Floats | None) -> ConfigError:
        """Say which of the arrays of a cycle does not fit."""
        layout = self._layout
        shapes = sorted({np.shape(array) for array in arrays} - {self._no_truth.shape})
        if shapes != [layout.shape]:
            legs = "one leg" if len(layout.shape) == 1 else f"{layout.shape[0]} legs"
            return ConfigError(f"a run records {legs}, shapes {layout.shape}, not {shapes}")
        shape = None if signals is None else np.shape(signals)
        return ConfigError(
            f"the controller's own signals have shape {shape}; it declared"
            f" {(*layout.shape[:-1], layout.own)}"
        )


@final
class LegRows:
    """Fifty rows of many legs, each laid out as one leg's, which are taken out leg by leg.

    Attributes:
        count: how many of the rows are filled.
    """

    def __init__(self, legs: int, layout: RowLayout = ONE_LEG_ROWS) -> None:
        """Make room for rows of legs that all have the columns of `layout`."""
        self._layout, self.count = layout, 0
        self._values: Floats = np.zeros((BATCH_ROWS, legs, layout.size))
        self._no_signals = np.full((legs, layout.own), np.nan)

    def put(self, command: Command, seen: Observation, cycle_us: float) -> None:
        """Copy one cycle of all legs (n, ...); raises ConfigError without a simulation's truth."""
        row, time = self._values[self.count], self._layout.time
        truth = seen.truth
        if truth is None:
            raise ConfigError("rows of many legs are those of a simulation; these lack its truth")
        own = self._no_signals if command.signals is None else command.signals
        arrays = (
            command.motor_pos,
            seen.applied_pos,
            seen.motor_pos,
            seen.joint_pos,
            seen.joint_vel,
            seen.spring_torque,
            truth.trunk_pos,
            truth.trunk_vel,
            truth.foot_pos,
            truth.contact_force,
            truth.energy,
            truth.loop_gap,
            own,
        )
        np.concatenate(arrays, -1, row[:, :time])
        row[:, time] = seen.time
        row[:, time + 1] = command.phase
        row[:, time + 2] = truth.contact
        row[:, -2], row[:, -1] = cycle_us, 0.0
        self.count += 1

    def columns(self, leg: int, rows: int) -> Floats:
        """Return the first rows of a leg (columns with time, rows), as `RowBlock.columns` does."""
        return np.ascontiguousarray(self._values[:rows, leg].T[self._layout.disk_order])
