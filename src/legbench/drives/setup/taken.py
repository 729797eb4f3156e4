"""Whether drives are protected by what they took of their configuration; pure."""

import math
from collections.abc import Collection, Iterator, Mapping, Sequence

from legbench.drives.errors import DriveError
from legbench.drives.protocol.objects import Key, name_of
from legbench.drives.setup.config import BusConfig
from legbench.drives.setup.configuration import quick_stop_ramp
from legbench.drives.setup.master_watch import check_master_watch
from legbench.drives.setup.needs import DEADLINE, RPDOS, TABLE, Need, NeedRow
from legbench.drives.setup.outcome import ObjectOutcome, held_by
from legbench.errors import ConfigError
from legbench.limits.upper_ends import QUICK_STOP_RAMP

Outcomes = Mapping[str, Sequence[ObjectOutcome]]
"""Name of a node -> what became of each object of its configuration."""
HEARTBEAT = (0x1017, 0)
RAMPS = ((0x6085, 0), (0x6084, 0))
"""Ramps of a quick stop, of which a drive needs one."""
QUICK_STOP_OPTION = (0x605A, 0)
"""Choice between the ramps; without it a quick stop brakes on 6085h (CiA 402-2)."""
FIRST_DEADLINE = (0x1400, 5)
SOFT_LIMITS_HIGH = (0x607D, 2)
"""Second half of a range, of which the first is told."""


def check_taken(
    config: BusConfig, outcomes: Outcomes, *, speed: float = math.inf, commands: bool = True
) -> None:
    """Refuse drives that no means of their own would stop, or whose way to stop is not known.

    Args:
        config: the bus.
        outcomes: what became of the configuration of each drive to look at.
        speed: highest speed of the motors [rad/s].
        commands: RPDOs are sent, as in a run.

    Raises:
        DriveError: a drive is not protected, and the bus file does not waive it.
    """
    held = {name: held_by(entries) for name, entries in outcomes.items()}
    try:
        check_master_watch(config, speed=speed, commands=commands, held=held)
    except ConfigError as error:
        lacking = _lacking(outcomes)
        raise DriveError(f"{error}{'; ' if lacking else ''}{lacking}") from None
    if QUICK_STOP_RAMP in config.waive:
        return
    for node in config.nodes:
        ramp = quick_stop_ramp(node)
        for entry in outcomes.get(node.name, ()):
            if ramp == RAMPS[1] and entry.parameter.key == QUICK_STOP_OPTION and entry.missing:
                raise DriveError(
                    f"drive '{node.name}' does not brake on {name_of(*ramp)}: without 605Ah its "
                    'quick stop uses 6085h; give "6085:00 u32" instead of "6084:00 u32" in the bus '
                    f'file, or waive = ["{QUICK_STOP_RAMP}"]'
                )
            if entry.parameter.key == ramp and not entry.agrees:
                raise DriveError(
                    f"drive '{node.name}' does not take its quick-stop ramp, {entry.name}: "
                    f'{entry.why}; give "6084:00 u32" instead of "6085:00 u32" if the drive has '
                    f'that one, or waive = ["{QUICK_STOP_RAMP}"] in the bus file'
                )


def _lacking(outcomes: Outcomes) -> str:
    """Describe the objects of a watch over the master that drives did not take."""
    return "; ".join(
        f"'{name}' {entry.name}: {entry.why}"
        for name, entries in outcomes.items()
        for entry in entries
        if not entry.agrees and (entry.parameter.index in (0x1016, 0x6007) or _deadline(entry))
    )


def _deadline(entry: ObjectOutcome) -> bool:
    index, sub = entry.parameter.key
    return index >> 9 == 0x1400 >> 9 and sub == 5


def unprotected(outcomes: Outcomes) -> tuple[str, ...]:
    """Return one line for every object that drives lack or hold otherwise, and what it costs."""
    told: dict[str, list[str]] = {}
    for name, entries in outcomes.items():
        for entry in entries:
            if entry.line is not None:
                told.setdefault(entry.line, []).append(f"'{name}'")
        for key, row in not_given({entry.parameter.key for entry in entries}):
            line = f"{name_of(*key)}: the bus file gives no value; {row.loss}"
            told.setdefault(line, []).append(f"'{name}'")
    return tuple(
        f"{'drive' if len(names) == 1 else 'drives'} {', '.join(names)}, {line}"
        for line, names in told.items()
    )


def not_given(written: Collection[Key]) -> Iterator[tuple[Key, NeedRow]]:
    """Yield the protections that a bus file gives no value for, with their entries of the table.

    Args:
        written: objects that the drive is written.
    """
    ramps = [key for key in RAMPS if key in written]
    for key, row in TABLE.items():
        if row.need is not Need.PROTECTION or key in written or (key in RAMPS and ramps):
            continue
        if key not in (RAMPS[1], SOFT_LIMITS_HIGH):
            yield key, row
    if not any(index in RPDOS and sub == FIRST_DEADLINE[1] for index, sub in written):
        yield FIRST_DEADLINE, DEADLINE


def tells_heartbeat(outcomes: Sequence[ObjectOutcome]) -> bool:
    """Whether a drive produces its heartbeat (1017h) often enough to be watched by it."""
    return all(entry.agrees for entry in outcomes if entry.parameter.key == HEARTBEAT)
