"""An emulated drive keeps to CiA 301 and 402 where other masters rely on it, rule by rule."""

import itertools
from collections.abc import Callable

import pytest
from drive_bench import OE, OFFSET, SOD, Bench, counts
from drives_rig import MS

from legbench.drives.emulated.drive import OVER_TEMPERATURE
from legbench.drives.errors import SdoAbortError
from legbench.drives.protocol.cia402 import DriveState, StatusBit
from legbench.drives.protocol.emcy import Emergency, decode_emcy
from legbench.drives.protocol.frame import Frame
from legbench.drives.protocol.nmt import NmtCommand, NmtState, heartbeat_frame, nmt_frame
from legbench.drives.protocol.sdo import Abort

FAULT = DriveState.FAULT
RESET_COMMUNICATION = nmt_frame(NmtCommand.RESET_COMMUNICATION, 1)
GONE = 1 << 31
HALT = 1 << 8
NO_DATA = 0x08000024


def refusal(bench: Bench, index: int, sub: int, value: int) -> int | None:
    """Abort code with which a write by SDO is refused, if it is."""
    before = bench.read(index, sub)
    try:
        bench.put(index, sub, value)
    except SdoAbortError as error:
        assert bench.read(index, sub) == before
        return error.code
    return None


def emergencies(bench: Bench) -> list[Emergency]:
    found = [decode_emcy(1, frame.data) for _, frame in bench.sent if frame.cob_id == 0x81]
    return [emergency for emergency in found if emergency is not None]


# --- reset communication ---------------------------------------------------------------------


def test_reset_communication_sets_back_the_communication_profile_alone() -> None:
    bench = Bench()
    bench.put(0x6065, 0, 1234)
    bench.put(0x607C, 0, -77)
    assert bench.get(0x1006) == 1000
    bench.sent.clear()
    bench.give(RESET_COMMUNICATION)
    assert bench.drive.state is NmtState.BOOT_UP
    bench.wait(5)
    assert [frame for _, frame in bench.sent] == [Frame(0x701, b"\0")]
    # CiA 301, 7.3.2.2: objects of 1000h to 1FFFh are as after power-on, no others.
    for index, sub, value in (
        (0x1006, 0, 0),
        (0x1016, 1, 0),
        (0x1017, 0, 0),
        (0x1A00, 0, 0),
        (0x6065, 0, 1234),
        (0x607C, 0, -77),
        (0x6061, 0, 8),
        (0x6007, 0, 3),
    ):
        assert bench.get(index, sub) == value, hex(index)
    assert bench.get(0x1018, 1) == 0x1234
    assert bench.get(0x1800, 1) & 0x7FF == 0x181


@pytest.mark.parametrize("option", [0, 1, 2, 3])
def test_reset_communication_ends_the_connection_of_a_drive_that_moves(option: int) -> None:
    bench = Bench(bandwidth=None)
    bench.put(0x6085, 0, round(100 * counts(1.0)))
    bench.put(0x6007, 0, option)
    bench.enable()
    bench.target = counts(0.05)
    bench.cycle(2)
    bench.give(RESET_COMMUNICATION)
    states = {0: OE, 1: DriveState.FAULT_REACTION_ACTIVE, 2: SOD, 3: DriveState.QUICK_STOP_ACTIVE}
    assert bench.axis is states[option]
    # The motor is braked while the drive has no connection.
    bench.wait(2000)
    ends = {0: OE, 1: FAULT, 2: SOD, 3: SOD}
    assert bench.axis is ends[option]


def test_reset_node_sets_back_everything() -> None:
    bench = Bench()
    bench.put(0x6065, 0, 1234)
    bench.enable()
    bench.give(nmt_frame(NmtCommand.RESET_NODE, 1))
    bench.wait(5)
    assert bench.get(0x6065) == 0xFFFFFFFF
    assert bench.get(0x6061) == 0
    assert bench.axis is SOD


