"""Interruptions: raised once outside of loops, never where drives are stopped."""

import signal
import threading
from collections.abc import Iterator

import pytest

from legbench import interrupts
from legbench.interrupts import INSIST, STOP_SIGNALS, shielded, stop_on_interrupt


@pytest.fixture(autouse=True)
def _raising_handlers() -> Iterator[None]:
    """All three signals raise KeyboardInterrupt, as ^C does in Python."""
    before = {number: signal.getsignal(number) for number in STOP_SIGNALS}
    for number in STOP_SIGNALS:
        signal.signal(number, signal.default_int_handler)
    yield
    for number, handler in before.items():
        signal.signal(number, handler)


def handlers() -> set[object]:
    return {signal.getsignal(number) for number in STOP_SIGNALS}


@pytest.mark.parametrize("number", STOP_SIGNALS)
def test_a_signal_in_a_shield_is_raised_after_it(number: signal.Signals) -> None:
    done = []

    def stop() -> None:
        with shielded():
            signal.raise_signal(number)
            signal.raise_signal(number)
            done.append("stopped")
        done.append("never")

    with pytest.raises(KeyboardInterrupt):
        stop()
    assert done == ["stopped"]
    assert handlers() == {signal.default_int_handler}


def test_what_a_driver_raises_may_be_held_until_the_end_and_an_error_is_not() -> None:
    done = []

    def stop(error: BaseException) -> None:
        with shielded() as shield:
            shield.hold(error)
            done.append(type(error).__name__)

    with pytest.raises(KeyboardInterrupt):
        stop(KeyboardInterrupt())
    stop(OSError())
    assert done == ["KeyboardInterrupt", "OSError"]


def test_shields_may_be_nested() -> None:
    done = []

    def stop() -> None:
        with shielded():
            with shielded():
                signal.raise_signal(signal.SIGINT)
                done.append("inner")
            done.append("outer")

    with pytest.raises(KeyboardInterrupt):
        stop()
    assert done == ["inner", "outer"]
    assert handlers() == {signal.default_int_handler}


def test_a_signal_that_is_ignored_stays_ignored() -> None:
    signal.signal(signal.SIGHUP, signal.SIG_IGN)
    with shielded():
        assert signal.getsignal(signal.SIGHUP) is signal.SIG_IGN
        signal.raise_signal(signal.SIGHUP)
    assert signal.getsignal(signal.SIGHUP) is signal.SIG_IGN


@pytest.mark.parametrize("at", range(1, 7))
def test_a_signal_while_a_shield_is_put_up_or_taken_down_leaves_no_handler(
    at: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """`at` counts the calls that install a handler: three up, three down."""
    install, calls, done = signal.signal, 0, []

    def installing(number: int, handler: object) -> object:
        nonlocal calls
        calls += 1
        if calls == at:
            raise KeyboardInterrupt
        return install(number, handler)  # pyrefly: ignore[bad-argument-type]

    def stop() -> None:
        with shielded():
            done.append("stopped")

    monkeypatch.setattr(signal, "signal", installing)
    with pytest.raises(KeyboardInterrupt):
        stop()
    monkeypatch.undo()
    assert done == ["stopped"]
    assert handlers() == {signal.default_int_handler}


def test_off_the_main_thread_a_shield_does_nothing() -> None:
    done = []

    def work() -> None:
        with shielded():
            done.append(handlers())

    thread = threading.Thread(target=work)
    thread.start()
    thread.join()
    assert done == [{signal.default_int_handler}]


@pytest.mark.parametrize("number", STOP_SIGNALS)
def test_the_first_signal_raises_and_the_next_one_changes_nothing(
    number: signal.Signals, monkeypatch: pytest.MonkeyPatch
) -> None:
    # A machine that stands still for 2 s makes the next one a signal long after the first.
    monkeypatch.setattr(interrupts.time, "monotonic", lambda: 100.0)
    done = []
    with stop_on_interrupt(raises=True) as stop:
        with pytest.raises(KeyboardInterrupt):
            signal.raise_signal(number)
        assert stop.is_set
        for other in STOP_SIGNALS:
            signal.raise_signal(other)
        done.append("stopped")
    assert done == ["stopped"]
    assert handlers() == {signal.default_int_handler}


def test_a_signal_long_after_the_first_raises_again(monkeypatch: pytest.MonkeyPatch) -> None:
    now = 100.0
    monkeypatch.setattr(interrupts.time, "monotonic", lambda: now)
    with stop_on_interrupt(raises=True), pytest.raises(KeyboardInterrupt):
        signal.raise_signal(signal.SIGINT)
    with stop_on_interrupt(raises=True):
        with pytest.raises(KeyboardInterrupt):
            signal.raise_signal(signal.SIGINT)
        now += INSIST
        signal.raise_signal(signal.SIGINT)
        now += 0.1
        with pytest.raises(KeyboardInterrupt):
            signal.raise_signal(signal.SIGINT)


def test_a_flag_that_is_looked_at_raises_nothing() -> None:
    with stop_on_interrupt() as stop:
        for number in STOP_SIGNALS:
            signal.raise_signal(number)
        assert stop.is_set
