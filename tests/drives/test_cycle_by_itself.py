"""One cycle by itself: the grid, and answers that are late, missing, garbled or one too many."""

import can
import pytest
from cycle_wire import BOTH, DATA, US, Wire, cycle, missed, stale
from drives_rig import MS, config

from legbench.drives.master.cycle import Tick

# --- the grid --------------------------------------------------------------------------------


@pytest.mark.parametrize("period_us", [1000, 2000])
def test_the_first_tick_is_the_next_whole_period_and_the_others_follow(period_us: int) -> None:
    period = period_us * US
    for begun, first in ((0, period), (1, period), (period - 1, period), (period, 2 * period)):
        wire = Wire(begun)
        it = cycle(wire, config(period_us=period_us))
        ticks = [it.tick() for _ in range(3)]
        assert wire.when(0x080) == [first, first + period, first + 2 * period]
        assert ticks == [Tick(at, 0, 0, 0, True) for at in wire.when(0x080)]
        assert (it.silent_total, it.late_frames, missed(it)) == (0, 0, [0, 0])


def test_what_drives_did_before_the_grid_was_laid_is_forgotten() -> None:
    wire = Wire()
    it = cycle(wire)
    for watch in it.watches:
        watch.take_emergency(bytes.fromhex("1023000000000000"))
        watch.cycle(complete=False)
    # Longer than any heartbeat may take.
    wire.wait_until(60_000 * MS)
    it.begin()
    assert [watch.trouble(wire.time_ns, 1) for watch in it.watches] == [None, None]


@pytest.mark.parametrize(
    ("late_us", "skipped"),
    [(1, 0), (499, 0), (500, 1), (1000, 1), (1499, 1), (1500, 2), (5200, 5)],
)
def test_a_late_tick_is_made_from_half_a_period_on_at_the_next_place_of_the_grid(
    late_us: int, skipped: int
) -> None:
    wire = Wire()
    it = cycle(wire)
    it.tick()
    wire.wait_until(2 * MS + late_us * US)
    told = it.tick()
    at = max(2 * MS + late_us * US, (2 + skipped) * MS)
    assert told == Tick(at, at - (2 + skipped) * MS, skipped, 0, True)
    # The grid does not move.
    assert it.tick() == Tick((3 + skipped) * MS, 0, 0, 0, True)


@pytest.mark.parametrize("after_answers", [0, 1])
def test_after_an_interrupted_cycle_the_next_sync_leaves_a_period_later(after_answers: int) -> None:
    wire = Wire()
    it, receive, left = cycle(wire), wire.receive, [after_answers]

    def interrupted(until_ns: int) -> can.Message | None:
        if wire.syncs and left:
            if left[0] == 0:
                left.clear()
                raise KeyboardInterrupt
            left[0] -= 1
        return receive(until_ns)

    wire.receive = interrupted
    with pytest.raises(KeyboardInterrupt):
        it.tick()
    # What answers the interrupted SYNC passes for nothing; the next one has answers of its own.
    assert it.tick() == Tick(2 * MS, 0, 0, 0, True)
    assert wire.when(0x080) == [1 * MS, 2 * MS]
    assert it.late_frames == 2 - after_answers


def test_answers_count_until_the_deadline_and_no_longer() -> None:
    for at_us, counts in ((720, True), (721, False)):
        wire = Wire()
        wire.answers = lambda number, at=at_us: (BOTH[0], (at * US, 0x182, DATA))
        it = cycle(wire)
        assert it.tick().complete is counts
        assert [axis.fresh for axis in it.axes] == [True, counts]
        assert missed(it) == [0, int(not counts)]
        # All there: the cycle waits no longer.
        assert wire.time_ns == MS + 720 * US


@pytest.mark.parametrize("place", [0, 1])
def test_a_drive_that_missed_a_cycle_is_well_again_after_two_in_a_row(place: int) -> None:
    wire = Wire()
    wire.answers = stale(place, {1})
    it = cycle(wire)
    counts = []
    for _ in range(6):
        it.tick()
        counts.append(it.watches[place].missed)
    # The tick without an answer and the silent one after it.
    assert counts == [0, 1, 2, 0, 0, 0]
    assert it.watches[1 - place].missed == 0


