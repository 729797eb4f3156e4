"""Work of a shard, wherever it is done: text of experiments in, content of the shard's file out."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from legbench.campaign.records import write_record
from legbench.campaign.rows import Row, measured_rows
from legbench.campaign.shards import Shard, shard_bytes
from legbench.errors import CampaignError
from legbench.experiment.batch import run_batch
from legbench.experiment.canonical import experiment_hash
from legbench.experiment.data import Experiment
from legbench.experiment.running import record_in_memory
from legbench.experiment.tables import read_tables, write_tables
from legbench.interrupts import StopFlag
from legbench.recording.reader import Recording

Stop = Callable[[], bool]
"""Function that says whether the work is to be given up."""


class StoppedError(CampaignError):
    """Error of a work that was given up because somebody asked; nothing of it is kept."""

    def __init__(self, message: str = "the work was given up as asked") -> None:
        super().__init__(message)


@dataclass(frozen=True, slots=True, kw_only=True)
class Work:
    """Work of one shard, as it is sent to another process: experiments as tables, not objects."""

    name: str
    """Name of the shard."""
    experiments: tuple[Mapping[str, Any], ...]
    hashes: tuple[str, ...]
    together: bool
    records: Path | None
    """Folder under which each run leaves its recording; none: recordings are dropped."""


def work_of(shard: Shard, records: Path | None) -> Work:
    """Work that a shard is."""
    return Work(
        name=shard.name,
        experiments=tuple(write_tables(each.experiment) for each in shard.planned),
        hashes=tuple(each.hash for each in shard.planned),
        together=shard.together,
        records=records,
    )


def do_work(work: Work, *, threads: int | None = 1, stop: Stop | None = None) -> bytes:
    """Run the experiments of a shard and return the content of its file.

    Args:
        work: what to do.
        threads: threads that step a batch; none: one a processor.
        stop: asked now and then whether to give up.

    Raises:
        StoppedError: it was asked to stop.
        CampaignError: an experiment is not the one that was planned, as when a guest's file was
            changed on the way.
        RecordingError: a recording cannot be written.
    """
    experiments = [_read(*pair) for pair in zip(work.experiments, work.hashes, strict=True)]

    rows: list[Row] = []
    asked = stop if stop is not None else _never
    run = _together if work.together else _alone
    for place, recording in enumerate(run(experiments, threads, asked)):
        if work.records is not None:
            tables = work.experiments[place]
            write_record(recording, work.records, work.hashes[place], tables)
        rows += measured_rows(recording, work.hashes[place])
    return shard_bytes(work.name, rows)


def _never() -> bool:
    return False


def _together(
    experiments: list[Experiment], threads: int | None, stop: Stop
) -> Iterator[Recording]:
    """Step all experiments side by side."""

    def look(_done: int, _total: int) -> None:
        if stop():
            raise StoppedError

    yield from run_batch(experiments, threads=threads, progress=look)


def _alone(experiments: list[Experiment], _threads: int | None, stop: Stop) -> Iterator[Recording]:
    """Run one experiment after another."""
    for experiment in experiments:
        flag = StopFlag()

        def look(_done: int, _total: int, flag: StopFlag = flag) -> None:
            if stop():
                flag.set()

        if stop():
            raise StoppedError
        recording = record_in_memory(experiment, stop=flag, progress=look)
        if flag.is_set:
            raise StoppedError
        yield recording


def _read(tables: Mapping[str, Any], name: str) -> Experiment:
    experiment = read_tables(Experiment, tables, Path.cwd())
    found = experiment_hash(experiment)
    if found != name:
        raise CampaignError(
            f"experiment {name[:12]} has become {found[:12]}: a controller or plant of yours was "
            "changed while the campaign ran; call it again"
        )
    return experiment
