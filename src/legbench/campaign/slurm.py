"""Executor that runs shards as an array of Slurm jobs."""

import time
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from subprocess import CalledProcessError
from typing import Any, final

from legbench.campaign._submitit import (
    AutoExecutor,
    FailedJobError,
    FailedSubmissionError,
    UncompletedJobError,
)
from legbench.campaign.executor import AbstractExecutor, Done, Note
from legbench.campaign.work import Work, do_work
from legbench.errors import CampaignError, LegbenchError
from legbench.interrupts import StopFlag

JOB_NAME = "legbench"
MOST_JOBS = 1000
"""Largest number of jobs of one array, a usual limit of clusters (MaxArraySize)."""


@final
class SlurmExecutor(AbstractExecutor):
    """Executor that submits shards as a job array and waits for it; a job that dies is run again.

    Jobs and results are handed over in a folder that all nodes must see, and so are recordings.
    """

    def __init__(
        self,
        folder: Path,
        *,
        cluster: str = "slurm",
        options: Mapping[str, Any] | None = None,
        look_every: float = 2.0,
    ) -> None:
        """Prepare for a cluster.

        Args:
            folder: where jobs leave their scripts, logs and results.
            cluster: `slurm`; `local` and `debug` run the same jobs on this machine.
            options: parameters of submitit, such as `slurm_partition` and `timeout_min`.
            look_every: time between two looks at the jobs [s].

        Raises:
            CampaignError: there is no Slurm here, or an option makes no sense.
        """
        self._look_every = look_every
        try:
            self._executor = AutoExecutor(folder=folder, cluster=cluster)
            # One processor and 2 GiB for each job: a batch of 16 legs takes 120 MiB.
            usual = {"name": JOB_NAME, "cpus_per_task": 1, "mem_gb": 2, "timeout_min": 60}
            self._executor.update_parameters(**usual | dict(options or {}))
        except (RuntimeError, ValueError, NameError, TypeError) as error:
            raise CampaignError(f"no jobs can be submitted: {error}") from error

    def run(self, works: Sequence[Work], stop: StopFlag, note: Note) -> Iterator[Done]:
        """Submit the shards, wait for them, and cancel what is left when somebody asks.

        Jobs that are not over are cancelled however the iteration ends.

        Raises:
            CampaignError: Slurm refuses the jobs.
        """
        for at in range(0, len(works), MOST_JOBS):
            running = self._submit(works[at : at + MOST_JOBS])
            again: list[Work] = []
            yield from self._wait(running, stop, note, again)
            if again and not stop.is_set:
                note(f"jobs that died, whose shards are run again: {len(again)}")
                dead: list[Work] = []
                yield from self._wait(self._submit(again), stop, note, dead)
                for work in dead:
                    first = work.hashes[0][:12]
                    yield Done(
                        work=work,
                        failure=f"its job died twice: {len(work.hashes)} experiments from {first} "
                        "on; see the logs of its jobs",
                    )

    def _submit(self, works: Sequence[Work]) -> dict[Any, Work]:
        try:
            jobs = self._executor.map_array(_job, works)
        except (FailedJobError, FailedSubmissionError, OSError) as error:
            why = " ".join(str(error).split()) or "sbatch failed without a word"
            raise CampaignError(
                f"Slurm refuses the jobs: {why}; parameters are given as --slurm NAME=VALUE"
            ) from error
        return dict(zip(jobs, works, strict=True))

    def _wait(
        self, running: dict[Any, Work], stop: StopFlag, note: Note, dead: list[Work]
    ) -> Iterator[Done]:
        """Yield what comes to its end; jobs without a result go to `dead`."""
        try:
            while running and not stop.is_set:
                over = [job for job in running if job.done()]
                for job in over:
                    work = running.pop(job)
                    try:
                        yield job.result()
                    except FailedJobError:
                        # Its work has raised something not ours, which it would do again.
                        yield Done(work=work, failure=f"its job failed; see {job.paths.stderr}")
                    except UncompletedJobError:
                        dead.append(work)
                if not over:
                    time.sleep(self._look_every)
        finally:
            _cancel(running, note)


def _cancel(jobs: Iterable[Any], note: Note) -> None:
    """Cancel jobs; one that cannot be, as when it has just ended, keeps none of the others."""
    kept = []
    for job in jobs:
        try:
            job.cancel()
        except (OSError, CalledProcessError):
            kept.append(job.job_id)
    if kept:
        note(f"scancel has failed for jobs that may have ended: {' '.join(kept)}; see squeue")


def _job(work: Work) -> Done:
    """Do the work of a job; what is refused is told by its result, not by its log."""
    try:
        return Done(work=work, content=do_work(work))
    except LegbenchError as error:
        return Done(work=work, failure=str(error))