def test_reset_communication_keeps_a_fault_and_its_reason() -> None:
    bench = Bench()
    bench.enable()
    bench.drive.trip(OVER_TEMPERATURE, bench.now_ns)
    bench.cycle(3)
    bench.give(RESET_COMMUNICATION)
    bench.wait(5)
    assert bench.axis is FAULT
    assert (bench.get(0x603F), bench.get(0x1001)) == (0x4310, 0b1001)
    assert bench.get(0x1003, 1) == 0x4310


# --- a fault has a reason --------------------------------------------------------------------


def lose_heartbeat(bench: Bench) -> None:
    bench.beat = False
    bench.cycle(110)


def miss_commands(bench: Bench) -> None:
    bench.cycle(30, rpdo=False)


def stop_by_nmt(bench: Bench) -> None:
    bench.give(nmt_frame(NmtCommand.STOP, 1))
    bench.wait(3)
    bench.give(nmt_frame(NmtCommand.ENTER_PRE_OPERATIONAL, 1))


def reset_communication(bench: Bench) -> None:
    bench.give(RESET_COMMUNICATION)
    bench.wait(5)


def leave_the_bus(bench: Bench) -> None:
    bench.drive.bus_off(bench.now_ns)
    bench.wait(3)
    bench.drive.bus_on(bench.now_ns)
    bench.wait(1)


def lose_sync(bench: Bench) -> None:
    bench.cycle(10, sync=False)


def lag_behind(bench: Bench) -> None:
    bench.put(0x6065, 0, 10)
    bench.drive.axis.motion.jammed = True
    bench.target = counts(1.0)
    bench.cycle(5)


@pytest.mark.parametrize(
    ("cause", "code", "register"),
    [
        (lose_heartbeat, 0x8130, 0b1_0001),
        (miss_commands, 0x8250, 0b1_0001),
        (stop_by_nmt, 0x8100, 0b1_0001),
        (reset_communication, 0x8100, 0b1_0001),
        (leave_the_bus, 0x8140, 0b1_0001),
        (lose_sync, 0xFF11, 0b1000_0001),
        (lag_behind, 0x8611, 0b10_0001),
    ],
)
def test_a_fault_has_a_reason_in_three_places(
    cause: Callable[[Bench], None], code: int, register: int
) -> None:
    bench = Bench(missing_limit=1000)
    bench.put(0x6007, 0, 1)
    bench.put(0x6066, 0, 0)
    bench.enable()
    bench.sent.clear()
    cause(bench)
    bench.wait(3)
    assert bench.axis is FAULT
    assert (bench.get(0x603F), bench.get(0x1001), bench.get(0x1003, 1)) == (code, register, code)
    told = emergencies(bench)
    assert [(emergency.code, emergency.register) for emergency in told] == [(code, register)]


def test_the_reason_stays_as_long_as_the_fault() -> None:
    bench = Bench(missing_limit=1000)
    bench.put(0x6007, 0, 1)
    bench.enable()
    bench.sent.clear()
    lose_heartbeat(bench)
    assert bench.axis is FAULT
    # The master is there again; the fault is still one of its absence.
    bench.beat = True
    bench.cycle(5)
    assert (bench.axis, bench.get(0x603F)) == (FAULT, 0x8130)
    bench.give(nmt_frame(NmtCommand.START, 1))
    for word in (0x00, 0x80):
        bench.word = word
        bench.cycle(2)
    assert (bench.axis, bench.get(0x603F), bench.get(0x1001)) == (SOD, 0, 0)
    assert [emergency.code for emergency in emergencies(bench)] == [0x8130, 0x0000]


def test_of_two_errors_the_one_that_is_left_is_shown() -> None:
    bench = Bench(configured=False)
    bench.put(0x6007, 0, 0)
    bench.put(0x1016, 1, 126 << 16 | 20)
    bench.give(nmt_frame(NmtCommand.START, 1))
    bench.give(Frame(0x80, b"\1"))
    assert bench.get(0x603F) == 0x8240
    bench.wait(30)
    assert bench.get(0x603F) == 0x8130
    bench.give(heartbeat_frame(126, NmtState.OPERATIONAL))
    assert (bench.get(0x603F), bench.get(0x1001)) == (0x8240, 0b1_0001)


