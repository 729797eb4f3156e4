"""Executor that runs shards on Dask workers, of this machine or of a cluster."""

import logging
from collections.abc import Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, wait
from contextlib import ExitStack, contextmanager
from typing import Any, final

from legbench.campaign._distributed import Client, KilledWorker, LocalCluster, configured
from legbench.campaign.executor import AbstractExecutor, Done, Note
from legbench.campaign.pool import LOOK_EVERY, died_twice, done_of, workers_or_processors
from legbench.campaign.work import Work, do_work
from legbench.errors import CampaignError, ConfigError
from legbench.interrupts import StopFlag, children_without_interrupts

AHEAD = 2
"""Number of shards that each worker is given at a time: one that it does, one that waits."""
CONNECT = 20.0
"""Longest time that a scheduler may take to answer [s]."""


@final
class DaskExecutor(AbstractExecutor):
    """Executor that runs shards on Dask workers; a shard whose worker dies is run once more.

    Raises:
        ConfigError: no worker.
    """

    def __init__(self, address: str | None = None, workers: int | None = None) -> None:
        """Prepare for a scheduler.

        Args:
            address: HOST:PORT of a scheduler that runs; none: one of this campaign's own, which
                listens on loopback alone and has no dashboard.
            workers: number of its own worker processes, one thread each; none: one a processor.

        Raises:
            ConfigError: the address is no HOST:PORT.
        """
        if address is not None:
            host, _, port = address.rpartition(":")
            if not host or not port.isdecimal() or not 0 < int(port) < 1 << 16:
                raise ConfigError(
                    f"'{address}' is no address of a scheduler; give HOST:PORT, as in "
                    "dask://127.0.0.1:8786, or leave it out for one of this campaign's own"
                )
        self._address = address
        self._workers = workers_or_processors(workers)

    def run(self, works: Sequence[Work], stop: StopFlag, note: Note) -> Iterator[Done]:
        """Run shards on the workers; recordings go to a folder that they all must see.

        A worker that dies takes down what it did and what waited for it: all of that is run again,
        one shard at a time, and the one that kills its worker once more is named.
        """
        with self._client() as client:
            width = AHEAD * max(1, len(client.scheduler_info()["workers"]))
            suspects: list[Work] = []
            yield from _run(client, list(works), suspects, width, stop)
            if suspects:
                note(f"a worker died; shards that it had and that are run again: {len(suspects)}")
            for work in suspects:
                killed: list[Work] = []
                yield from _run(client, [work], killed, 1, stop)
                if killed:
                    yield Done(work=work, failure=died_twice(work))

    @contextmanager
    def _client(self) -> Iterator[Any]:
        """Connect to the scheduler, which is begun and ended here where none is named."""
        with ExitStack() as stack:
            # Who waited for a worker that died is as suspect as what it did: neither is blamed for
            # it, and both come back here at once.
            stack.enter_context(configured({"distributed.scheduler.allowed-failures": 0}))
            if self._address is not None:
                try:
                    yield stack.enter_context(
                        Client(f"tcp://{self._address}", timeout=f"{CONNECT}s")
                    )
                except OSError as error:
                    raise CampaignError(
                        f"no Dask scheduler answers at {self._address} within {CONNECT:g} s: "
                        f"{error}; start one with `dask scheduler`, or say --executor dask"
                    ) from None
                return
            with children_without_interrupts():
                cluster = LocalCluster(
                    n_workers=self._workers,
                    threads_per_worker=1,
                    host="127.0.0.1",
                    scheduler_kwargs={"dashboard": False, "dashboard_address": "127.0.0.1:0"},
                    silence_logs=logging.CRITICAL,
                )
            stack.enter_context(cluster)
            yield stack.enter_context(Client(cluster))


def _run(
    client: Any, waiting: list[Work], suspects: list[Work], width: int, stop: StopFlag
) -> Iterator[Done]:
    """Run what waits; what a worker had that died becomes suspect."""
    pool, running = client.get_executor(pure=False), dict[Future[bytes], Work]()
    while (waiting or running) and not stop.is_set:
        while waiting and len(running) < width:
            work = waiting.pop(0)
            running[pool.submit(do_work, work)] = work
        for future in wait(running, LOOK_EVERY, FIRST_COMPLETED).done:
            work, error = running.pop(future), future.exception()
            if isinstance(error, KilledWorker):
                suspects.append(work)
            else:
                yield done_of(work, error, future)
