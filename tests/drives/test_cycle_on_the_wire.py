"""The cycle as the wire shows it: what goes out when and to whom, what is made of answers."""

import itertools
from dataclasses import replace
from pathlib import Path

import pytest
from drives_rig import LIMITS, MS, START, Rig, config, node, rig

from legbench.drives.emulated.faults import FrameFault, FrameFaultKind
from legbench.drives.protocol.datatypes import DataType
from legbench.drives.protocol.frame import Frame
from legbench.drives.protocol.pdo import Mapped
from legbench.drives.setup.config import BusConfig
from legbench.errors import PlantFault

TEMPERATURE = Mapped(0x2070, 0, DataType.INTEGER16)
ASK = bytes.fromhex("4070200000000000")


def warm(**changes: object) -> BusConfig:
    """A bus whose drives report their temperature."""
    nodes = tuple(replace(node(place), temperature_object=TEMPERATURE) for place in (0, 1))
    return config(nodes=nodes, **changes)


def times(it: Rig, frame: Frame, since_ns: int = 0) -> list[int]:
    """When a frame was on the wire [ns]."""
    return [at for at, other in it.network.log or [] if other == frame and at >= since_ns]


def apart(moments: list[int]) -> set[int]:
    """Distances of what follows each other, to the millisecond [ms]."""
    return {round((b - a) / MS) for a, b in itertools.pairwise(moments)}


def test_each_drive_is_asked_for_its_temperature_every_200_cycles(tmp_path: Path) -> None:
    with rig(tmp_path, bus_config=warm()) as it:
        it.link.start()
        begin_ns = it.network.now_ns
        it.run(1000)
        asked = {place: times(it, Frame(0x601 + place, ASK), begin_ns) for place in (0, 1)}
        assert [len(moments) for moments in asked.values()] == [5, 5]
        # Due every 200 cycles, and asked in the first one after that with room for the answer.
        assert all(abs(gap - 200) < 30 for gap in apart(asked[0]) | apart(asked[1]))
        # Never in one cycle: the frames of a cycle leave room for one question.
        assert not {at // MS for at in asked[0]} & {at // MS for at in asked[1]}
        for place, warmth in ((0, 312), (1, 418)):
            it.network.drives[place]._values[0x2070, 0] = warmth
        it.run(250)
        assert it.link.exchange().temperature == pytest.approx((31.2, 41.8))


@pytest.mark.parametrize("place", [0, 1])
def test_either_drive_that_is_too_hot_ends_the_run(tmp_path: Path, place: int) -> None:
    limits = replace(LIMITS, temperature=60.0)
    with rig(tmp_path, bus_config=warm(), limits=limits) as it:
        it.link.start()
        it.network.drives[place]._values[0x2070, 0] = 600
        it.run(401)
        it.network.drives[place]._values[0x2070, 0] = 601
        with pytest.raises(PlantFault, match=rf"drive {place + 1} is at 60\.1 deg C"):
            it.run(401)


@pytest.mark.parametrize(("period_us", "beat_ms"), [(1000, 20), (1000, 15), (2000, 30)])
def test_sync_and_the_masters_heartbeat_keep_their_periods(
    tmp_path: Path, period_us: int, beat_ms: int
) -> None:
    chosen = config(period_us=period_us, master_heartbeat_ms=beat_ms)
    with rig(tmp_path, bus_config=chosen) as it:
        it.link.start()
        begin_ns = it.network.now_ns
        it.run(300)
        syncs = times(it, Frame(0x080), begin_ns)
        # A heartbeat that is on the wire already may hold one up: 65 us.
        late = {b - a - 1000 * period_us for a, b in itertools.pairwise(syncs)}
        assert max(map(abs, late)) <= 65_000
        assert len(syncs) == pytest.approx(300, abs=1)
        beats = times(it, Frame(0x700 + chosen.master_id, b"\x05"), begin_ns)
        assert len(beats) == pytest.approx(300 * period_us / (1000 * beat_ms), abs=1)
        assert apart(beats) == {beat_ms}


def test_every_cycle_has_sync_both_answers_and_both_commands_in_this_order(
    tmp_path: Path,
) -> None:
    with rig(tmp_path) as it:
        it.link.start()
        begin_ns = it.network.now_ns
        it.run(100)
        kinds = (0x080, 0x181, 0x182, 0x201, 0x202)
        seen = [f.cob_id for at, f in it.network.log or [] if at > begin_ns and f.cob_id in kinds]
        cycles = "".join(map(str, (kinds.index(cob_id) for cob_id in seen))).split("0")
        # Between two SYNCs: the answers in the order in which they came, then the commands.
        assert set(cycles[1:-1]) <= {"1234", "2134"}
        assert len(cycles) > 95


def test_a_controller_that_leaves_the_bus_ends_the_run_other_errors_are_counted(
    tmp_path: Path,
) -> None:
    with rig(tmp_path) as it:
        it.link.start()
        for count in range(1, 4):
            it.bus.inject(Frame(0x88, bytes(8), error=True))
            it.run(2)
            assert it.link.cycle.error_frames == count
        it.bus.inject(Frame(0x40, bytes(8), error=True))
        with pytest.raises(PlantFault, match="has left the bus") as caught:
            it.run(2)
        assert caught.value.cause == "bus off"
        it.network.advance(it.network.now_ns + 100 * MS)
        assert "operation enabled" not in [state.value for state in it.states]


@pytest.mark.parametrize("place", [0, 1])
def test_an_emergency_of_either_drive_ends_the_run_and_is_that_drives(
    tmp_path: Path, place: int
) -> None:
    with rig(tmp_path) as it:
        it.link.start()
        it.bus.inject(Frame(0x081 + place, bytes.fromhex("0073010000000000")))
        with pytest.raises(PlantFault) as caught:
            it.run(2)
        assert caught.value.cause == "drive emergency"
        name = ("hip", "knee")[place]
        assert str(caught.value).startswith(f"drive '{name}' (node {place + 1}): EMCY 7300h")
        assert [len(watch.history) for watch in it.link.cycle.watches] == [1 - place, place]


@pytest.mark.parametrize("place", [0, 1])
def test_lost_answers_are_counted_for_the_drive_that_lost_them(tmp_path: Path, place: int) -> None:
    with rig(tmp_path) as it:
        it.link.start()
        # From one SYNC to the next: exactly one answer of each drive lies between them.
        now_ns = it.network.now_ns // MS * MS
        it.network.inject(
            FrameFault(
                kind=FrameFaultKind.WRONG_LENGTH,
                cob_id=0x181 + place,
                length=3,
                start_ns=now_ns + 10 * MS,
                end_ns=now_ns + 11 * MS,
            )
        )
        fresh = []
        for _ in range(30):
            it.link.command(START)
            fresh.append(it.link.exchange().fresh)
        assert [sum(not seen[axis] for seen in fresh) for axis in (0, 1)] == [1 - place, place]
        watches = it.link.cycle.watches
        assert [watch.lost_total for watch in watches] == [1 - place, place]
        assert [watch.bad_total for watch in watches] == [1 - place, place]
        # A frame that was garbled has come: nothing is owed, and no tick is silent for it.
        assert it.link.cycle.silent_total == 0
