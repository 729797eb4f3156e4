"""A campaign on the bench: one run after another, with a pause and a look at the drives between.

It stops at the first fault, with everything that is done kept; a person sees to the leg and calls
again.
"""

import time
from collections.abc import Callable
from pathlib import Path
from typing import Final

from legbench.campaign.drives import moves_drives
from legbench.campaign.executor import Note
from legbench.campaign.folder import is_done, open_folder, shard_path, write_into
from legbench.campaign.plan import CampaignPlan, Planned
from legbench.campaign.records import RECORDS
from legbench.campaign.rows import measured_rows
from legbench.campaign.running import FinishedCampaign, Progress, finished_of
from legbench.campaign.shards import Shard, shard_bytes, shards_of
from legbench.commissioning.idle import drive_troubles
from legbench.drives.setup.bus_file import load_bus
from legbench.errors import ConfigError, LegbenchError, RecordingError
from legbench.experiment.running import record
from legbench.interrupts import StopFlag
from legbench.plant.can_open import open_session
from legbench.plants import CanChoice
from legbench.recording.layout import COMPLETE, INTERRUPTED
from legbench.recording.reader import load

LOOK_EVERY: Final = 0.1
"""Time after which a pause looks whether somebody has asked for the end [s]."""
Wait = Callable[[float, StopFlag], None]
"""Function that waits for a time [s], or until a flag is set."""


def pause_for(seconds: float, stop: StopFlag) -> None:
    """Wait for a time [s], or until somebody asks for the end."""
    end = time.monotonic() + seconds
    while not stop.is_set and (left := end - time.monotonic()) > 0.0:
        time.sleep(min(left, LOOK_EVERY))


def run_on_bench(
    plan: CampaignPlan,
    folder: Path,
    *,
    pause: float = 2.0,
    stop: StopFlag | None = None,
    progress: Progress | None = None,
    note: Note | None = None,
    wait: Wait = pause_for,
) -> FinishedCampaign:
    """Run every experiment of a campaign on its drives, those that are not there yet, in order.

    Every run leaves its folder under `records`: one that came to its end by its experiment's hash,
    one that a fault ended by its time.

    Args:
        plan: what is to be run, all of it on plant `can`.
        folder: where recordings, rows and the table are kept.
        pause: time between two runs [s]; emulated drives in this process need none.
        stop: ends it when it is set, a run that moves first.
        progress: told how far it is after each run.
        note: told what a person should know.
        wait: waits for the pause.

    Raises:
        CampaignError: the folder holds something else or is in use, or a file cannot be written.
        ConfigError: an experiment is on another plant, or a pause makes no sense.
        RecordingError: a recording cannot be written.
    """
    if not 0.0 <= pause < 3600.0:
        raise ConfigError(f"pause is {pause:g} s; it must be 0 to 3600 s")
    _check_buses(plan)
    asked, say, shards = stop or StopFlag(), note or _silent, _in_order(plan)
    with open_folder(folder, plan):
        missing = [shard for shard in shards if not is_done(folder, shard)]
        done, failure = len(shards) - len(missing), None
        began = time.monotonic()
        for place, shard in enumerate(missing):
            if place and moves_drives(shard.planned[0].experiment):
                wait(pause, asked)
            failure = None if asked.is_set else _run_one(shard, folder, asked, say)
            if failure is not None or asked.is_set:
                break
            done += 1
            if progress is not None:
                took = (time.monotonic() - began) / (place + 1)
                progress(done, len(shards), took * (len(missing) - place - 1))
        return finished_of(plan, folder, shards, shards, () if failure is None else (failure,))


def _in_order(plan: CampaignPlan) -> list[Shard]:
    """Shards of one experiment each in the order of the file."""
    places = {each.hash: place for place, each in enumerate(plan.planned)}
    return sorted(shards_of(plan, 1), key=lambda shard: places[shard.planned[0].hash])


def _silent(_line: str) -> None:
    """Tell nobody."""


def _check_buses(plan: CampaignPlan) -> None:
    """Refuse another plant and a wrong bus file before anything is begun; raises ConfigError."""
    for file in dict.fromkeys(_choice(each).bus for each in plan.planned):
        load_bus(file)


def _choice(planned: Planned) -> CanChoice:
    """Drives of an experiment; raises ConfigError for another plant."""
    plant = planned.experiment.plant
    if not isinstance(plant, CanChoice):
        raise ConfigError(f"a bench runs plant 'can'; block {planned.block} is on another")
    return plant


def _run_one(shard: Shard, folder: Path, stop: StopFlag, note: Note) -> str | None:
    """Run one experiment and put its rows in place; returns why it could not be, or none."""
    planned = shard.planned[0]
    where = f"{planned.block}, cell {planned.cell}, trial {planned.trial}"
    choice = _choice(planned)
    try:
        with open_session(load_bus(choice.bus_file), choice, leads=False) as session:
            troubles = drive_troubles(session)
        if troubles:
            return f"{where}: before the run {'; '.join(troubles)}; see to it and call again"
        finished = record(planned.experiment, folder / RECORDS, stop=stop, on_note=note)
    except LegbenchError as error:
        # A drive that keeps its power is told by a note of the error.
        return f"{where}: {'; '.join([str(error), *getattr(error, '__notes__', [])])}"
    outcome = finished.outcome
    if outcome.status == INTERRUPTED:
        return None
    if outcome.status != COMPLETE:
        return f"{where}: {outcome.message or outcome.cause}; its run is {finished.path}"
    kept = folder / RECORDS / planned.hash
    try:
        finished.path.rename(kept)
    except OSError as error:
        raise RecordingError(f"{finished.path} cannot be renamed to {kept}: {error}") from error
    rows = measured_rows(load(kept), planned.hash)
    write_into(shard_path(folder, shard), shard_bytes(shard.name, rows))
    return None
