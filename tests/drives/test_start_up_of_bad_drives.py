"""The way to operation enabled with drives that disobey, are slow or show their state late."""

import itertools
from pathlib import Path
from typing import Any

import pytest
from drives_rig import MS, START, Rig, config, rig

from legbench.drives.emulated.behaviour import Behaviour
from legbench.drives.emulated.faults import FrameFault, FrameFaultKind
from legbench.drives.errors import DriveError
from legbench.drives.master.link import LinkState
from legbench.drives.protocol.cia402 import DriveState, Goal
from legbench.errors import PlantFault

OE, SOD = DriveState.OPERATION_ENABLED, DriveState.SWITCH_ON_DISABLED
NAMES = ("hip", "knee")


def pair(place: int, **odd: Any) -> list[Behaviour]:
    """Two drives, one of them odd."""
    made = [Behaviour(start_pos=pos, seed=3) for pos in START]
    made[place] = Behaviour(start_pos=START[place], seed=3, **odd)
    return made


def runs(it: Rig, node_id: int) -> list[tuple[int, int]]:
    """Controlwords of a drive and for how many cycles each stood."""
    words = [word for _, sender, word in it.words() if sender == node_id]
    return [(word, len(list(group))) for word, group in itertools.groupby(words)]


def shown(it: Rig, node_id: int) -> list[int]:
    """Low bytes of the statuswords that a drive has put on the wire, one a cycle."""
    return [
        frame.data[0] & 0x6F for _, frame in it.network.log or [] if frame.cob_id == 0x180 + node_id
    ]


ENABLED = 0x27


@pytest.mark.parametrize(
    ("place", "deaf", "left"),
    [(0, 0x06, "switch on disabled"), (1, 0x07, "ready to switch on")],
)
def test_a_drive_that_does_not_switch_on_is_named_and_the_other_one_is_not_enabled(
    tmp_path: Path, place: int, deaf: int, left: str
) -> None:
    with rig(tmp_path, behaviours=pair(place, ignores=frozenset({deaf}))) as it:
        words = rf"drive '{NAMES[place]}' \(node {place + 1}\) does not become enabled: .*{left}"
        with pytest.raises(DriveError, match=words):
            it.link.start()
        # Two seconds of cycles, after the hundred in which process data settle.
        assert 2000 <= it.network.now_ns // MS - 150 <= 2250
        assert it.link.state is LinkState.STOPPED
        assert it.states == [SOD, SOD]
        for node_id in (1, 2):
            assert ENABLED not in shown(it, node_id)
            assert 0x0F not in [word for word, _ in runs(it, node_id)]


@pytest.mark.parametrize("spread_ms", [None, 1, 20, 500])
@pytest.mark.parametrize("place", [0, 1])
def test_a_drive_is_never_enabled_alone_for_longer_than_the_bus_file_says(
    tmp_path: Path, place: int, spread_ms: int | None
) -> None:
    """By default for 100 ms; both are stopped in the same cycle then, and the slow one is named."""
    bus = config() if spread_ms is None else config(enable_spread_ms=spread_ms)
    limit = spread_ms or 100
    behaviours = pair(place, ignores=frozenset({0x0F}))
    with rig(tmp_path, bus_config=bus, behaviours=behaviours) as it:
        with pytest.raises(PlantFault) as caught:
            it.link.start()
        assert caught.value.cause == "drive not enabled"
        assert str(caught.value).startswith(
            f"drive '{NAMES[place]}' (node {place + 1}) is not enabled {limit} ms after the other "
            "one: 0233h: switched on, voltage enabled"
        )
        assert it.states == [SOD, SOD]
        assert ENABLED not in shown(it, place + 1)
        # The cycles in which it was shown, and one or two for the quick stop to act.
        alone = shown(it, 2 - place).count(ENABLED)
        assert limit <= alone <= limit + 3
        stops = {at for at, _, word in it.words() if word == 0x02}
        first = min(stops)
        assert {
            node_id for at, node_id, word in it.words() if word == 0x02 and at < first + MS
        } == {
            1,
            2,
        }


