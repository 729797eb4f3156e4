"""Interface of what runs the shards of a campaign, and the executor that needs no other process."""

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import final

from legbench.campaign.work import StoppedError, Work, do_work
from legbench.errors import LegbenchError, RecordingError
from legbench.interrupts import StopFlag

Note = Callable[[str], None]
"""Function that is called with a line that a person should know."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Done:
    """Shard that was run, or could not be."""

    work: Work
    content: bytes = b""
    """Content of its file."""
    failure: str | None = None
    """Reason why there is none."""


class AbstractExecutor(ABC):
    """Executor of shards."""

    @abstractmethod
    def run(self, works: Sequence[Work], stop: StopFlag, note: Note) -> Iterator[Done]:
        """Run shards and yield each when it is done, in any order.

        Nothing is written here but recordings. Once `stop` is set, what runs is given up and the
        iteration ends early.

        Args:
            works: what to do.
            stop: set when somebody asks for the end.
            note: told what a person should know, such as a worker that died.

        Raises:
            RecordingError: a recording cannot be written, as on a full disk.
        """


@final
class SerialExecutor(AbstractExecutor):
    """Executor that runs one shard after another in this process, each on all processors."""

    def __init__(self, threads: int | None = None) -> None:
        """Prepare for a number of threads that step a batch; none: one a processor."""
        self._threads = threads

    def run(self, works: Sequence[Work], stop: StopFlag, note: Note) -> Iterator[Done]:
        """Run shards one after another."""
        for work in works:
            try:
                content = do_work(work, threads=self._threads, stop=lambda: stop.is_set)
            except StoppedError:
                return
            except RecordingError:
                raise
            except LegbenchError as error:
                yield Done(work=work, failure=str(error))
                continue
            yield Done(work=work, content=content)
