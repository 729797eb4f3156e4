"""Processes that are started are told everything before a ^C is answered."""

import signal
import threading

import pytest

from legbench.interrupts import children_without_interrupts


def test_an_interrupt_on_another_thread_waits_until_the_processes_are_started() -> None:
    told: list[str] = []

    def interrupt() -> None:
        # The system gives a signal to a thread that does not block it: here to this one.
        signal.pthread_kill(threading.get_ident(), signal.SIGINT)

    with pytest.raises(KeyboardInterrupt), children_without_interrupts():
        other = threading.Thread(target=interrupt)
        signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT})
        other.start()
        signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
        other.join()
        told.append("everything")
    assert told == ["everything"]
