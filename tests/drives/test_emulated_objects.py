"""Objects, process data and timers of an emulated drive, each at both sides of its edge."""

import itertools

import pytest
from drive_bench import OE, SOD, Bench, counts
from drives_rig import MS

from legbench.drives.emulated.drive import OVER_TEMPERATURE, UNDER_VOLTAGE
from legbench.drives.emulated.store import ObjectStore
from legbench.drives.errors import SdoAbortError
from legbench.drives.protocol.cia402 import DriveState, decode_state
from legbench.drives.protocol.datatypes import DataType
from legbench.drives.protocol.frame import Frame
from legbench.drives.protocol.nmt import NmtCommand, NmtState, heartbeat_frame, nmt_frame
from legbench.drives.protocol.objects import Access, Key, ObjectEntry
from legbench.drives.protocol.sdo import Abort

U8, U16, I16 = DataType.UNSIGNED8, DataType.UNSIGNED16, DataType.INTEGER16
GONE = 1 << 31
"""Bit 31 of a COB-ID: the PDO does not exist."""


def refusal(bench: Bench, index: int, sub: int, value: int) -> Abort | None:
    """Why a write by SDO was refused, if it was."""
    before = bench.read(index, sub)
    try:
        bench.put(index, sub, value)
    except SdoAbortError as error:
        assert bench.read(index, sub) == before
        return Abort(error.code)
    assert bench.read(index, sub) == value
    return None


# --- the store -------------------------------------------------------------------------------


def shelf() -> tuple[ObjectStore, list[Key]]:
    written: list[Key] = []
    entries = (
        ObjectEntry(0x2000, 1, "number", I16, Access.RW, -3),
        ObjectEntry(0x2000, 2, "constant", U8, Access.CONST, 7),
        ObjectEntry(0x2001, 0, "actual", U8, Access.RO, 8),
        ObjectEntry(0x2002, 0, "secret", U16, Access.WO, 9),
        ObjectEntry(0x2003, 0, "text", DataType.VISIBLE_STRING, Access.RW, "old"),
        ObjectEntry(0x2004, 0, "even", U8, Access.RW, 0),
    )

    def check(key: Key, value: int) -> Abort | None:
        return Abort.INVALID_VALUE if key == (0x2004, 0) and value % 2 else None

    return ObjectStore(entries, check, written.append), written


def test_a_store_reads_writes_and_tells_what_was_written() -> None:
    store, written = shelf()
    assert store.read(0x2000, 1) == b"\xfd\xff"
    store.write(0x2000, 1, b"\x34\x12")
    assert store.read(0x2000, 1) == b"\x34\x12"
    store.write(0x2003, 0, b"new")
    assert store.read(0x2003, 0) == b"new"
    store.write(0x2002, 0, b"\1\2")
    assert store.values[0x2002, 0] == 0x0201
    assert written == [(0x2000, 1), (0x2002, 0)]
    store.load_defaults()
    assert (store.read(0x2000, 1), store.read(0x2003, 0)) == (b"\xfd\xff", b"old")


@pytest.mark.parametrize(
    ("index", "sub", "data", "code"),
    [
        (0x2000, 1, b"\1", Abort.TOO_SHORT),
        (0x2000, 1, b"\1\2\3", Abort.TOO_LONG),
        (0x2000, 2, b"\1", Abort.READ_ONLY),
        (0x2001, 0, b"\1", Abort.READ_ONLY),
        (0x2003, 0, b"\xff", Abort.INVALID_VALUE),
        (0x2004, 0, b"\1", Abort.INVALID_VALUE),
        (0x2004, 1, b"\1", Abort.NO_SUB_INDEX),
        (0x2005, 0, b"\1", Abort.NO_OBJECT),
    ],
)
def test_a_write_that_is_refused_changes_nothing(
    index: int, sub: int, data: bytes, code: Abort
) -> None:
    store, written = shelf()
    before = dict(store.values)
    with pytest.raises(SdoAbortError) as caught:
        store.write(index, sub, data)
    assert (caught.value.code, caught.value.index, caught.value.sub) == (code, index, sub)
    assert (store.values, written) == (before, [])


def test_what_is_write_only_or_unknown_cannot_be_read() -> None:
    store, _ = shelf()
    for index, sub, code in (
        (0x2002, 0, Abort.WRITE_ONLY),
        (0x2000, 3, Abort.NO_SUB_INDEX),
        (0x2005, 0, Abort.NO_OBJECT),
    ):
        with pytest.raises(SdoAbortError) as caught:
            store.read(index, sub)
        assert caught.value.code == code


def test_an_actual_value_beyond_its_object_is_shown_as_its_end() -> None:
    store, _ = shelf()
    for value, shown in ((40_000, 32_767), (-40_000, -32_768), (12, 12)):
        store.show((0x2000, 1), value)
        assert store.values[0x2000, 1] == shown