# --- what is owed ----------------------------------------------------------------------------


@pytest.mark.parametrize("place", [0, 1])
def test_after_an_answer_that_has_not_come_one_tick_is_silent(place: int) -> None:
    wire = Wire()
    wire.answers = stale(place, {1})
    it = cycle(wire)
    ticks = [it.tick() for _ in range(4)]
    assert wire.when(0x080) == [1 * MS, 2 * MS, 4 * MS, 5 * MS]
    assert [(tick.skipped, tick.silent, tick.late_ns) for tick in ticks] == [
        (0, 0, 0),
        (0, 0, 0),
        (1, 1, 0),
        (0, 0, 0),
    ]
    assert [tick.complete for tick in ticks] == [True, False, True, True]
    assert it.silent_total == 1
    # The cycle and the silent tick, for the drive that owes them.
    assert missed(it) == [2 - 2 * place, 2 * place]


@pytest.mark.parametrize("place", [0, 1])
def test_what_comes_before_the_next_tick_is_late_and_owed_no_more(place: int) -> None:
    wire = Wire()
    wire.answers = stale(place, {1})
    it = cycle(wire)
    it.tick()
    it.tick()
    wire.plan(2 * MS + 900 * US, 0x181 + place, DATA)
    assert it.tick() == Tick(3 * MS, 0, 0, 0, True)
    assert (it.late_frames, it.silent_total) == (1, 0)
    assert missed(it) == [1 - place, place]
    assert "node answered twice" not in it.notices.events
    # An answer to a SYNC that has its own is one too many.
    wire.plan(3 * MS + 800 * US, 0x181 + place, DATA)
    it.tick()
    assert it.late_frames == 2
    assert it.notices.events["node answered twice"]["count"] == 1
    assert it.notices.events["node answered twice"]["cob_id"] == 0x181 + place


@pytest.mark.parametrize("place", [0, 1])
def test_what_comes_in_a_silent_tick_never_passes_for_new(place: int) -> None:
    wire = Wire()
    wire.answers = stale(place, {1})
    it = cycle(wire)
    it.tick()
    it.tick()
    old = DATA[:2] + (-7).to_bytes(4, "little", signed=True) + DATA[6:]
    # An answer that takes 1.5 ms, behind the tick that would have had its SYNC.
    wire.plan(3 * MS + 500 * US, 0x181 + place, old)
    assert it.tick() == Tick(4 * MS, 0, 1, 1, True)
    assert wire.time_ns == 4 * MS + BOTH[1][0]
    assert [axis.motor_counts for axis in it.axes] == [1000, 1000]
    assert (it.late_frames, it.silent_total) == (1, 1)
    assert "node answered twice" not in it.notices.events


def test_while_a_stop_waits_no_tick_is_silent() -> None:
    wire = Wire()
    wire.answers = lambda number: ()
    it = cycle(wire)
    it.stopping = True
    for _ in range(5):
        assert not it.tick().complete
    assert wire.when(0x080) == [number * MS for number in range(1, 6)]
    assert (it.silent_total, missed(it)) == (0, [5, 5])


@pytest.mark.parametrize("place", [0, 1])
def test_a_garbled_answer_is_counted_for_its_drive_and_not_owed(place: int) -> None:
    wire = Wire()
    wire.answers = lambda number: (BOTH[1 - place], (400 * US, 0x181 + place, DATA[:5]))
    it = cycle(wire)
    assert not it.tick().complete
    assert [watch.bad_total for watch in it.watches] == [1 - place, place]
    it.tick()
    assert wire.when(0x080) == [1 * MS, 2 * MS]


def test_an_answer_that_comes_twice_counts_once() -> None:
    wire = Wire()
    wire.answers = lambda number: (BOTH[0], (300 * US, 0x181, DATA))
    it = cycle(wire)
    told = it.tick()
    assert (told.complete, it.axes[1].fresh) == (False, False)
    assert it.notices.events["node answered twice"]["count"] == 1
