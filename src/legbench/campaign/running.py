"""Running a campaign: the shards that are missing, then the table."""

import json
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pyarrow as pa

from legbench.campaign.drives import refuse_drives
from legbench.campaign.executor import AbstractExecutor, Done, Note
from legbench.campaign.folder import (
    Part,
    is_done,
    one_at_a_time,
    open_folder,
    shard_path,
    write_into,
)
from legbench.campaign.plan import CampaignPlan
from legbench.campaign.records import RECORDS
from legbench.campaign.shards import (
    NAME_KEY,
    PROVENANCE_KEY,
    Shard,
    check_version,
    read_shard,
    told_of,
)
from legbench.campaign.table import TABLE, whole_table
from legbench.campaign.work import work_of
from legbench.errors import CampaignError, RecordingError
from legbench.interrupts import StopFlag
from legbench.recording.sealed import sealed_bytes

Progress = Callable[[int, int, float | None], None]
"""Function that is called with experiments done, experiments in all, and the time left [s] or
none while that is not known."""


@dataclass(frozen=True, slots=True, kw_only=True)
class FinishedCampaign:
    """What has become of a campaign, or of the part that was asked for."""

    folder: Path
    done: int
    """Number of experiments whose rows are there, those of earlier calls included."""
    wanted: int
    """Number of experiments that were to be there after this call."""
    total: int
    """Number of experiments of the campaign."""
    stopped: bool
    """Whether somebody asked for the end before it was reached."""
    failures: tuple[str, ...]
    """Shards that could not be run, each with its reason."""
    table: Path | None
    """The table; none while rows are missing."""


def run_campaign(
    plan: CampaignPlan,
    folder: Path,
    executor: AbstractExecutor,
    shards: Sequence[Shard],
    *,
    part: Part | None = None,
    records: bool = False,
    stop: StopFlag | None = None,
    progress: Progress | None = None,
    note: Note | None = None,
) -> FinishedCampaign:
    """Run the shards of a campaign that are not there yet, and make its table once all are.

    A call that was interrupted or killed is gone on with by calling again: what is there is kept,
    what was under way is run again, and the table is the same to the byte.

    Args:
        plan: what is to be run.
        folder: where shards, recordings and the table are kept.
        executor: what runs the shards.
        shards: the plan's shards.
        part: number and count of the part of the shards to run; none: all of them.
        records: whether the recording of every run is kept under `records`, by its hash.
        stop: ends it when it is set.
        progress: told how far it is after each shard.
        note: told what a person should know.

    Raises:
        CampaignError: the folder holds something else or is in use, a file cannot be written, or
            an experiment moves drives.
    """
    refuse_drives(plan)
    number, count = part or (1, 1)
    mine = [shard for place, shard in enumerate(shards) if place % count == number - 1]
    with open_folder(folder, plan, part):
        kept = folder.resolve() / RECORDS if records else None
        missing = [shard for shard in mine if not _kept(folder, shard, kept)]
        clock = _Clock(mine, missing, progress)
        works = [work_of(shard, kept) for shard in missing]
        done = executor.run(works, stop or StopFlag(), note or _silent)
        failures = _put_all(done, missing, folder, clock)
        return finished_of(plan, folder, shards, mine, failures)


def finished_of(
    plan: CampaignPlan,
    folder: Path,
    shards: Sequence[Shard],
    mine: Sequence[Shard],
    failures: tuple[str, ...],
) -> FinishedCampaign:
    """Look what is there, and make the table if that is all."""
    there = {shard.name for shard in shards if is_done(folder, shard)}
    done = sum(len(shard.planned) for shard in mine if shard.name in there)
    wanted = sum(len(shard.planned) for shard in mine)
    return FinishedCampaign(
        folder=folder,
        done=done,
        wanted=wanted,
        total=len(plan.planned),
        stopped=done < wanted and not failures,
        failures=failures,
        table=_assembled(plan, folder, shards) if len(there) == len(shards) else None,
    )


def _kept(folder: Path, shard: Shard, records: Path | None) -> bool:
    """Whether the rows of a shard are there, and the recordings if they are asked for."""
    if not is_done(folder, shard):
        return False
    return records is None or all((records / each.hash).is_dir() for each in shard.planned)


def _put_all(
    found: Iterator[Done], missing: Sequence[Shard], folder: Path, clock: "_Clock"
) -> tuple[str, ...]:
    """Put each shard that was run in its place; returns those that failed, with reasons."""
    by_name = {shard.name: shard for shard in missing}
    failures: list[str] = []
    try:
        for done in found:
            shard = by_name[done.work.name]
            failure = _put(done, shard, folder)
            if failure is not None:
                failures.append(f"{shard.planned[0].block}: {failure}")
            clock.passed(shard)
    except RecordingError as error:
        raise CampaignError(
            f"{error}; make room or name another --out, and call again: what is done is kept"
        ) from error
    return tuple(failures)


def _silent(_line: str) -> None:
    """Tell nobody."""


def _put(done: Done, shard: Shard, folder: Path) -> str | None:
    """Put the file of a shard in its place; returns why there is none, or none."""
    if done.failure is not None:
        return done.failure
    told = told_of(done.content)
    if told.get(NAME_KEY) != shard.name.encode():
        return "its worker has sent another shard"
    try:
        check_version(told, "a worker's shard")
    except CampaignError as error:
        return str(error)
    write_into(shard_path(folder, shard), done.content)
    return None


class _Clock:
    """Time that a campaign has taken, and from it the time that it will take."""

    def __init__(
        self, mine: Sequence[Shard], missing: Sequence[Shard], progress: Progress | None
    ) -> None:
        self._progress = progress
        self._total = sum(len(shard.planned) for shard in mine)
        self._done = self._total - sum(len(shard.planned) for shard in missing)
        self._left = sum(shard.cost for shard in missing)
        self._passed = 0.0
        self._began = time.monotonic()
        self._tell(None)

    def passed(self, shard: Shard) -> None:
        """Count a shard that is over, and tell how far it is."""
        self._done += len(shard.planned)
        self._passed += shard.cost
        self._left -= shard.cost
        took = time.monotonic() - self._began
        self._tell(took * max(self._left, 0.0) / self._passed)

    def _tell(self, left: float | None) -> None:
        if self._progress is not None:
            self._progress(self._done, self._total, left)


def _assembled(plan: CampaignPlan, folder: Path, shards: Sequence[Shard]) -> Path:
    """Write the table of all shards and return its path."""
    with one_at_a_time(folder):
        made: set[bytes] = set()
        parts: list[pa.Table] = []
        for shard in shards:
            part = read_shard(shard_path(folder, shard))
            made.add((part.schema.metadata or {})[PROVENANCE_KEY])
            parts.append(part.replace_schema_metadata(None))
        found: list[Any] = [json.loads(each) for each in sorted(made)]
        table = whole_table(
            pa.concat_tables(parts),
            plan.settings,
            {each.hash: each.trial for each in plan.planned},
            plan.axes,
            json.dumps(found, sort_keys=True).encode(),
        )
        path = folder / TABLE
        write_into(path, sealed_bytes(table))
    return path