# --- process data ----------------------------------------------------------------------------


def test_communication_parameters_are_kept_while_a_pdo_exists() -> None:
    bench = Bench()
    # The identifier may be given again or switched off, not changed (CiA 301, 7.5.2.36).
    cases = (
        (0x1800, 1, 0x182, Abort.INVALID_VALUE),
        (0x1800, 1, 0x181, None),
        (0x1800, 3, 1, Abort.DEVICE_STATE),
        (0x1800, 5, 7, None),
        (0x1800, 1, GONE | 0x182, None),
        (0x1800, 3, 1, None),
        (0x1800, 1, 0x182, None),
    )
    for index, sub, value, code in cases:
        assert refusal(bench, index, sub, value) is code, (index, sub, value)
    for kind in range(256):
        reserved = 240 < kind < 254
        assert (refusal(bench, 0x1400, 2, kind) is Abort.INVALID_VALUE) == reserved


def test_a_mapping_is_changed_in_the_order_of_the_standard_alone() -> None:
    bench = Bench()
    # 7.5.2.36: switch off, count to 0, entries, count, switch on.
    assert refusal(bench, 0x1A00, 0, 0) is Abort.DEVICE_STATE
    assert refusal(bench, 0x1800, 1, GONE | 0x181) is None
    assert refusal(bench, 0x1A00, 1, 0x60640020) is Abort.DEVICE_STATE
    assert refusal(bench, 0x1A00, 0, 0) is None
    assert refusal(bench, 0x1A00, 1, 0x60640020) is None
    assert refusal(bench, 0x1A00, 2, 0x606C0020) is None
    assert refusal(bench, 0x1A00, 3, 0x60610008) is None
    assert refusal(bench, 0x1A00, 0, 3) is Abort.PDO_LENGTH
    assert refusal(bench, 0x1A00, 0, 9) is Abort.PDO_LENGTH
    assert refusal(bench, 0x1A00, 0, 2) is None
    assert refusal(bench, 0x1800, 1, 0x181) is None
    assert refusal(bench, 0x1A00, 0, 1) is Abort.DEVICE_STATE
    bench.sent.clear()
    bench.give(Frame(0x80))
    (frame,) = [frame for _, frame in bench.sent if frame.cob_id == 0x181]
    assert int.from_bytes(frame.data[:4], "little", signed=True) == counts(0.0)
    assert len(frame.data) == 8


def test_only_what_may_be_mapped_that_way_is() -> None:
    bench = Bench(configured=False)
    # Index, sub-index, bits; read-only objects cannot be commanded, others can be shown.
    for word, command, show in (
        (0x60400010, True, True),
        (0x60410010, False, True),
        (0x60410008, False, False),
        (0x60410110, False, False),
        (0x10170010, False, False),
        (0x30000008, False, False),
    ):
        assert (refusal(bench, 0x1601, 1, word) is None) == command
        assert (refusal(bench, 0x1A01, 1, word) is None) == show
    bench = Bench(configured=False)
    bench.put(0x1601, 1, 0x60400010)
    for count, code in ((2, Abort.NOT_MAPPABLE), (1, None)):
        assert refusal(bench, 0x1601, 0, count) is code


def test_a_pdo_without_entries_does_not_exist() -> None:
    bench = Bench(configured=False)
    bench.put(0x1800, 1, 0x181)
    bench.give(nmt_frame(NmtCommand.START))
    bench.sent.clear()
    bench.give(Frame(0x80))
    assert bench.sent == []


@pytest.mark.parametrize("every", [1, 2, 3])
def test_a_synchronous_tpdo_is_sent_with_every_nth_sync(every: int) -> None:
    bench = Bench()
    for sub, value in ((1, GONE | 0x181), (2, every), (1, 0x181)):
        bench.put(0x1800, sub, value)
    bench.sent.clear()
    for _ in range(12):
        bench.give(Frame(0x80))
    assert sum(frame.cob_id == 0x181 for _, frame in bench.sent) == 12 // every


def test_an_asynchronous_rpdo_acts_at_once() -> None:
    bench = Bench()
    for sub, value in ((1, GONE | 0x201), (2, 255), (1, 0x201)):
        bench.put(0x1400, sub, value)
    bench.give(Frame(0x201, b"\x06\0" + bytes(4)))
    assert bench.axis is DriveState.READY_TO_SWITCH_ON


def test_a_long_rpdo_is_obeyed_and_reported_a_short_one_only_reported() -> None:
    bench = Bench()
    bench.give(Frame(0x201, b"\x06\0" + bytes(5)))
    bench.cycle(rpdo=False)
    assert bench.axis is DriveState.READY_TO_SWITCH_ON
    assert bench.emergencies() == [0x8220]
    bench.give(Frame(0x201, b"\x00\0" + bytes(3)))
    bench.cycle(rpdo=False)
    assert bench.axis is DriveState.READY_TO_SWITCH_ON
    assert bench.emergencies() == [0x8220, 0x8210]


