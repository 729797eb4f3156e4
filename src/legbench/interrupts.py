"""Interruption by signals; the only place that installs handlers for them.

^C (SIGINT), SIGTERM and SIGHUP are treated alike. Outside a control loop the first one raises
KeyboardInterrupt wherever the program is; within a loop it sets a flag that the loop looks at
between two rows. What brings drives to rest runs in a `shielded` block, in which no signal raises
anything.

A signal that arrives in the few microseconds before a shielded block has begun is answered by
whoever closes next, further out; drives that nobody stops see their master fall silent.
"""

import signal
import threading
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from types import FrameType, TracebackType
from typing import Any, Self, final

STOP_SIGNALS = tuple(
    getattr(signal, name) for name in ("SIGHUP", "SIGTERM", "SIGINT") if name in vars(signal)
)
"""Signals that end a run: the end of the terminal, where it has a signal; a request to end; ^C."""
INSIST = 2.0
"""A signal that comes so long after the first raises once more: the first was lost in code that
swallows exceptions, or hangs. Every stop of drives is over by then [s]."""

_Handler = Callable[[int, FrameType | None], Any] | int | signal.Handlers | None


@final
class StopFlag:
    """Request to end, which a loop looks at between two rows.

    Attributes:
        is_set: whether somebody has asked.
        raises: whether asking raises KeyboardInterrupt, because no loop looks at the flag: while a
            plant is opened or goes to its start posture.
    """

    def __init__(self, *, raises: bool = False) -> None:
        self.is_set = False
        self.raises = raises

    def set(self) -> None:
        """Set the request to end.

        Raises:
            KeyboardInterrupt: no loop looks at the flag.
        """
        self.is_set = True
        if self.raises:
            raise KeyboardInterrupt


@contextmanager
def stop_on_interrupt(*, raises: bool = False) -> Iterator[StopFlag]:
    """Turn ^C, SIGTERM and SIGHUP into a flag, or into one KeyboardInterrupt.

    Later signals do nothing: what the first one has begun must come to its end. With `raises`, one
    that comes `INSIST` seconds later raises again. Threads other than the main one get a flag that
    nothing sets, since Python gives them no signals.

    Args:
        raises: begin with a flag that raises; `loop.run` holds that back while it loops.
    """
    flag = StopFlag(raises=raises)
    if not _gets_signals():
        yield flag
        return
    first = 0.0

    def handle(_signal: int, _frame: FrameType | None) -> None:
        nonlocal first
        if not flag.is_set:
            first = time.monotonic()
            flag.set()
        elif raises and time.monotonic() - first > INSIST:
            raise KeyboardInterrupt

    before: dict[int, _Handler] = {}
    try:
        for number in STOP_SIGNALS:
            before[number] = signal.getsignal(number)
            signal.signal(number, handle)
        yield flag
    finally:
        late = _undisturbed(lambda: _install(before))
        if late is not None:
            raise late


@final
class Shield:
    """Block of code in which signals raise nothing; they are delivered when it has ended.

    Holds for every handler that is installed when the block begins: ours, Python's own, which
    raises KeyboardInterrupt, a guest's, and the system's, which ends the process. Masking signals
    in this thread would not do: another thread takes them, and Python's handlers run in the main
    thread all the same. Signals that are ignored stay ignored. Shields may be nested; outside the
    main thread they do nothing.
    """

    def __init__(self) -> None:
        self._before: dict[int, _Handler] = {}
        self._came: list[int] = []
        self._held: BaseException | None = None

    def hold(self, error: BaseException | None) -> None:
        """Remember an interruption that somebody raised in the block, and raise it after the block.

        An error, as opposed to a KeyboardInterrupt or a SystemExit, is left to the caller.
        """
        if not isinstance(error, Exception):
            self._held = self._held or error

    def __enter__(self) -> Self:
        if _gets_signals():
            self.hold(_undisturbed(self._raise))
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.hold(_undisturbed(lambda: _install(self._before)))
        for number in self._came:
            signal.raise_signal(number)
        if self._held is not None:
            raise self._held

    def _raise(self) -> None:
        """Replace the handlers of those signals that have one."""
        for number in STOP_SIGNALS:
            handler = signal.getsignal(number)
            if handler not in (None, signal.SIG_IGN, self._remember):
                self._before[number] = handler
                signal.signal(number, self._remember)

    def _remember(self, number: int, _frame: FrameType | None) -> None:
        if number not in self._came:
            self._came.append(number)


def shielded() -> Shield:
    """Make ^C, SIGTERM and SIGHUP wait until the block of this `with` has ended."""
    return Shield()


@contextmanager
def children_without_interrupts() -> Iterator[None]:
    """Start processes in this block that ^C does not reach from their first instruction on.

    A new process inherits which signals are blocked. The system gives a ^C to a thread that does
    not block it, and Python would raise it here all the same, in the middle of what a new process
    is being told: it waits until the block has ended.
    """
    mask = getattr(signal, "pthread_sigmask", None)
    with shielded():
        if mask is None:  # Windows: the processes themselves ignore ^C, an instant later
            yield
            return
        before = mask(signal.SIG_BLOCK, {signal.SIGINT})
        try:
            yield
        finally:
            mask(signal.SIG_SETMASK, before)


def ignore_interrupts() -> None:
    """Leave ^C, which goes to a whole group of processes, to the parent of this one."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)


def _gets_signals() -> bool:
    return threading.current_thread() is threading.main_thread()


def _install(handlers: Mapping[int, _Handler]) -> None:
    """Install handlers; one that was not made in Python (None) cannot be installed again."""
    for number, handler in handlers.items():
        if handler is not None:
            signal.signal(number, handler)


def _undisturbed(action: Callable[[], None]) -> KeyboardInterrupt | None:
    """Do what may be done twice, once more if an interruption falls into it; the first of these."""
    interruption: KeyboardInterrupt | None = None
    while True:
        try:
            action()
            return interruption
        except KeyboardInterrupt as error:
            interruption = interruption or error
