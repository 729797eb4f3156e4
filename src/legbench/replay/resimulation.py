"""Recorded commands, or measured motor positions, through a plant in virtual time."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final

import numpy as np

from legbench.errors import ConfigError, LegbenchError, PlantFault
from legbench.experiment.tables import write_tables
from legbench.failures import failed, own_lines
from legbench.loop import PROGRESS_EVERY, Progress
from legbench.plant.abstract import AbstractPlant
from legbench.plant.backlash import rest_of
from legbench.plant.opening import Leg, OpenPlant, PlantSettings, open_plant
from legbench.plant.start import Start
from legbench.plants import PLANTS, SimChoice
from legbench.recording.answers import DRIVES
from legbench.recording.format_1 import upgraded
from legbench.recording.layout import COMPLETE, FAULT
from legbench.recording.manifest import OWN_KEYS
from legbench.recording.memory import MemoryRun
from legbench.recording.reader import Recording
from legbench.replay.comparison import Replayed, columns_of
from legbench.replay.moved import MotionSource, Moved
from legbench.replay.observations import exact_times, require_every_row
from legbench.replay.recorded import RecordedLeg
from legbench.replay.start_estimate import StartEstimate
from legbench.replay.start_search import find_start
from legbench.servo import ServoConfig
from legbench.signals import Bools, Command, Floats

RESPONSES: Final = (
    "motor_pos",
    "joint_pos",
    "joint_vel",
    "spring_torque",
    "trunk_pos",
    "trunk_vel",
    "foot_pos",
    "contact_force",
    "contact",
    "energy",
    "loop_gap",
)
"""Signals of a plant that answer to its motors."""
MOVING: Final = 0.1
"""Link speed above which a run begins in motion [rad/s]; plants begin at rest."""
FIRST_ROWS: Final = 20
"""Rows over which that speed is averaged: noise of an encoder moves no leg."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Resimulation:
    """Run that came out of a plant for the commands or motors of another one."""

    recording: Recording
    """Rows of the plant, kept in memory, with the commands and phases that were recorded."""
    signals: Replayed
    """Its answers beside those that were recorded, those that both know."""
    fault: str | None
    """Fault of the plant that ended it before the last row, none if it came to the end."""
    notes: tuple[str, ...] = ()
    """What limits the comparison, a sentence each."""


def resimulate(
    recording: Recording,
    leg: RecordedLeg,
    source: MotionSource,
    progress: Progress | None = None,
) -> Resimulation:
    """Move the leg of a run, or another one, as the run was moved.

    A run on drives is resimulated in MuJoCo: its leg stands still first, and follows a command one
    cycle later than a simulated servo, as it does over a bus.

    Args:
        recording: the run.
        leg: leg and plant that move now.
        source: what moves its motors.
        progress: told now and then how far it is.

    Raises:
        RecordingError: a run that has no rows, lacks some, or does not know its motors.
        ConfigError: commands that were never sent, a leg that cannot stand so, or a plant that
            runs in the machine's time.
        PlantFault: the plant cannot even stand as the run began.
    """
    times = exact_times(recording, require_every_row(recording))
    moved = Moved(recording, source)
    opened = _opened(leg, source, moved)
    run = MemoryRun(_manifest(recording, leg), name=f"resimulated-{recording.path.name}")
    with opened.plant as plant:
        _require_virtual(opened, leg)
        steps = np.maximum(1, np.round(np.diff(times) / plant.period)).astype(int).tolist()
        start = None
        if moved.on_drives:
            start = _guarded(lambda: find_start(plant, moved, steps, progress), 0.0)
        fault = _drive(plant, moved, start, (times, steps), run, progress)
    if fault is not None and run.rows == 0:
        raise fault
    run.close(COMPLETE if fault is None else FAULT, None if fault is None else fault.cause)
    rows = run.recording()
    given = replace(rows, path=Path(f"{recording.path.name}-resimulated"))
    return Resimulation(
        recording=given,
        signals=_compared(recording, given, moved.stale),
        fault=None if fault is None else str(fault),
        notes=tuple(_notes(recording, moved, start)),
    )


def _require_virtual(opened: OpenPlant, leg: RecordedLeg) -> None:
    """Refuse a plant that the machine's clock paces; raises ConfigError."""
    if opened.realtime:
        raise ConfigError(
            f"plant '{leg.plant.kind}' runs in the machine's time; a resimulation needs one in "
            "virtual time, such as --plant sim"
        )


def _notes(recording: Recording, moved: Moved, start: StartEstimate | None) -> Iterator[str]:
    """Sentences about what the run does not tell."""
    if start is not None and start.rows is not None:
        until = float(recording.time[start.rows - 1] - recording.time[0])
        yield (
            f"how the leg swung at its start was estimated from its links in the first {until:.3g} "
            "s: an error of it grows from hop to hop"
        )
    unanswered = moved.stale.sum(axis=0).tolist()
    if any(unanswered):
        yield (
            f"drives 1 and 2 did not answer in {unanswered[0]} and {unanswered[1]} rows, which are "
            "left out"
        )
    speed = float(np.max(np.abs(recording["joint_vel"][:FIRST_ROWS].mean(axis=0))))
    if speed > MOVING:
        yield (
            f"the run begins in motion, at {speed:.3g} rad/s; a plant begins at rest (at most "
            f"{MOVING:g} rad/s), so that the first swings differ"
        )


