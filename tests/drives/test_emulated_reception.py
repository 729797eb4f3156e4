"""What an emulated drive makes of SYNC and commands by their times, on parts that take notes."""

from types import SimpleNamespace
from typing import Any

import pytest
from drives_rig import node

from legbench.drives.emulated.drive import EmulatedDrive
from legbench.drives.emulated.process_data import ProcessData
from legbench.drives.emulated.reception import Reception
from legbench.drives.protocol.cia402 import DriveState

US, MS = 1_000, 1_000_000


class Noted:
    """A reception whose process data, axis and connection note what they are told."""

    def __init__(self, *timers_ms: int, **objects: int) -> None:
        values = {(0x1006, 0): 1000, (0x1007, 0): 0, (0x1019, 0): 0}
        values |= {(int(name[1:], 16), 0): value for name, value in objects.items()}
        self.told: list[tuple[Any, ...]] = []
        layout = SimpleNamespace(size=2, unpack=lambda data: ("values", data))
        self.rpdos = {
            0x201 + place: SimpleNamespace(
                layout=layout, kind=1, seen_ns=None, timer_ns=MS * timer, waiting=None
            )
            for place, timer in enumerate(timers_ms)
        }
        self.power = SimpleNamespace(state=DriveState.OPERATION_ENABLED)
        axis = SimpleNamespace(
            power=self.power,
            sync=lambda fresh, now_ns: self.told.append(("sync", fresh, now_ns)),
            fault=lambda code: self.told.append(("fault", code)),
        )
        pdos = SimpleNamespace(
            rpdos=self.rpdos,
            at_sync=lambda: ["sampled"],
            latch=lambda: self.told.append(("latched",)),
            apply=lambda pdo, values: self.told.append(("applied", values)),
        )
        connection = SimpleNamespace(
            report=lambda code, now_ns: self.told.append(("report", code)),
            over=lambda code, now_ns: None,
        )
        stubs: Any = (axis, pdos, connection)
        self.made = Reception(values, *stubs, sync_loss_periods=5)


def test_a_target_is_fresh_for_one_sync_and_never_before_one_came() -> None:
    it = Noted()
    it.made.sync(1 * MS)
    it.made.fresh = True
    it.made.sync(2 * MS)
    it.made.sync(3 * MS)
    it.made.fresh = True
    it.made.forget()
    it.made.sync(4 * MS)
    syncs = [entry for entry in it.told if entry[0] == "sync"]
    assert syncs == [
        ("sync", fresh, n * MS) for n, fresh in ((1, False), (2, True), (3, False), (4, False))
    ]


@pytest.mark.parametrize(("late_us", "waits"), [(399, True), (400, True), (401, False)])
def test_a_command_is_latched_within_the_window_after_sync(late_us: int, waits: bool) -> None:
    # 1007h: length of the synchronous window, in microseconds (CiA 301).
    it = Noted(0, x1007=400)
    it.made.sync(10 * MS)
    it.made.rpdo(0x201, b"\1\2", 10 * MS + late_us * US)
    assert (it.rpdos[0x201].waiting is not None) is waits
    assert it.rpdos[0x201].seen_ns == 10 * MS + late_us * US


def test_a_command_of_another_type_is_applied_at_once_and_one_that_is_too_short_is_not() -> None:
    it = Noted(0)
    for kind, applied in ((0, 0), (240, 0), (241, 1), (255, 1)):
        it.rpdos[0x201].kind = kind
        it.told.clear()
        it.made.rpdo(0x201, b"\1\2\3", 0)
        # 8220h: longer than what is mapped; the rest is not looked at.
        assert it.told[0] == ("report", 0x8220)
        assert it.told[1:] == [("applied", ("values", b"\1\2"))] * applied
    it.told.clear()
    it.rpdos[0x201].seen_ns = None
    it.made.rpdo(0x201, b"\1", 5)
    assert it.told == [("report", 0x8210)]
    assert it.rpdos[0x201].seen_ns is None


