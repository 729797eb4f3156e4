"""Executor that runs shards in processes of this machine."""

import multiprocessing
import os
import threading
from collections.abc import Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from multiprocessing.synchronize import Event
from typing import Any, final

from legbench.campaign.executor import AbstractExecutor, Done, Note
from legbench.campaign.work import StoppedError, Work, do_work
from legbench.errors import ConfigError, LegbenchError, RecordingError
from legbench.interrupts import StopFlag, children_without_interrupts, ignore_interrupts, shielded

LOOK_EVERY = 0.2
"""Time after which it is looked whether somebody has asked for the end [s]."""

_stop: Event | None = None


def _start(stop: Event) -> None:
    """Prepare a worker: ^C is its parent's business, and it does not outlive its parent."""
    global _stop
    ignore_interrupts()
    _stop = stop
    threading.Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    """End this process when its parent has; a killed parent tells its workers nothing."""
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)


def _work(work: Work) -> bytes:
    return do_work(work, stop=lambda: _stop is not None and _stop.is_set())


@final
class PoolExecutor(AbstractExecutor):
    """Executor that runs shards in processes of their own, one thread each.

    Raises:
        ConfigError: no worker.
    """

    def __init__(self, workers: int | None = None) -> None:
        """Prepare for a number of processes; none: one a processor."""
        self._workers = workers_or_processors(workers)

    def run(self, works: Sequence[Work], stop: StopFlag, note: Note) -> Iterator[Done]:
        """Run shards side by side.

        When a worker dies, nobody can say whose shard has killed it: those that were running are
        run again, each alone, and the one that kills its worker once more is named.
        """
        waiting = list(works)
        while waiting and not stop.is_set:
            suspects: list[Work] = []
            with _pool(self._workers, stop) as pool:
                yield from _run(pool, waiting, suspects, self._workers, stop)
            if suspects:
                note(f"a worker died; shards that were running and are run again: {len(suspects)}")
            for work in suspects:
                if not stop.is_set:
                    yield from self._again(work, stop)

    def _again(self, work: Work, stop: StopFlag) -> Iterator[Done]:
        """Run a shard alone in a process of its own."""
        killed: list[Work] = []
        with _pool(1, stop) as pool:
            yield from _run(pool, [work], killed, 1, stop)
        if killed:
            yield Done(work=work, failure=died_twice(work))


def died_twice(work: Work) -> str:
    """What to say of a shard that has killed its worker, and alone once more."""
    return (
        f"its worker died twice, the second time alone: {len(work.hashes)} experiments from "
        f"{work.hashes[0][:12]} on; is there memory enough for them?"
    )


def workers_or_processors(workers: int | None) -> int:
    """Number of processes: as asked for, or one a processor; raises ConfigError for none."""
    found = workers if workers is not None else os.cpu_count() or 1
    if found < 1:
        raise ConfigError(f"workers is {workers}; a campaign needs 1 process or more")
    return found


@contextmanager
def _pool(workers: int, stop: StopFlag) -> Iterator[ProcessPoolExecutor]:
    """Pool of new processes, which are told to give up when it is left early."""
    context: Any = multiprocessing.get_context("spawn")
    with shielded():  # A ^C in the middle would leave semaphores behind, with a warning of them.
        asked = context.Event()
        pool = ProcessPoolExecutor(
            workers, mp_context=context, initializer=_start, initargs=(asked,)
        )
    try:
        yield pool
    except BaseException:
        asked.set()
        raise
    finally:
        if stop.is_set:
            asked.set()
        pool.shutdown(cancel_futures=True)


def _run(
    pool: ProcessPoolExecutor,
    waiting: list[Work],
    suspects: list[Work],
    workers: int,
    stop: StopFlag,
) -> Iterator[Done]:
    """Run what waits; what was running when a worker died becomes suspect, and the pool is over.

    No more is handed out than workers can do, so that few are suspect and memory stays flat.
    """
    running: dict[Future[bytes], Work] = {}
    broken = False
    while (waiting or running) and not stop.is_set:
        # The first submissions start the workers; one that ^C reached while it loads its modules
        # would die before it could ignore it.
        with children_without_interrupts():
            while waiting and len(running) < workers and not broken:
                try:
                    running[pool.submit(_work, waiting[0])] = waiting[0]
                except BrokenProcessPool:
                    broken = True
                    if not running:
                        suspects.append(waiting.pop(0))
                    break
                waiting.pop(0)
        if not running:
            return
        for future in wait(running, timeout=LOOK_EVERY, return_when=FIRST_COMPLETED).done:
            work = running.pop(future)
            error = future.exception()
            if isinstance(error, BrokenProcessPool):
                broken = True
                suspects.append(work)
            else:
                yield done_of(work, error, future)


def done_of(work: Work, error: BaseException | None, future: "Future[bytes]") -> Done:
    """What has become of a work whose future is over.

    Raises:
        RecordingError: the disk failed, which the next one would find as well.
    """
    if error is None:
        return Done(work=work, content=future.result())
    if isinstance(error, RecordingError):
        raise error
    if isinstance(error, LegbenchError) and not isinstance(error, StoppedError):
        return Done(work=work, failure=str(error))
    return Done(work=work, failure=f"{type(error).__name__}: {error}")
