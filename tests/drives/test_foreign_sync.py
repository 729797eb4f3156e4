"""Waiting for the SYNC of another master: what it takes for one, and until when."""

from collections.abc import Sequence
from types import SimpleNamespace
from typing import Any, cast

import can

from legbench.drives.master.foreign_sync import await_sync

UNTIL = 1000


def heard(frames: Sequence[tuple[int, can.Message]], now: int = 0) -> tuple[int | None, list[int]]:
    """Time of the SYNC that is found, and the identifiers of the frames that were passed on."""
    waiting, clock, others = list(frames), [now], []

    def receive(until_ns: int) -> can.Message | None:
        assert until_ns == UNTIL
        if waiting and waiting[0][0] <= until_ns:
            at, message = waiting.pop(0)
            clock[0] = max(clock[0], at)
            return message
        clock[0] = until_ns
        return None

    port = SimpleNamespace(timebase=SimpleNamespace(now_ns=lambda: clock[0]), receive=receive)
    found = await_sync(
        cast(Any, port), UNTIL, lambda message: others.append(message.arbitration_id)
    )
    return found, others


def frame(cob_id: int, **how: bool) -> can.Message:
    return can.Message(arbitration_id=cob_id, is_extended_id=False, **how)


def test_the_first_sync_ends_it_and_what_came_before_is_passed_on() -> None:
    sync = frame(0x080)
    assert heard([(10, frame(0x181)), (20, frame(0x701)), (30, sync), (40, sync)]) == (
        30,
        [0x181, 0x701],
    )
    # An error frame has an identifier, too, and is no SYNC.
    assert heard([(10, frame(0x080, is_error_frame=True))]) == (None, [0x080])


def test_it_ends_with_its_time() -> None:
    assert heard([]) == (None, [])
    assert heard([(UNTIL - 1, frame(0x080))]) == (UNTIL - 1, [])
    assert heard([(UNTIL + 1, frame(0x080))]) == (None, [])
    # Time that is over reads nothing more, though something waits.
    assert heard([(0, frame(0x080))], now=UNTIL) == (None, [])