def _opened(leg: RecordedLeg, source: MotionSource, moved: Moved) -> OpenPlant:
    """Open the plant, with the leg at rest where its motors are first."""
    plant, servo, imperfections = leg.plant, leg.servo, leg.imperfections
    on_drives, motor_pos = moved.on_drives, moved.first
    if on_drives and plant.kind == DRIVES:
        plant = SimChoice()
    elif plant.kind == DRIVES:
        raise ConfigError("a resimulation moves no drives; use --plant sim or --plant analytic")
    if source is MotionSource.MOTORS:
        # What motors do to a command, and the noise on them, is in the measurement.
        plant = _without_limits(plant)
        servo = ServoConfig(encoder_counts=servo.encoder_counts)
        imperfections = imperfections.beyond_motors
    elif on_drives:
        servo = replace(servo, delay_cycles=servo.delay_cycles + 1)
    if on_drives:
        # Its noise began before the first row: noise of one's own would only be added to it.
        imperfections = replace(imperfections, link_noise=None)
    rest = (
        leg.targets.link_at_rest(motor_pos)
        if imperfections.perfect
        else rest_of(leg.design, leg.setup.support, motor_pos, imperfections)
    )
    return open_plant(
        plant,
        Leg(
            design=leg.design,
            options=leg.options,
            start=Start(joint_pos=rest, motor_pos=motor_pos),
            servo=servo,
            imperfections=imperfections,
            seed=leg.seed,
        ),
    )


def _without_limits(plant: PlantSettings) -> PlantSettings:
    """A built-in plant without safety limits, which watch commands; another one as it is."""
    return PLANTS.find(plant.kind)() if plant.kind in PLANTS.builtin else plant


def _drive(
    plant: AbstractPlant,
    moved: Moved,
    start: StartEstimate | None,
    grid: tuple[Floats, Sequence[int]],
    run: MemoryRun,
    progress: Progress | None,
) -> PlantFault | None:
    """Step the plant from row to row; returns the fault that ended it early.

    Args:
        plant: the leg.
        moved: rows of the run.
        start: what the motors do before the first of them, none if the leg begins at rest.
        grid: time of each row (n,) [s], and number of periods from each to the next (n - 1).
        run: where the rows go.
        progress: told now and then how far it is.
    """
    times, steps = grid
    count = len(times)
    try:
        seen = _guarded(plant.reset, 0.0)
        for motor_pos in () if start is None else start.motor_pos():
            hold = Command.holding(motor_pos)
            seen = _guarded(lambda hold=hold: plant.step(hold), 0.0)
        for row, time in enumerate(times.tolist()):
            command = moved.command(row)
            run.append(command, replace(seen, time=time), 0.0, 0.0)
            if row + 1 < count:
                for motor_pos in moved.between(row, steps[row]):
                    sent = Command(motor_pos=motor_pos, phase=command.phase)
                    seen = _guarded(lambda sent=sent: plant.step(sent), time)
            if progress is not None and ((row + 1) % PROGRESS_EVERY == 0 or row + 1 == count):
                progress(row + 1, count)
    except PlantFault as fault:
        return fault
    return None


def _guarded(act: Callable[[], Any], time: float) -> Any:
    """Result of a plant; what a plant of somebody else raises is told as its failure."""
    try:
        return act()
    except LegbenchError:
        raise
    except Exception as error:
        when = f"in a resimulation after t = {time:.3f} s"
        raise failed("plant", when, error, own_lines(error)) from error


def _manifest(recording: Recording, leg: RecordedLeg) -> Mapping[str, Any]:
    """Manifest of the run that comes out: that of the run, on this leg and plant.

    Where the run came from, and what it began in, is not this one's.
    """
    manifest = recording.manifest
    whole = upgraded(manifest) if manifest.get("format") == 1 else manifest
    plant = SimChoice.kind if leg.plant.kind == DRIVES else leg.plant.kind
    experiment = {
        **whole.get("experiment", {}),
        **write_tables(replace(leg, plant=SimChoice()), where=False),
        "plant": {"kind": plant, "settings": {}},
    }
    own = (*OWN_KEYS, "provenance", "initial_state")
    kept = {key: value for key, value in whole.items() if key not in own}
    return kept | {"experiment": experiment, "plant": {"kind": plant}}


def _compared(recording: Recording, ours: Recording, stale: Bools) -> Replayed:
    """Answers of the plants that both runs know, over the rows that both have.

    What a drive repeats because it had not answered is left out on both sides.
    """
    count = len(ours.time)
    gaps = {f"_{axis + 1}": stale[:count, axis] for axis in range(2) if stale[:, axis].any()}

    def told(values: np.ndarray, name: str) -> np.ndarray:
        gap = gaps.get(name[-2:])
        return values[:count] if gap is None else np.where(gap, np.nan, values[:count])

    names = [
        name
        for name in columns_of(recording.layout, RESPONSES)
        if _known(recording.columns[name]) and _known(ours.columns[name])
    ]
    return Replayed(
        time=recording.time[:count],
        recorded={name: told(recording.columns[name], name) for name in names},
        replayed={name: told(ours.columns[name], name) for name in names},
        units={name: recording.layout.units[name] for name in names},
    )


def _known(values: np.ndarray) -> bool:
    """Whether a column holds anything: int8 columns have -1, others no number, where unknown."""
    if values.dtype.kind != "f":
        return bool(np.any(values >= 0))
    return bool(np.isfinite(values).any())