def test_a_stop_by_nmt_that_is_no_fault_is_no_error() -> None:
    bench = Bench()
    bench.enable()
    bench.sent.clear()
    stop_by_nmt(bench)
    bench.wait(5)
    assert bench.axis is SOD
    assert emergencies(bench) == []
    assert bench.get(0x603F) == 0


def test_a_drive_that_was_off_the_bus_says_so_when_it_is_back() -> None:
    bench = Bench()
    bench.enable()
    bench.sent.clear()
    leave_the_bus(bench)
    assert [emergency.code for emergency in emergencies(bench)] == [0x8140, 0x0000]
    assert bench.get(0x1003, 1) == 0x8140


# --- the history of errors -------------------------------------------------------------------


def test_the_history_is_emptied_by_a_zero_and_takes_nothing_else() -> None:
    bench = Bench()
    with pytest.raises(SdoAbortError) as caught:
        bench.get(0x1003, 1)
    assert caught.value.code == NO_DATA
    bench.drive.trip(OVER_TEMPERATURE, bench.now_ns)
    assert (bench.get(0x1003), bench.get(0x1003, 1)) == (1, 0x4310)
    for value in (1, 2, 255):
        assert refusal(bench, 0x1003, 0, value) == Abort.INVALID_VALUE
    assert (bench.get(0x1003), bench.get(0x1003, 1)) == (1, 0x4310)
    bench.put(0x1003, 0, 0)
    assert bench.get(0x1003) == 0
    with pytest.raises(SdoAbortError) as caught:
        bench.get(0x1003, 1)
    assert caught.value.code == NO_DATA


# --- values outside the standard -------------------------------------------------------------


@pytest.mark.parametrize(
    ("index", "sub", "allowed"),
    [
        (0x6007, 0, range(4)),
        (0x605A, 0, range(9)),
        (0x605B, 0, range(2)),
        (0x605C, 0, range(2)),
        (0x605D, 0, range(1, 5)),
        (0x605E, 0, range(5)),
        (0x1029, 1, range(3)),
        (0x1019, 0, (0, *range(2, 241))),
    ],
)
def test_codes_outside_the_standard_are_refused(
    index: int, sub: int, allowed: range | tuple[int, ...]
) -> None:
    bench = Bench(configured=False)
    signed = index >= 0x6000
    for value in range(-10 if signed else 0, 256):
        expected = None if value in allowed else Abort.INVALID_VALUE
        assert refusal(bench, index, sub, value) == expected, value
    if signed:
        for value in (-32768, 32767):
            assert refusal(bench, index, sub, value) == Abort.INVALID_VALUE


RESERVED = (
    *range(0x000, 0x080),
    *range(0x101, 0x181),
    *range(0x581, 0x600),
    *range(0x601, 0x680),
    *range(0x6E0, 0x700),
    *range(0x701, 0x800),
)
"""Restricted CAN-IDs of CiA 301, table 50: NMT, reserved, SDO, reserved, NMT error control."""


@pytest.mark.parametrize("index", [0x1400, 0x1403, 0x1800, 0x1803])
def test_process_data_take_no_reserved_identifier(index: int) -> None:
    bench = Bench(configured=False)
    for cob_id in range(0x800):
        bench.put(index, 1, GONE | 0x181)
        expected = Abort.INVALID_VALUE if cob_id in RESERVED else None
        assert refusal(bench, index, 1, cob_id) == expected, hex(cob_id)
    # A PDO that does not exist may be called anything; 29 bits are for others.
    assert refusal(bench, index, 1, GONE) is None
    for cob in (1 << 29 | 0x181, 0x881, 1 << 28 | 0x181):
        assert refusal(bench, index, 1, cob) == Abort.INVALID_VALUE


def test_sync_has_the_identifier_that_1005h_says() -> None:
    bench = Bench()
    bench.enable()
    for cob in (*RESERVED, 1 << 30 | 0x80, 1 << 29 | 0x80, 0x880):
        assert refusal(bench, 0x1005, 0, cob) == Abort.INVALID_VALUE, hex(cob)
    assert refusal(bench, 0x1005, 0, 0x85) is None
    bench.sent.clear()
    bench.give(Frame(0x80))
    assert bench.sent == []
    bench.give(Frame(0x85))
    assert [frame.cob_id for _, frame in bench.sent] == [0x181]