def test_each_command_that_is_late_counts_once() -> None:
    it = Noted(10, 20, 0, 20)
    for cob_id in it.rpdos:
        if cob_id != 0x204:
            it.made.rpdo(cob_id, b"\1\2", MS)
    counts = [it.made.late_rpdos(now * MS) for now in (11, 12, 13, 21, 22, 23)]
    # After 10 and after 20 ms; one has no deadline, and one was never sent.
    assert counts == [0, 1, 0, 0, 1, 0]
    for cob_id in (0x201, 0x202):
        it.made.rpdo(cob_id, b"\1\2", 30 * MS)
    assert it.made.late_rpdos(60 * MS) == 2


@pytest.mark.parametrize("cycle_us", [1000, 2000])
def test_a_motor_with_power_is_stopped_after_five_cycles_without_sync(cycle_us: int) -> None:
    it = Noted(x1006=cycle_us)
    it.made.watch_sync(100 * MS)
    it.made.sync(100 * MS)
    limit = 100 * MS + 5 * cycle_us * US
    it.told.clear()
    for now_ns in (limit - 1, limit):
        it.made.watch_sync(now_ns)
        assert it.told == []
    for now_ns in (limit + 1, limit + 2):
        it.made.watch_sync(now_ns)
        # A code of the maker (CiA 402 leaves him FF00h to FFFFh).
        assert it.told == [("fault", 0xFF11)]
    it.power.state = DriveState.SWITCHED_ON
    it.made.sync(200 * MS)
    it.told.clear()
    it.made.watch_sync(300 * MS)
    assert it.told == []
    # Without a period nothing is expected.
    off = Noted(x1006=0)
    off.made.sync(1 * MS)
    off.told.clear()
    off.made.watch_sync(10_000 * MS)
    assert off.told == []


# --- process data objects --------------------------------------------------------------------


def pdo(**how: Any) -> Any:
    """A PDO of nothing that was sent and received before."""
    layout = SimpleNamespace(pack=lambda values: bytes(values), entries=())
    usual = {"cob_id": 0x181, "kind": 1, "syncs": 0, "keys": (), "last": b"", "layout": layout}
    return SimpleNamespace(**(usual | {"waiting": (1,), "seen_ns": 5} | how))


def test_objects_of_process_data_are_1400h_to_1bffh() -> None:
    owned = [index for index in range(0x1000, 0x2000) if ProcessData.owns((index, 1))]
    assert owned == list(range(0x1400, 0x1C00))


def test_all_that_waits_is_forgotten_and_nothing_of_before_is_compared_with() -> None:
    made = EmulatedDrive(node(0))._pdos
    made.rpdos = {0x201: pdo(), 0x301: pdo()}
    made.tpdos = [pdo(), pdo()]
    made.forget()
    commands, answers = made.rpdos.values(), made.tpdos
    assert [(one.waiting, one.seen_ns) for one in commands] == [(None, None)] * 2
    assert [(one.last, one.seen_ns) for one in answers] == [(None, None)] * 2


def test_synchronous_answers_come_with_every_so_many_syncs_up_to_240() -> None:
    made = EmulatedDrive(node(0))._pdos
    made.tpdos = [pdo(cob_id=0x180 + kind, kind=kind) for kind in (1, 2, 240, 241, 254, 255)]
    sent = [[frame.cob_id - 0x180 for frame in made.at_sync()] for _ in range(240)]
    assert sent[0] == [1]
    assert sent[1] == [1, 2]
    assert sent[238] == [1]
    # CiA 301: 241 to 253 are reserved, 254 and 255 are sent by events.
    assert sent[239] == [1, 2, 240]


def test_an_answer_that_is_mapped_anew_as_before_keeps_its_time_and_repeats_if_it_shall() -> None:
    drive = EmulatedDrive(node(0))
    made, values = drive._pdos, drive.axis._values
    # TPDO1 of the usual drive, switched on with the statusword alone in it.
    values[0x1A00, 0], values[0x1A00, 1], values[0x1800, 1] = 1, 0x60410010, 0x181
    made.rebuild()
    (first,) = [one for one in made.tpdos if one.cob_id == 0x181]
    first.seen_ns = 77
    values[0x6041, 0] = 0x1234
    assert made.sample(first) == b"\x34\x12"
    made.repeats = True
    values[0x6041, 0] = 0x5678
    assert made.sample(first) == b"\x34\x12"
    made.repeats = False
    assert made.sample(first) == b"\x78\x56"
    made.rebuild()
    (again,) = [one for one in made.tpdos if one.cob_id == 0x181]
    assert again is not first
    assert again.seen_ns == 77
