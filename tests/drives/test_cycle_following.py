"""One cycle by itself that follows the SYNC of another master."""

from cycle_wire import BOTH, US, Wire, cycle, missed
from drives_rig import MS


def test_the_sync_of_another_master_is_followed_and_nothing_is_sent() -> None:
    wire = Wire()
    it = cycle(wire)
    assert not it.hears_sync(3 * MS)
    assert wire.time_ns == 3 * MS
    for at in (4, 5, 6, 8, 10):
        wire.plan(at * MS, 0x080)
        for after_ns, cob_id, data in BOTH:
            wire.plan(at * MS + after_ns, cob_id, data)
    assert it.hears_sync(5 * MS)
    assert wire.time_ns == 4 * MS
    ticks = [it.follow() for _ in range(4)]
    assert [tick.time_ns for tick in ticks] == [5 * MS, 6 * MS, 8 * MS, 10 * MS]
    assert [(tick.skipped, tick.silent, tick.late_ns) for tick in ticks[1:]] == [
        (0, 0, 0),
        (1, 1, 0),
        (1, 1, 0),
    ]
    assert all(tick.complete for tick in ticks)
    # What the drives answered to the first SYNC came before the second one was awaited.
    assert it.late_frames == 2
    assert it.stranger is None
    assert not wire.sent
    # A master that is heard no more is waited for two periods.
    now = wire.time_ns
    gone = it.follow()
    assert (gone.complete, gone.skipped) == (False, 0)
    assert wire.time_ns == now + 2 * MS
    assert missed(it) == [1, 1]
    # It counts for one period; of the SYNC at 12 ms nobody has heard.
    wire.plan(13 * MS, 0x080)
    assert it.follow().skipped == 1


def test_a_bus_that_fails_while_another_master_is_followed_is_told() -> None:
    wire = Wire()
    it = cycle(wire)
    wire.deaf = True
    assert not it.follow().complete
    assert str(it.bus_error) == "deaf"
    assert missed(it) == [1, 1]
    wire.deaf = False
    wire.plan(wire.time_ns + 100 * US, 0x080)
    assert not it.follow().complete
    assert it.bus_error is None