def test_a_node_is_watched_once() -> None:
    bench = Bench(configured=False)
    assert refusal(bench, 0x1016, 1, 126 << 16 | 100) is None
    # The same sub-index may name it again; a time of 0 watches nobody.
    assert refusal(bench, 0x1016, 1, 126 << 16 | 200) is None
    assert refusal(bench, 0x1016, 2, 126 << 16 | 100) == Abort.INCOMPATIBLE == 0x06040043
    assert refusal(bench, 0x1016, 2, 126 << 16) is None
    assert refusal(bench, 0x1016, 2, 125 << 16 | 100) is None
    assert refusal(bench, 0x1016, 1, 125 << 16 | 100) == Abort.INCOMPATIBLE


@pytest.mark.parametrize("node_id", [0, 128, 128 + 126])
def test_a_node_that_cannot_be_is_not_watched(node_id: int) -> None:
    bench = Bench(configured=False)
    bench.put(0x1016, 1, node_id << 16 | 20)
    bench.give(nmt_frame(NmtCommand.START, 1))
    bench.wait(100)
    assert bench.emergencies() == []


# --- what can be written has an effect -------------------------------------------------------


def test_emergencies_keep_their_inhibit_time() -> None:
    bench = Bench(configured=False)
    bench.put(0x1015, 0, 50)
    bench.sent.clear()
    began = bench.now_ns
    for code in (0x4310, 0x3220, 0x2310):
        bench.drive.trip(code, bench.now_ns)
        bench.wait(1)
    bench.wait(20)
    # 50 times 100 us after each other.
    times = [at_ns for at_ns, frame in bench.sent if frame.cob_id == 0x81]
    assert times == [began, began + 5 * MS, began + 10 * MS]
    assert bench.emergencies() == [0x4310, 0x3220, 0x2310]


def event_driven(bench: Bench, inhibit: int, kind: int = 255, timer_ms: int = 0) -> None:
    """TPDO1 with the velocity, by the given rule."""
    for index, sub, value in (
        (0x1800, 1, GONE | 0x181),
        (0x1A00, 0, 0),
        (0x1A00, 1, 0x606C0020),
        (0x1A00, 0, 1),
        (0x1800, 2, kind),
        (0x1800, 3, inhibit),
        (0x1800, 5, timer_ms),
        (0x1800, 1, 0x181),
    ):
        bench.put(index, sub, value)