def test_an_rpdo_later_than_the_window_is_not_obeyed() -> None:
    for late_us, obeyed in ((500, True), (501, False)):
        bench = Bench()
        bench.put(0x1007, 0, 500)
        bench.give(Frame(0x80))
        bench.drive.receive(Frame(0x201, b"\x06\0" + bytes(4)), bench.now_ns + 1000 * late_us)
        bench.cycle(2, rpdo=False)
        assert (bench.axis is DriveState.READY_TO_SWITCH_ON) == obeyed


# --- network management and timers -----------------------------------------------------------


def beats(bench: Bench) -> list[int]:
    """When heartbeats were sent [ms]."""
    return [at_ns // MS for at_ns, frame in bench.sent if frame.cob_id == 0x701]


def test_heartbeats_are_sent_at_1017_and_tell_the_state() -> None:
    bench = Bench(configured=False)
    bench.wait(50)
    assert beats(bench) == [5]
    bench.put(0x1017, 0, 10)
    bench.sent.clear()
    for order, byte in (
        (None, 0x7F),
        (NmtCommand.START, 0x05),
        (NmtCommand.STOP, 0x04),
        (NmtCommand.ENTER_PRE_OPERATIONAL, 0x7F),
    ):
        if order is not None:
            bench.give(nmt_frame(order, 1))
        bench.wait(30)
        heard = [frame.data[0] for _, frame in bench.sent if frame.cob_id == 0x701]
        assert heard[-2:] == [byte] * 2
    assert set(itertools.starmap(lambda a, b: b - a, itertools.pairwise(beats(bench)))) == {10}
    bench.drive.mute_heartbeat()
    bench.sent.clear()
    bench.wait(30)
    assert beats(bench) == []
    bench.drive.mute_heartbeat(False)
    bench.wait(20)
    assert len(beats(bench)) == 2


def test_orders_to_other_nodes_are_not_obeyed_those_to_all_are() -> None:
    bench = Bench(configured=False)
    for node_id, state in (
        (2, NmtState.PRE_OPERATIONAL),
        (0, NmtState.OPERATIONAL),
    ):
        bench.give(nmt_frame(NmtCommand.START, node_id))
        assert bench.drive.state is state
    bench.give(Frame(0x000, b"\x02\x01\x00"))
    assert bench.drive.state is NmtState.OPERATIONAL


def test_frames_that_are_not_for_it_are_not_heard() -> None:
    bench = Bench(configured=False)
    start = nmt_frame(NmtCommand.START, 1)
    for other in (
        start._replace(error=True),
        start._replace(extended=True),
        start._replace(remote=True),
    ):
        bench.give(other)
        assert bench.drive.state is NmtState.PRE_OPERATIONAL
    request = bytes.fromhex("4000100000000000")
    for cob_id, answers in ((0x602, 0), (0x600, 0), (0x601, 1)):
        bench.sent.clear()
        bench.give(Frame(cob_id, request))
        assert len(bench.sent) == answers


@pytest.mark.parametrize("sub", [1, 2])
@pytest.mark.parametrize("option", [0, 1])
def test_a_watched_master_is_lost_after_its_time_and_no_sooner(sub: int, option: int) -> None:
    bench = Bench(configured=False)
    bench.put(0x1016, sub, 126 << 16 | 20)
    bench.put(0x6007, 0, option)
    bench.wait(100)
    assert bench.emergencies() == []
    bench.give(nmt_frame(NmtCommand.START))
    # A master never heard of is watched from the start.
    bench.wait(20)
    assert bench.emergencies() == []
    bench.wait(1)
    assert bench.emergencies() == [0x8130]
    assert bench.axis is (DriveState.FAULT if option else SOD)
    assert bench.drive.state is NmtState.PRE_OPERATIONAL
    bench.wait(100)
    assert bench.emergencies() == [0x8130]
    bench.give(heartbeat_frame(125, NmtState.OPERATIONAL))
    bench.give(Frame(0x77E, b"\x05\x05"))
    assert bench.emergencies() == [0x8130]
    bench.give(heartbeat_frame(126, NmtState.OPERATIONAL))
    # A fault keeps its reason until it is reset.
    assert bench.emergencies() == [0x8130] + [0x0000] * (not option)


def test_a_heartbeat_puts_the_end_off_by_its_time() -> None:
    bench = Bench(configured=False)
    bench.put(0x1016, 1, 126 << 16 | 20)
    bench.give(nmt_frame(NmtCommand.START))
    for _ in range(5):
        bench.wait(20)
        bench.give(heartbeat_frame(126, NmtState.OPERATIONAL))
    assert bench.emergencies() == []
    bench.wait(21)
    assert bench.emergencies() == [0x8130]
    for word in (0, 126 << 16, 20):
        bench = Bench(configured=False)
        bench.put(0x1016, 1, word)
        bench.give(nmt_frame(NmtCommand.START))
        bench.wait(200)
        assert bench.emergencies() == []


def test_an_rpdo_is_late_after_its_deadline_counted_from_the_last() -> None:
    bench = Bench(missing_limit=1000)
    bench.enable()
    deadline = bench.get(0x1400, 5)
    assert deadline == 20
    # The last command came a millisecond ago.
    bench.cycle(19, rpdo=False)
    assert bench.emergencies() == []
    bench.cycle(1, rpdo=False)
    assert bench.emergencies() == [0x8250]
    # Before the first command there is nothing to be late.
    idle = Bench()
    idle.cycle(100, rpdo=False)
    assert idle.emergencies() == []


def test_sync_is_missed_after_five_periods_by_a_drive_with_power_alone() -> None:
    bench = Bench()
    bench.enable()
    bench.cycle(4, sync=False)
    assert bench.axis is OE
    bench.cycle(1, sync=False)
    assert bench.emergencies() == [0xFF11]
    bench.cycle(1, sync=False)
    assert bench.axis is DriveState.FAULT
    idle = Bench()
    idle.cycle(3)
    idle.cycle(20, sync=False)
    assert idle.emergencies() == []


def test_a_sync_counter_is_asked_for_by_1019() -> None:
    bench = Bench(configured=False)
    bench.put(0x1019, 0, 10)
    for data, wrong in ((b"\1", False), (b"", True)):
        bench.give(Frame(0x80, data))
        assert bench.emergencies() == [0x8240] * wrong
    bench = Bench()
    assert refusal(bench, 0x1019, 0, 10) is Abort.DEVICE_STATE
    bench.put(0x1006, 0, 0)
    assert refusal(bench, 0x1019, 0, 10) is None


def test_a_reset_forgets_all_but_where_the_motor_stands() -> None:
    bench = Bench()
    bench.enable()
    bench.target = counts(0.3)
    bench.cycle(3)
    bench.drive.trip(OVER_TEMPERATURE, bench.now_ns)
    bench.sent.clear()
    bench.drive.reset(bench.now_ns)
    assert bench.drive.state is NmtState.BOOT_UP
    began = bench.now_ns
    bench.give(Frame(0x601, bytes.fromhex("4000100000000000")))
    bench.wait(4)
    assert bench.sent == []
    bench.wait(1)
    assert bench.sent == [(began + 5 * MS, Frame(0x701, b"\0"))]
    assert bench.axis is SOD
    assert bench.angle == pytest.approx(0.3, abs=1e-5)
    assert [bench.get(*key) for key in ((0x1016, 1), (0x603F, 0), (0x2070, 0), (0x6061, 0))] == [
        0,
        0,
        250,
        0,
    ]
    assert bench.get(0x1800, 1) & 0x7FF == 0x181
    assert bench.get(0x1014) == 0x81


# --- knobs: a drive that does not behave -----------------------------------------------------


def test_a_drive_may_be_deaf_to_a_controlword() -> None:
    bench = Bench(ignores=frozenset({0x02}))
    bench.enable()
    bench.word = 0x02
    bench.cycle(5)
    assert bench.axis is OE
    bench.word = 0x00
    bench.cycle(2)
    assert bench.axis is SOD


@pytest.mark.parametrize("lag_ms", [0, 1, 3])
def test_a_drive_may_show_its_state_late(lag_ms: int) -> None:
    bench = Bench(status_lag_us=1000 * lag_ms)
    bench.wait(10)
    bench.word = 0x06
    bench.give(Frame(0x201, b"\x06\0" + bytes(4)))
    bench.give(Frame(0x80))
    assert bench.axis is DriveState.READY_TO_SWITCH_ON
    shown = []
    for _ in range(5):
        shown.append(decode_state(bench.status))
        bench.wait(1)
    late = [state is DriveState.READY_TO_SWITCH_ON for state in shown]
    assert late == [step >= lag_ms for step in range(5)]


def test_two_causes_must_both_go_before_a_fault_is_reset() -> None:
    bench = Bench()
    bench.enable()
    for code in (UNDER_VOLTAGE, OVER_TEMPERATURE):
        bench.drive.trip(code, bench.now_ns)
    bench.cycle(3)
    for code, state in ((UNDER_VOLTAGE, DriveState.FAULT), (OVER_TEMPERATURE, SOD)):
        bench.drive.clear_trip(code)
        for word in (0x00, 0x80):
            bench.word = word
            bench.cycle(2)
        assert bench.axis is state
    assert bench.emergencies() == [0x3220, 0x4310, 0x0000]
