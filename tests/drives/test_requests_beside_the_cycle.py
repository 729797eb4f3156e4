"""A request beside the cycle is sent where neither it nor its answer holds up SYNC's answers."""

from dataclasses import replace
from pathlib import Path

import pytest
from cycle_wire import BOTH, DATA, US, Answers, Wire, cycle
from drives_rig import MS, START, config, node, rig

from legbench.drives.emulated.behaviour import Behaviour
from legbench.drives.protocol.datatypes import DataType
from legbench.drives.protocol.pdo import Mapped
from legbench.drives.setup.asking import PATIENCE_MS, latest_request_us
from legbench.drives.setup.config import BusConfig

WARMTH = Mapped(0x2070, 0, DataType.INTEGER16)
ASKED, TOLD = (0x601, 0x602), (0x581, 0x582)


def warm(**changes: object) -> BusConfig:
    """The rig's bus, whose drives are asked for their temperatures."""
    nodes = tuple(replace(node(place), temperature_object=WARMTH) for place in (0, 1))
    return config(nodes=nodes, **changes)


@pytest.mark.long
def test_no_answer_is_late_in_10_s_in_which_temperatures_are_asked(tmp_path: Path) -> None:
    how = [Behaviour(start_pos=pos, seed=place) for place, pos in enumerate(START)]
    bus = warm(tpdo_deadline_us=706)
    with rig(tmp_path, bus_config=bus, behaviours=how) as it:
        it.link.start()
        it.network.log = log = []
        it.run(10_000)
        cycle = it.link.cycle
        assert (cycle.late_frames, cycle.silent_total) == (0, 0)
        assert [watch.lost_total for watch in cycle.watches] == [0, 0]
        asked, told = (
            [at_ns // MS for at_ns, frame in log if frame.cob_id in ids] for ids in (ASKED, TOLD)
        )
        assert len(asked) == pytest.approx(100, abs=2)
        # Question and answer lie within one period, so that SYNC finds the wire free.
        assert asked == told


def test_a_question_leaves_so_early_that_its_answer_holds_up_sync_no_longer_than_a_heartbeat() -> (
    None
):
    # 1000 us, and 65 us by which a heartbeat may hold up SYNC, without question and answer of
    # 135 us each, a heartbeat of 65 us in front of either, and 250 us.
    assert latest_request_us(config()) == 415
    # Twice the time, or bits that take twice as long.
    assert latest_request_us(config(period_us=2000)) == 1415
    assert latest_request_us(config(period_us=2000, bitrate=500_000)) == 2000 - 2 * 335 - 460
    # Commands take longer than a drive that answers at once.
    assert latest_request_us(config(reply_delay_us=10)) == 1000 - 335 - 230


def answered(at_us: int) -> Answers:
    return ((240 * US, 0x181, DATA), (at_us * US, 0x182, DATA))


def test_a_question_waits_for_a_cycle_with_room() -> None:
    wire = Wire()
    wire.answers = lambda number: answered(416 if number < 207 else 415)
    it = cycle(wire, warm())
    for _ in range(220):
        it.tick()
        it.send((0, 0))
    assert wire.when(0x602) == [wire.when(0x080)[207] + 415 * US]
    assert wire.when(0x601) == [wire.when(0x080)[208] + 415 * US]


def test_one_question_is_asked_at_a_time() -> None:
    wire = Wire()
    wire.answers = lambda number: answered(350 if number >= 5 else 600)
    quick = config(period_us=4000)
    it = cycle(wire, warm(period_us=4000, tpdo_deadline_us=quick.deadline_us))
    for _ in range(120):
        it.tick()
        it.send((0, 0))
    questions = sorted(wire.when(0x601) + wire.when(0x602))
    assert len(questions) >= 4
    assert len({at_ns // (4 * MS) for at_ns in questions}) == len(questions)


def test_a_question_that_finds_no_room_for_long_is_asked_all_the_same() -> None:
    wire = Wire()
    wire.answers = lambda number: answered(600)
    it = cycle(wire, warm())
    for _ in range(200 + PATIENCE_MS):
        it.tick()
        it.send((0, 0))
    # They became due in cycles 199 and 200, the first of which has number 1.
    syncs = wire.when(0x080)
    assert wire.when(0x602) == [syncs[198 + PATIENCE_MS] + 600 * US]
    assert wire.when(0x601) == [syncs[199 + PATIENCE_MS] + 600 * US]


def test_nothing_is_asked_in_a_cycle_without_all_answers_or_in_a_stop() -> None:
    wire = Wire()
    wire.answers = lambda number: BOTH[:1]
    it = cycle(wire, warm())
    for _ in range(400):
        it.tick()
    wire.answers = lambda number: BOTH
    it.stopping = True
    for _ in range(200):
        it.tick()
    assert wire.when(0x601) == wire.when(0x602) == []


def test_a_question_after_a_late_sync_waits_for_the_next_one() -> None:
    wire = Wire()
    wire.answers = lambda number: answered(415)
    it = cycle(wire, warm())
    for number in range(210):
        if number in (198, 199):  # The requests become due in these cycles.
            wire.wait_until(wire.when(0x080)[-1] + 1200 * US)
        it.tick()
        it.send((0, 0))
    syncs = wire.when(0x080)
    assert [at_ns % MS for at_ns in syncs[197:201]] == [0, 200 * US, 400 * US, 0]
    assert wire.when(0x602) == [syncs[200] + 415 * US]
    assert wire.when(0x601) == [syncs[201] + 415 * US]