@pytest.mark.parametrize(("inhibit", "every"), [(0, 1), (10, 1), (20, 2), (45, 5)])
def test_process_data_by_event_keep_their_inhibit_time(inhibit: int, every: int) -> None:
    bench = Bench()
    event_driven(bench, inhibit)
    bench.enable()
    bench.sent.clear()
    for step in range(1, 41):
        # The velocity is another one in every cycle.
        bench.target = counts(1e-4 * step * step)
        bench.cycle()
    times = [at_ns // MS for at_ns, frame in bench.sent if frame.cob_id == 0x181]
    assert len(times) > 5
    assert {b - a for a, b in itertools.pairwise(times)} == {every}


def test_process_data_of_type_0_are_sent_at_sync_if_they_have_changed() -> None:
    bench = Bench()
    event_driven(bench, 0, kind=0)
    bench.enable()
    bench.cycle(5)
    bench.sent.clear()
    bench.cycle(5)
    assert [frame for _, frame in bench.sent if frame.cob_id == 0x181] == []
    bench.target = counts(0.01)
    bench.cycle(5)
    said = [
        int.from_bytes(frame.data, "little") for _, frame in bench.sent if frame.cob_id == 0x181
    ]
    # It has moved, and it stands again.
    assert len(said) == 2
    assert said[0] > 0
    assert said[1] == 0


def test_what_has_no_effect_is_read_only() -> None:
    bench = Bench(configured=False)
    # RPDOs have no inhibit time; there are neither profile nor torque modes.
    for index, sub in ((0x1400, 3), (0x1403, 3), (0x6071, 0), (0x6081, 0), (0x6083, 0)):
        assert refusal(bench, index, sub, 1) == Abort.READ_ONLY, hex(index)
    bench.put(0x1601, 0, 0)
    assert refusal(bench, 0x1601, 1, 0x60710010) == Abort.NOT_MAPPABLE


def test_polarity_turns_positions_and_velocities() -> None:
    bench = Bench()
    bench.put(0x607D, 1, -counts(0.05))
    bench.put(0x607D, 2, counts(1.0))
    stands = bench.get(0x6064)
    assert refusal(bench, 0x607E, 0, 0x80) is None
    bench.wait(1)
    assert bench.get(0x6064) == -stands
    bench.target = bench.get(0x6064)
    bench.enable()
    bench.cycle(3)
    assert bench.angle == pytest.approx(0.0, abs=1e-5)
    bench.target = -counts(-0.02)
    bench.cycle(1)
    bench.give(Frame(0x80))
    bench.wait(1)
    # Bit 7 alone turns the position, not the velocity.
    assert bench.get(0x606C) < 0
    bench.cycle(3)
    assert bench.angle == pytest.approx(-0.02, abs=1e-5)
    assert bench.get(0x6064) == bench.target
    assert bench.get(0x6062) == bench.target
    # Limits are those of the target as it is written.
    bench.target = -counts(0.3)
    bench.cycle(3)
    assert bench.get(0x6064) == -counts(0.05)
    assert bench.status & StatusBit.INTERNAL_LIMIT
    # Turned under power the motor would jump.
    assert refusal(bench, 0x607E, 0, 0) == Abort.DEVICE_STATE
    assert refusal(bench, 0x607E, 0, 0x01) == Abort.INVALID_VALUE


def test_polarity_of_the_velocity() -> None:
    seen = []
    for polarity in (0x00, 0x40):
        bench = Bench()
        bench.put(0x607E, 0, polarity)
        bench.enable()
        bench.target = counts(0.02)
        bench.cycle(1)
        bench.give(Frame(0x80))
        bench.wait(1)
        seen.append(bench.get(0x606C))
    assert seen[0] > 0
    assert seen[1] == -seen[0]


def test_homing_under_polarity_names_the_position_as_it_is_read() -> None:
    bench = Bench()
    bench.put(0x607E, 0, 0x80)
    bench.put(0x6098, 0, 37)
    bench.put(0x607C, 0, 5000)
    bench.target = -OFFSET
    bench.enable()
    bench.put(0x6060, 0, 6)
    bench.cycle(5)
    bench.word = 0x1F
    bench.cycle(5)
    assert bench.get(0x6064) == 5000


# --- homing under halt -----------------------------------------------------------------------

BITS = StatusBit.TARGET_REACHED | StatusBit.FOLLOWS_COMMAND | StatusBit.FOLLOWING_ERROR


def test_homing_that_is_halted_is_interrupted_and_goes_on() -> None:
    bench = Bench(start_pos=0.3, hard_stop=(-0.5, 0.7))
    bench.put(0x605D, 0, 1)
    bench.put(0x6084, 0, round(20 * counts(1.0)))
    bench.put(0x6098, 0, -3)
    bench.put(0x6099, 1, counts(1.0) - OFFSET)
    bench.enable()
    bench.put(0x6060, 0, 6)
    bench.cycle(5)
    bench.word = 0x1F
    bench.cycle(100)
    assert bench.status & BITS == 0
    bench.word = 0x1F | HALT
    bench.cycle(2)
    # It still brakes, in 50 ms.
    assert bench.status & BITS == 0
    bench.cycle(60)
    place = bench.angle
    # CiA 402-2, homing: interrupted or not started.
    assert bench.status & BITS == 0x0400
    bench.cycle(20)
    assert bench.angle == place
    bench.word = 0x1F
    bench.cycle(2000)
    assert bench.status & BITS == StatusBit.TARGET_REACHED | StatusBit.FOLLOWS_COMMAND
    assert bench.angle == pytest.approx(-0.5, abs=1e-5)
