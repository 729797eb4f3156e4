"""Emulated drives that wear a data sheet: they have what it tells, and run with what they lack."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import can
import pytest
from drives_rig import LIMITS, MS, START, rig
from eds_texts import Sheet, stranger
from test_data_sheet_judging import bus_of
from test_drives_master_watch import STEADY, moving, standstill_ms

from legbench.drives.emulated.build import emulate
from legbench.drives.emulated.bus import LockstepBus
from legbench.drives.emulated.dictionary import dictionary_of
from legbench.drives.errors import DriveError, SdoAbortError
from legbench.drives.master.sdo_port import SdoPort
from legbench.drives.master.session import Session
from legbench.drives.protocol.cia402 import DriveState
from legbench.drives.protocol.datatypes import DataType
from legbench.drives.protocol.objects import OBJECTS
from legbench.drives.protocol.sdo import Abort
from legbench.drives.setup.config import BusConfig
from legbench.drives.setup.master_watch import LONGEST_STOP_MS
from legbench.errors import ConfigError

U16, U32 = DataType.UNSIGNED16, DataType.UNSIGNED32


def worn(folder: Path, sheet: Sheet) -> BusConfig:
    path = folder / "it.eds"
    path.write_text(sheet.text(), encoding="utf-8")
    # Two answers of each drive take more than 1 ms at worst.
    return replace(bus_of(path), period_us=2000)


def asked(bus: BusConfig, question: Callable[[SdoPort], object]) -> object:
    """What the second drive answers."""
    with Session(LockstepBus("it", network=emulate(bus)), bus) as session:
        return question(session.bring_up().sdo(bus.nodes[1]))


def refusal(bus: BusConfig, question: Callable[[SdoPort], object]) -> int:
    with pytest.raises(SdoAbortError) as caught:
        asked(bus, question)
    return caught.value.code


def test_objects_are_as_the_sheet_tells(tmp_path: Path) -> None:
    sheet = stranger().without(0x1016, (0x1400, 5)).fixed({(0x6065, 0): "77"})
    sheet.entries[0x6085, 0].limits = ("10", "0x1000")
    sheet.add((0x2001, 0), 0x08, default="1.5").add((0x2002, 0), U16, "wo", default="3")
    bus = worn(tmp_path, sheet)
    assert refusal(bus, lambda it: it.read(0x1016, 1)) == Abort.NO_OBJECT
    assert refusal(bus, lambda it: it.put(0x1400, 5, U16, 1)) == Abort.NO_SUB_INDEX
    assert refusal(bus, lambda it: it.read(0x2064, 0)) == Abort.NO_OBJECT
    assert refusal(bus, lambda it: it.put(0x6065, 0, U32, 1)) == Abort.READ_ONLY
    assert refusal(bus, lambda it: it.put(0x6085, 0, U32, 9)) == Abort.TOO_LOW
    assert refusal(bus, lambda it: it.put(0x6085, 0, U32, 0x1001)) == Abort.TOO_HIGH
    assert refusal(bus, lambda it: it.write(0x6085, 0, b"\x14\0")) == Abort.TOO_SHORT
    assert refusal(bus, lambda it: it.read(0x2002, 0)) == Abort.WRITE_ONLY
    assert asked(bus, lambda it: it.get_int(0x6065, 0, U32)) == 77
    assert asked(bus, lambda it: it.read(0x2001, 0)) == b"\x00\x00\xc0\x3f"
    assert asked(bus, lambda it: it.get_int(0x1014, 0, U32)) == 0x82
    assert asked(bus, lambda it: it.get_int(0x1801, 1, U32)) == 0x80000282
    # The identity is that of the bus file, not of the sheet: two drives of a kind differ.
    assert asked(bus, lambda it: it.get_int(0x1018, 4, U32)) == 101
    assert asked(bus, lambda it: it.get_int(0x1018, 1, U32)) == 0x1234


def test_a_drive_without_a_sheet_is_the_usual_one() -> None:
    node = bus_of(Path("it.eds")).nodes[0]
    entries = {entry.key: entry for entry in dictionary_of(replace(node, eds=None)).entries}
    assert set(entries) == set(OBJECTS)
    assert entries[0x1402, 1].default == 0x80000401
    assert entries[0x1018, 4].default == 100


def test_an_object_of_another_size_shows_what_fits_it(tmp_path: Path) -> None:
    sheet = stranger().add((0x606C, 0), DataType.INTEGER16).add((0x60F4, 0), 0x08, default="0.0")
    bus = worn(tmp_path, sheet)
    with rig(tmp_path, bus_config=bus) as it:
        it.link.start()
        it.network.drives[0]._values[0x606C, 0] = 70_000
        sdo = it.link.bring_up.sdo(bus.nodes[0])
        assert sdo.get_int(0x606C, 0, DataType.INTEGER16) == 70_000 - 65_536
        assert sdo.read(0x60F4, 0) == bytes(4)


RUNS: dict[str, tuple[Callable[[Sheet], object], tuple[str, ...]]] = {
    "complete": (lambda it: it, ()),
    "no heartbeat consumer, no SYNC period": (lambda it: it.without(0x1016, 0x1006), ()),
    "no deadline, no heartbeat": (lambda it: it.without((0x1400, 5), 0x1017), ()),
    "no interpolation, no offsets": (lambda it: it.without(0x60C2, 0x60B0, 0x60B1, 0x60B2), ()),
    "no options but the reaction": (
        lambda it: it.without(0x605A, 0x605B, 0x605C, 0x605D, 0x605E, 0x1029),
        (),
    ),
    "stays in quick stop": (lambda it: it.fixed({(0x605A, 0): "6"}), ()),
    "two PDOs each way": (
        lambda it: it.without(
            *(base + place for base in (0x1400, 0x1600, 0x1800, 0x1A00) for place in (2, 3))
        ),
        (),
    ),
    "no reaction": (lambda it: it.without(0x6007), ("master watch",)),
    "mode is fixed": (lambda it: it.without(0x6060), ()),
}


@pytest.mark.parametrize("name", list(RUNS))
def test_worn_drives_run_stop_and_outlive_their_master(name: str, tmp_path: Path) -> None:
    quirk, waive = RUNS[name]
    sheet = stranger()
    quirk(sheet)
    bus = replace(worn(tmp_path, sheet), waive=waive)
    limits = replace(LIMITS, command_speed=5.0, lost_frames=20)
    (tmp_path / "stop").mkdir()
    with rig(tmp_path / "stop", bus_config=bus, limits=limits) as it:
        it.link.start()
        assert it.states == [DriveState.OPERATION_ENABLED] * 2
        moving(it, 40)
        assert it.link.fault is None
        assert abs(it.angles[0] - START[0]) > 0.1
        it.link.stop()
        assert all(state is not DriveState.OPERATION_ENABLED for state in it.states)
        assert all(state is not DriveState.QUICK_STOP_ACTIVE for state in it.states)
    (tmp_path / "death").mkdir()
    with rig(tmp_path / "death", bus_config=bus, limits=limits, behaviours=STEADY) as it:
        it.link.start()
        moving(it, 40)
        if name == "stays in quick stop":  # It stands, and keeps its power.
            it.network.advance(it.network.now_ns + round(LONGEST_STOP_MS) * MS)
            stood = it.angles
            it.network.advance(it.network.now_ns + 50 * MS)
            assert it.angles == stood
            assert it.states == [DriveState.QUICK_STOP_ACTIVE] * 2
        else:
            assert standstill_ms(it.network, 300) <= LONGEST_STOP_MS


def test_a_leg_on_drives_that_nothing_stops_is_refused(tmp_path: Path) -> None:
    bus = worn(tmp_path, stranger().without(0x6007))
    with (
        rig(tmp_path, bus_config=bus) as it,
        pytest.raises(DriveError, match=r"'hip' would not stand within 100 ms .* 6007h:00"),
    ):
        it.link.open()
    assert all(state is not DriveState.OPERATION_ENABLED for state in it.states)


def test_process_data_beyond_the_fourth_can_be_used(tmp_path: Path) -> None:
    sheet = stranger()
    for base in (0x1800, 0x1A00):
        for (index, sub), entry in list(sheet.entries.items()):
            if index == base + 1:
                sheet.entries[base + 5, sub] = entry
    bus = worn(tmp_path, sheet)
    nodes = tuple(
        replace(one, tpdos=(one.tpdos[0], replace(one.tpdos[1], number=6, cob_id=0x4F0 + place)))
        for place, one in enumerate(bus.nodes)
    )
    with rig(tmp_path, bus_config=replace(bus, nodes=nodes)) as it:
        it.link.start()
        it.run(20)
        assert it.link.fault is None
        assert {0x4F0, 0x4F1} <= {frame.cob_id for _, frame in it.network.log or []}


def test_a_sheet_that_is_not_there_is_named(tmp_path: Path) -> None:
    bus = bus_of(tmp_path / "gone.eds")
    with pytest.raises(ConfigError, match=r"gone\.eds: no such file"):
        emulate(bus)
    path = tmp_path / "leg.toml"
    bench = Path(__file__).parents[2] / "hardware" / "leg.toml"
    path.write_text('eds = "gone.eds"\n' + bench.read_text(encoding="utf-8"), encoding="utf-8")
    with pytest.raises(can.CanInitializationError, match=r"gone\.eds: no such file"):
        LockstepBus(str(path))