@pytest.mark.parametrize("lag_ms", [1, 4, 10])
@pytest.mark.parametrize("place", [0, 1])
def test_a_state_that_is_shown_late_is_waited_for_rung_by_rung(
    tmp_path: Path, place: int, lag_ms: int
) -> None:
    with rig(tmp_path, behaviours=pair(place, status_lag_us=1000 * lag_ms)) as it:
        sample = it.link.start()
        assert it.states == [OE, OE]
        assert sample.motor_pos == pytest.approx(START, abs=1e-5)
        said = runs(it, place + 1)
        assert [word for word, _ in said] == [0x00, 0x06, 0x07, 0x0F]
        assert all(length > lag_ms for _, length in said[:3])
        assert [word for word, _ in runs(it, 2 - place)] == [0x00, 0x06, 0x07, 0x0F]
        it.run(50)
        assert it.states == [OE, OE]


def test_a_fault_reset_that_is_not_heard_is_refused_and_nothing_is_enabled(
    tmp_path: Path,
) -> None:
    for place in (0, 1):
        behaviours = pair(place, ignores=frozenset({0x80}))
        with rig(tmp_path, behaviours=behaviours) as it:
            it.link.open()
            it.network.drives[place].trip(0x3220, it.network.now_ns)
            it.network.drives[place].clear_trip(0x3220)
            words = f"drive '{NAMES[place]}' .* does not leave its fault, whose cause still stands"
            with pytest.raises(DriveError, match=words):
                it.link.start(clear_faults=True)
            assert it.states[place] is DriveState.FAULT
            assert OE not in it.states
            assert 0x0F not in [word for _, _, word in it.words()]


@pytest.mark.parametrize("place", [0, 1])
def test_after_a_reset_the_drive_rests_before_both_are_enabled(tmp_path: Path, place: int) -> None:
    with rig(tmp_path) as it:
        it.link.open()
        it.network.drives[place].trip(0x3220, it.network.now_ns)
        it.network.drives[place].clear_trip(0x3220)
        it.link.start(clear_faults=True)
        assert it.states == [OE, OE]
        said = [word for word, _ in runs(it, place + 1)]
        assert said == [0x00, 0x80, 0x00, 0x06, 0x07, 0x0F]


@pytest.mark.parametrize("cycles", [5, 40])
def test_process_data_must_be_regular_for_so_many_cycles_in_a_row(
    tmp_path: Path, cycles: int
) -> None:
    chosen = config(settle_cycles=cycles)
    with rig(tmp_path, bus_config=chosen) as it:
        it.link.open()
        begin_ns = it.network.now_ns
        # One answer is lost in the middle: the count begins anew.
        it.network.inject(
            FrameFault(
                kind=FrameFaultKind.DROP,
                cob_id=0x182,
                start_ns=begin_ns + 4 * MS,
                end_ns=begin_ns + 5 * MS,
            )
        )
        it.link.start()
        log = it.network.log or []
        first_up = next(at for at, _, word in it.words() if word == 0x06)
        lost = [at for at, frame in log if frame.cob_id == 0x182]
        assert first_up - begin_ns >= (4 + cycles) * MS
        assert first_up - begin_ns <= (4 + cycles + 8) * MS
        assert lost


def test_drives_without_regular_data_are_named_after_2000_cycles(tmp_path: Path) -> None:
    with rig(tmp_path) as it:
        it.link.open()
        begin_ns = it.network.now_ns
        it.network.inject(FrameFault(kind=FrameFaultKind.DROP, cob_id=0x182))
        words = "no regular process data within 2000 ms; missing: knee; look at"
        with pytest.raises(DriveError, match=words):
            it.link.start()
        # With an answer owed every other tick is silent; the stop has its own cycles.
        assert 4000 * MS <= it.network.now_ns - begin_ns <= 4100 * MS
        assert OE not in it.states
        assert {word for _, _, word in it.words()} <= {0x00, 0x02}


def test_a_goal_is_sought_by_those_drives_alone_that_are_asked(tmp_path: Path) -> None:
    with rig(tmp_path) as it:
        it.link.start()
        start_up, cycle = it.link._start_up, it.link.cycle
        start_up.seek(Goal.DISABLED, cycle.axes[1:], cycle.tick, "rest")
        assert it.states == [OE, SOD]
