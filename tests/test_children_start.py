"""Processes that are started are told everything before a ^C is answered."""

import signal
import threading

import pytest

from legbench.interrupts import children_without_interrupts


def start_while_interrupted(told: list[str]) -> None:
    """Tell new processes something while an interrupt falls on another thread."""
    with children_without_interrupts():
        # The system gives a signal to a thread that does not block it: here to this one.
        other = threading.Thread(
            target=lambda: signal.pthread_kill(threading.get_ident(), signal.SIGINT)
        )
        signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT})
        other.start()
        signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
        other.join()
        told.append("everything")


def test_an_interrupt_on_another_thread_waits_until_the_processes_are_started() -> None:
    told: list[str] = []
    with pytest.raises(KeyboardInterrupt):
        start_while_interrupted(told)
    assert told == ["everything"]
