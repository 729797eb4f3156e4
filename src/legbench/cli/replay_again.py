"""Replays that `legbench replay` is asked for: of the controller, or of the leg."""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from legbench.cli.output import note, timed_progress
from legbench.cli.replay_arguments import ReplayArguments
from legbench.recording.reader import Recording

if TYPE_CHECKING:
    from legbench.replay.comparison import Replayed


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Again:
    """Replay that was made."""

    title: str
    """What was replayed, in a few words."""
    signals: "Replayed"
    """What was recorded and what came out."""
    beyond: float
    """Difference that counts [each signal's unit]."""
    edited: bool
    """Whether something else than what was recorded has been replayed."""
    must_agree: bool
    """Whether a difference is an error."""
    fault: str | None = None
    """Fault that ended a resimulation early."""
    moved: Recording | None = None
    """Run that came out of a resimulation, to be drawn over the recorded one."""

    @property
    def status(self) -> int:
        """Exit status: 1 where what had to agree does not."""
        return int(self.must_agree and not self.signals.identical)

    def to_json(self) -> dict[str, Any]:
        """Return what is printed with `--json`."""
        said = {"what": self.title, "edited": self.edited, "fault": self.fault}
        return said | self.signals.to_json(self.beyond)


def replayed(recording: Recording, chosen: ReplayArguments) -> Again | None:
    """Make the replay that was asked for, if any.

    Raises:
        LegbenchError: the run cannot be replayed so, a setting makes no sense, or a controller or
            plant of one's own failed.
    """
    from legbench.experiment.overrides import parse_setting
    from legbench.replay.recorded import paths_from_here
    from legbench.shipped import locate

    pairs = [parse_setting(text) for text in chosen.settings]
    if chosen.design is not None and chosen.bus is None:
        pairs.append(("design", str(locate(chosen.design).absolute())))
    edits = paths_from_here(pairs)
    if chosen.controller:
        return _controller(recording, chosen, edits)
    return None if chosen.resimulate is None else _leg(recording, chosen, edits)


def _controller(recording: Recording, chosen: ReplayArguments, edits: dict[str, Any]) -> Again:
    from legbench.replay.controller import replay_controller
    from legbench.replay.recorded import recorded_controller

    controller = recorded_controller(recording, edits)
    found = replay_controller(recording, controller, timed_progress())
    edited = f", with {', '.join(f'{key} = {value}' for key, value in edits.items())}"
    return Again(
        title=f"controller {controller.controller.kind}{edited if edits else ''}",
        signals=found.commands,
        beyond=chosen.beyond,
        edited=bool(edits),
        must_agree=not edits,
    )


def _leg(recording: Recording, chosen: ReplayArguments, edits: dict[str, Any]) -> Again:
    from legbench.replay.moved import MotionSource
    from legbench.replay.recorded import recorded_leg
    from legbench.replay.resimulation import resimulate

    leg = recorded_leg(recording, edits, plant=chosen.plant)
    source = MotionSource(chosen.resimulate)
    found = resimulate(recording, leg, source, timed_progress())
    for line in found.notes:
        note(f"legbench: {line}")
    if found.fault is not None:
        note(f"legbench: the resimulation ended early: {found.fault}")
    plant, design = found.recording.description.plant, leg.design.name
    return Again(
        title=f"{source.value} into {plant} / {design}",
        signals=found.signals,
        beyond=chosen.beyond,
        edited=bool(edits) or chosen.plant is not None,
        must_agree=False,
        fault=found.fault,
        moved=found.recording,
    )


def print_again(again: Again) -> None:
    """Print a replay: identical, or the first difference and the error of each signal."""
    rows = len(again.signals.time)
    print()
    print(f"{'replay':<17} {again.title}")
    first = again.signals.first()
    if first is None:
        print(f"{'identical':<17} in all {rows} rows, to the bit")
        return
    print(f"{'differs':<17} first in {first}")
    for each in again.signals.deviations(again.beyond):
        unit = "" if each.unit == "-" else f" {each.unit}"
        if not each.rows:
            within = f"within {again.beyond:g}{unit}" if each.max else "identical"
            print(f"{each.signal:<17} {within}")
            continue
        print(
            f"{each.signal:<17} rms {each.rms:.3g}, max {each.max:.3g}{unit} at "
            f"{each.max_time:.4g} s; beyond {again.beyond:g} in {each.rows} rows, first in cycle "
            f"{each.first_cycle} at {each.first_time:.4g} s"
        )
