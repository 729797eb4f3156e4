"""The stop over SDO, write by write on the wire, with two drives that show what a test says."""

import itertools
from typing import Any, cast

import pytest
from drives_rig import MS, node
from sdo_wire import ASK, Wire, always, pair, until

from legbench.drives.errors import BusError
from legbench.drives.master.sdo_stop import leave_operational
from legbench.drives.master.stop_report import StopReport
from legbench.drives.protocol.frame import Frame

ENABLED, BRAKING, OFF, UNKNOWN = 0x1237, 0x0217, 0x0250, 0x0201
QUICK = bytes.fromhex("2B40600002000000")
DISABLE = bytes.fromhex("2B40600000000000")
BEAT = Frame(0x77E, b"\x05")
NAMES = ("hip", "knee")


def test_all_drives_are_told_before_any_is_waited_for_and_no_voltage_comes_last() -> None:
    wire = Wire(always(OFF), always(OFF))
    report, held = wire.stop()
    assert report == StopReport()
    assert not held
    assert [(cob_id, data) for _, cob_id, data in wire.log] == [
        (0x601, QUICK),
        (0x602, QUICK),
        (0x601, ASK),
        (0x602, ASK),
        (0x601, DISABLE),
        (0x602, DISABLE),
    ]
    # The first look is 5 ms later.
    assert [at for at, _, data in wire.log if data == ASK] == [5 * MS, 5 * MS + MS // 5]


@pytest.mark.parametrize("place", [0, 1])
@pytest.mark.parametrize("shown", [ENABLED, BRAKING, UNKNOWN])
def test_a_ramp_is_waited_for_35_ms_and_power_looked_at_for_250(place: int, shown: int) -> None:
    wire = Wire(*pair(place, always(shown), always(OFF)))
    report, _ = wire.stop()
    quick, disable = wire.told(place, QUICK), wire.told(place, DISABLE)
    assert quick[-1] < 35 * MS <= disable[0] < 35 * MS + 6 * MS
    # Told anew after each look, every 5 ms.
    assert len(quick) == 7
    assert {round((b - a) / MS) for a, b in itertools.pairwise(quick)} == {5}
    assert 245 * MS < wire.time_ns < 256 * MS
    assert disable[-1] == wire.time_ns
    # The other one is told quick stop once, looked at once, and cut off with the last word.
    assert len(wire.told(1 - place, QUICK)) == len(wire.told(1 - place, ASK)) == 1
    assert wire.told(1 - place, DISABLE) == [wire.time_ns]
    assert (report.powered, report.silent) == ((NAMES[place],), ())
    assert report.cut_off == (NAMES[place],)
    assert report.states[0].startswith(f"{shown:04X}h: ")


@pytest.mark.parametrize("place", [0, 1])
def test_a_drive_is_cut_off_if_its_ramp_lasts_longer_and_not_if_it_is_shorter(place: int) -> None:
    for ramp_ms, cut_off in ((20, ()), (60, (NAMES[place],))):
        wire = Wire(*pair(place, until(ramp_ms * MS, BRAKING, OFF), always(OFF)))
        report, _ = wire.stop()
        assert report == StopReport(cut_off=cut_off)
        assert ramp_ms * MS <= wire.time_ns <= (ramp_ms + 6) * MS
        assert bool(wire.told(place, DISABLE)[:-1]) is bool(cut_off)


@pytest.mark.parametrize("place", [0, 1])
def test_a_drive_that_does_not_answer_holds_up_no_other_by_more_than_20_ms(place: int) -> None:
    wire = Wire(*pair(place, always(None), until(30 * MS, BRAKING, OFF)))
    report, held = wire.stop()
    asked = wire.told(place, ASK)
    assert {b - a for a, b in itertools.pairwise(asked)} <= {
        25 * MS,
        25 * MS + MS // 5,
    }
    assert (report.powered, report.silent, report.cut_off) == ((), (NAMES[place],), ())
    assert not report.verified
    assert set(held) == {"NoAnswerError"}
    assert len(report.errors) == 1
    assert report.errors[0].startswith(f"NoAnswerError: node {place + 1} on wire does not answer")
    assert wire.told(place, DISABLE)
    # 250 ms, and the look that was going on.
    assert 250 * MS < wire.time_ns < 280 * MS


def test_a_bus_that_takes_nothing_is_given_up_after_three_rounds() -> None:
    wire = Wire(always(ENABLED), always(ENABLED))
    wire.fails = lambda cob_id, data: BusError("full")
    report, held = wire.stop()
    assert not wire.log
    assert report.silent == NAMES
    assert report.errors == ("BusError: full",)
    assert set(held) == {"BusError"}
    # Every word is tried twice for both: three rounds, and the last word; a look after the first
    # three, each with a rest of 5 ms.
    assert wire.refused == 4 * 2 * 2 + 3 * 2
    assert wire.time_ns == 3 * 5 * MS


def test_a_bus_that_takes_a_frame_now_and_then_is_not_given_up() -> None:
    for deaf in (0, 1):
        wire = Wire(until(60 * MS, BRAKING, OFF), until(60 * MS, BRAKING, OFF))

        def fails(cob_id: int, data: bytes, _deaf: int = deaf) -> BaseException | None:
            return BusError("full") if (cob_id, data[0]) == (0x601 + _deaf, 0x2B) else None

        wire.fails = fails
        report, _ = wire.stop()
        assert not report.powered
        assert not report.silent
        assert len(wire.told(1 - deaf, QUICK)) == 7
        assert not wire.told(deaf, QUICK)


def test_two_rounds_that_the_bus_refuses_are_no_reason_to_give_up() -> None:
    wire = Wire(until(30 * MS, BRAKING, OFF), until(30 * MS, BRAKING, OFF))

    def fails(cob_id: int, data: bytes) -> BaseException | None:
        return BusError("full") if data[0] == 0x2B and 4 * MS < wire.time_ns < 12 * MS else None

    wire.fails = fails
    report, held = wire.stop()
    assert report == StopReport(errors=("BusError: full",))
    # Two rounds, two drives, each tried twice.
    assert held == ["BusError"] * 8


def test_a_clock_that_stands_still_ends_the_looks_after_as_many_as_fit() -> None:
    wire = Wire(always(ENABLED), always(ENABLED))

    def stands(at_ns: int) -> None:
        raise KeyboardInterrupt

    wire.wait_until = stands
    wire.receive = lambda until_ns: wire.answers.pop(0)
    report, held = wire.stop()
    assert wire.time_ns == 0
    # 250 ms at one look every 5 ms.
    assert len(wire.told(0, ASK)) == len(wire.told(1, ASK)) == 50
    assert held == ["KeyboardInterrupt"] * 50
    assert report.powered == NAMES


@pytest.mark.parametrize("place", [0, 1])
def test_a_drive_that_shows_nothing_but_zeros_is_not_ready_and_has_no_power(place: int) -> None:
    wire = Wire(*pair(place, always(0x0000), always(OFF)))
    assert wire.stop()[0] == StopReport()
    assert len(wire.told(place, ASK)) == 1
    wire = Wire(*pair(place, until(60 * MS, BRAKING, 0x0000), always(OFF)))
    assert wire.stop()[0] == StopReport(cut_off=(NAMES[place],))


def test_at_35_ms_the_ramp_is_over() -> None:
    wire = Wire(always(BRAKING), always(BRAKING))
    # Two answers and the rest are 35 ms, to the nanosecond.
    wire.stop(rest_ns=35 * MS - 2 * (MS // 5))
    for place in (0, 1):
        assert wire.told(place, QUICK) == [0]
        assert wire.told(place, DISABLE)[0] == 35 * MS


def test_what_is_raised_once_keeps_no_word_from_a_drive() -> None:
    for what in (KeyboardInterrupt(), BusError("full")):
        for at in range(6):
            count = 0
            wire = Wire(until(12 * MS, BRAKING, OFF), until(12 * MS, BRAKING, OFF))

            def once(
                cob_id: int, data: bytes, _at: int = at, _what: BaseException = what
            ) -> BaseException | None:
                nonlocal count
                count += 1
                return _what if count - 1 == _at else None

            wire.fails = once
            report, held = wire.stop()
            assert report.verified
            assert held == [type(what).__name__]
            assert report.errors == (f"{type(what).__name__}: {what}".rstrip(": "),)
            assert len(wire.told(0, QUICK)) == len(wire.told(1, QUICK)) == 3
            assert len(wire.told(0, DISABLE)) == len(wire.told(1, DISABLE)) == 1


def test_the_masters_heartbeat_goes_on_and_the_rest_is_as_long_as_asked_for() -> None:
    wire = Wire(until(20 * MS, BRAKING, OFF), always(OFF))
    wire.stop(beat=BEAT, rest_ns=2 * MS)
    beats = [at for at, cob_id, data in wire.log if (cob_id, data) == (0x77E, b"\x05")]
    assert len(beats) == len(wire.told(0, ASK)) == 10
    assert all(2 * MS <= b - a <= 3 * MS for a, b in itertools.pairwise(beats))


# --- out of operational ----------------------------------------------------------------------


def left_operational(
    wire: Wire, stopped: StopReport | None, *raises: BaseException
) -> tuple[int, StopReport | None, list[str]]:
    """How often the order was tried, the report, and what was held."""
    orders, held, ahead = 0, list[str](), list(raises)

    def order() -> None:
        nonlocal orders
        orders += 1
        if ahead:
            raise ahead.pop(0)

    nodes = [node(0), node(1)]
    report = leave_operational(
        order, cast(Any, wire), nodes, stopped, lambda error: held.append(type(error).__name__)
    )
    return orders, report, held


def test_a_verified_stop_is_not_repeated_and_the_order_goes_out_once() -> None:
    for stopped in (None, StopReport(cut_off=("hip",))):
        wire = Wire(always(OFF), always(OFF))
        assert left_operational(wire, stopped) == (1, None, [])
        assert not wire.log


def test_the_order_is_repeated_once_unless_it_is_the_bus_that_failed() -> None:
    wire = Wire(always(OFF), always(OFF))
    assert left_operational(wire, None, KeyboardInterrupt()) == (2, None, ["KeyboardInterrupt"])
    assert left_operational(wire, None, ValueError(), ValueError())[0] == 2
    assert left_operational(wire, None, BusError("full")) == (1, None, [])


@pytest.mark.parametrize("place", [0, 1])
def test_a_drive_that_was_not_seen_without_power_is_told_again_and_no_other(place: int) -> None:
    name = NAMES[place]
    for before in (
        StopReport(powered=(name,), states=("0217h: quick stop active",), cut_off=(name,)),
        StopReport(silent=(name,), errors=("BusError: full",)),
    ):
        wire = Wire(always(OFF), always(OFF))
        orders, report, _ = left_operational(wire, before)
        assert orders == 1
        assert report == StopReport(cut_off=before.cut_off, errors=before.errors)
        assert wire.told(place, QUICK)
        assert not wire.told(1 - place, QUICK)
