"""What `legbench replay` is given: a run folder, or a log of a bus."""

from pathlib import Path
from typing import TYPE_CHECKING

from legbench.cli.output import note, timed_progress
from legbench.cli.replay_arguments import ReplayArguments
from legbench.errors import ConfigError
from legbench.recording.description import describe
from legbench.recording.layout import RUN
from legbench.recording.manifest import read_manifest
from legbench.recording.reader import Recording, load

if TYPE_CHECKING:
    from legbench.design import LegDesign
    from legbench.design.setup import Setup

USUAL_DESIGN = Path("models/optimal.toml")
"""Leg on the drives of a log that says nothing else, as everywhere on the command line."""


def loaded(path: Path) -> Recording:
    """Read a run; a note says where it is torn.

    Raises:
        RecordingError: there is no run, or a file in it is damaged.
    """
    recording = load(path)
    if recording.torn is not None:
        note(f"legbench: {path} is torn ({recording.torn}); read as far as it goes")
    return recording


def source_of(chosen: ReplayArguments) -> Recording:
    """Read the run or the log that was named; rows of a log outside --from and --to are left out.

    Raises:
        RecordingError: it is not there, or damaged.
        ConfigError: a log without --bus, a run with it, or a log of other drives.
    """
    from legbench.replay.log_names import is_log

    if not is_log(chosen.run):
        chosen.check_pictures()
        if chosen.bus is not None:
            raise ConfigError(f"--bus describes the drives of a log; {_why_no_log(chosen.run)}")
        return loaded(chosen.run)
    if chosen.bus is None:
        raise ConfigError(
            f"{chosen.run} is a log of raw frames; add --bus FILE, as hardware/leg.toml, which "
            "says what drives are on that bus"
        )
    return _log(chosen, chosen.bus)


def _why_no_log(path: Path) -> str:
    """Say why something is not read as a log of raw frames."""
    from legbench.replay.log_names import SUFFIXES

    if not path.exists():
        return f"{path} does not exist"
    if path.is_dir():
        return f"{path} is a folder"
    return f"{path} has none of the suffixes {', '.join(SUFFIXES)}, nor one of them with .gz"


def _log(chosen: ReplayArguments, bus: Path) -> Recording:
    from legbench.drives.setup.bus_file import load_bus
    from legbench.replay.log import load_log
    from legbench.viz.playback import cut

    design, setup = _leg_of(chosen)
    decoded = load_log(chosen.run, load_bus(bus), str(bus), design, setup, timed_progress())
    recording = decoded.recording
    if recording.torn is not None:
        note(f"legbench: {recording.torn}; read as far as it goes")
    for line in decoded.notes:
        note(f"legbench: {line}")
    playback = chosen.playback.playback
    # A log has no beginning of its own: what is to be looked at is also what is to be rated.
    return cut(recording, playback.rows(recording.time)) if not playback.whole else recording


def _leg_of(chosen: ReplayArguments) -> "tuple[LegDesign, Setup | None]":
    """Leg and setup of a log: what was said, else those of the run folder that it lies in."""
    from legbench.design import load_design
    from legbench.design.setup import Setup

    folder = chosen.run.parent
    manifest = read_manifest(folder) if (folder / RUN).is_file() else None
    run = None if manifest is None else describe(manifest, folder.name)
    if chosen.design is not None:
        design = load_design(chosen.design)
    else:
        design = load_design(USUAL_DESIGN) if run is None else run.design
    if chosen.setup is not None:
        return design, Setup(kind=chosen.setup)
    return design, None if run is None else run.setup
