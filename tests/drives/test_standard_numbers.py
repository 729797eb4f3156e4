"""Numbers of CiA 301 and CiA 402 as the standards print them, which master and drive share.

Both sides import the same constants, so that a wrong one would agree with itself. Here each number
stands once more, written down from the standard.
"""

import itertools

import pytest

from legbench.drives.emulated import axis, connection, dictionary, drive, reception
from legbench.drives.emulated.alarms import register_of
from legbench.drives.emulated.power import POWERED as POWERED_INSIDE
from legbench.drives.emulated.power import PowerStage
from legbench.drives.errors import CodecError
from legbench.drives.protocol import emcy, frame, lss, memory, nmt, objects, sdo
from legbench.drives.protocol.cia402 import (
    HOLD,
    POWERED,
    Controlword,
    DriveState,
    Goal,
    Mode,
    PowerMachine,
    StatusBit,
    Way,
    decode_state,
    describe_statusword,
    next_controlword,
)
from legbench.drives.protocol.datatypes import DataType, pack, range_of, size_of, unpack
from legbench.drives.protocol.objects import OBJECTS
from legbench.drives.setup.config import (
    CONTROLWORD,
    LINK_POSITION,
    LINK_POSITION_SHORT,
    POSITION_ACTUAL,
    STATUSWORD,
    TARGET_POSITION,
)

S = DriveState

STATE_PATTERNS = {
    # CiA 402-2, table 30; bits 6, 5, 3, 2, 1, 0 of the statusword, x is free.
    S.NOT_READY_TO_SWITCH_ON: "0x0000",
    S.SWITCH_ON_DISABLED: "1x0000",
    S.READY_TO_SWITCH_ON: "010001",
    S.SWITCHED_ON: "010011",
    S.OPERATION_ENABLED: "010111",
    S.QUICK_STOP_ACTIVE: "000111",
    S.FAULT_REACTION_ACTIVE: "0x1111",
    S.FAULT: "0x1000",
}


def printed_state(statusword: int) -> DriveState | None:
    """State by the table as it is printed."""
    bits = "".join(str(statusword >> place & 1) for place in (6, 5, 3, 2, 1, 0))
    fits = [
        state
        for state, pattern in STATE_PATTERNS.items()
        if all(want in ("x", bit) for want, bit in zip(pattern, bits, strict=True))
    ]
    assert len(fits) <= 1
    return fits[0] if fits else None


def test_all_65536_statuswords_are_read_as_the_table_is_printed() -> None:
    for statusword in range(1 << 16):
        assert decode_state(statusword) is printed_state(statusword), f"{statusword:04X}h"


def test_a_drive_shows_its_states_as_the_table_is_printed() -> None:
    stage = PowerStage({})
    for state in DriveState:
        stage.state = state
        assert printed_state(stage.low_byte) is state
        # Bit 4, voltage enabled, is the main supply's: there is one wherever switching on goes.
        supplied = state not in (S.NOT_READY_TO_SWITCH_ON, S.SWITCH_ON_DISABLED, S.FAULT)
        assert bool(stage.low_byte & 0x10) == supplied
        assert stage.low_byte < 0x80


SHUTDOWN, SWITCH_ON, ENABLE, DISABLE, QUICK, RESET = 0x06, 0x07, 0x0F, 0x00, 0x02, 0x80
KEEPS = {
    # The command of CiA 402-2, table 28, that leads out of no such state.
    S.NOT_READY_TO_SWITCH_ON: DISABLE,
    S.SWITCH_ON_DISABLED: DISABLE,
    S.READY_TO_SWITCH_ON: SHUTDOWN,
    S.SWITCHED_ON: SWITCH_ON,
    S.OPERATION_ENABLED: ENABLE,
    S.QUICK_STOP_ACTIVE: QUICK,
    S.FAULT_REACTION_ACTIVE: DISABLE,
    S.FAULT: DISABLE,
}
UP = (S.SWITCH_ON_DISABLED, S.READY_TO_SWITCH_ON, S.SWITCHED_ON, S.OPERATION_ENABLED)
CLIMB = (Goal.DISABLED, Goal.READY, Goal.SWITCHED_ON, Goal.ENABLED)
COMMAND_INTO = {0: DISABLE, 1: SHUTDOWN, 2: SWITCH_ON, 3: ENABLE}


def printed_step(state: DriveState, goal: Goal) -> tuple[int, Way]:
    """Command and outlook, from the transitions of CiA 402-2, figure 9."""
    keep = KEEPS[state]
    if goal in CLIMB and state in UP:
        here, there = UP.index(state), CLIMB.index(goal)
        if here == there:
            return keep, Way.REACHED
        return COMMAND_INTO[here + 1 if here < there else there], Way.MOVING
    if state is S.NOT_READY_TO_SWITCH_ON:
        return keep, Way.REACHED if goal is Goal.QUICK_STOP else Way.MOVING
    if goal is Goal.QUICK_STOP:
        if state in UP[1:]:
            return QUICK, Way.MOVING
        return keep, Way.MOVING if state is S.FAULT_REACTION_ACTIVE else Way.REACHED
    if goal is Goal.FAULT_RESET:
        return {
            S.FAULT: (RESET, Way.MOVING),
            S.FAULT_REACTION_ACTIVE: (keep, Way.MOVING),
            S.SWITCH_ON_DISABLED: (keep, Way.REACHED),
        }.get(state, (keep, Way.REFUSED))
    if state is S.QUICK_STOP_ACTIVE and goal is Goal.DISABLED:
        return DISABLE, Way.MOVING
    return keep, Way.REFUSED


@pytest.mark.parametrize(("state", "goal"), list(itertools.product(DriveState, Goal)))
def test_each_step_is_the_command_of_the_figure(state: DriveState, goal: Goal) -> None:
    word, way = next_controlword(state, goal)
    assert (int(word), way) == printed_step(state, goal)
    assert int(HOLD[state]) == KEEPS[state]


def test_commands_modes_and_bits_have_the_numbers_of_the_profile() -> None:
    assert {int(word): word.name for word in Controlword} == {
        0x00: "DISABLE_VOLTAGE",
        0x02: "QUICK_STOP",
        0x06: "SHUTDOWN",
        0x07: "SWITCH_ON",
        0x0F: "ENABLE_OPERATION",
        0x80: "FAULT_RESET",
    }
    # 6060h: 0 none, 6 homing, 7 interpolated position, 8 cyclic synchronous position.
    assert {mode.name: int(mode) for mode in Mode} == {
        "NONE": 0,
        "HOMING": 6,
        "CYCLIC_SYNCHRONOUS_POSITION": 8,
    }
    assert {bit.name: int(bit).bit_length() - 1 for bit in StatusBit} == {
        "VOLTAGE_ENABLED": 4,
        "WARNING": 7,
        "REMOTE": 9,
        "TARGET_REACHED": 10,
        "INTERNAL_LIMIT": 11,
        "FOLLOWS_COMMAND": 12,
        "FOLLOWING_ERROR": 13,
    }
    assert all(int(bit).bit_count() == 1 for bit in StatusBit)


def test_a_statusword_in_words_names_each_bit_that_is_set_and_no_other() -> None:
    names = {
        4: "voltage enabled",
        7: "warning",
        9: "remote",
        11: "internal limit",
        12: "follows command",
        13: "following error",
    }
    for chosen in itertools.product((False, True), repeat=len(names)):
        places = [place for place, on in zip(names, chosen, strict=True) if on]
        word = 0x0027 | sum(1 << place for place in places)
        words = ["operation enabled", *(names[place] for place in places)]
        assert describe_statusword(word) == f"{word:04X}h: " + ", ".join(words)
    assert describe_statusword(0x0001) == "0001h: unknown state"


def test_states_with_power_are_those_in_which_a_motor_holds_or_brakes() -> None:
    # CiA 402-2, figure 9: power is applied to the motor in these three alone.
    powered = {S.OPERATION_ENABLED, S.QUICK_STOP_ACTIVE, S.FAULT_REACTION_ACTIVE}
    assert set(POWERED_INSIDE) == powered
    assert set(POWERED) == powered | {None}


def test_a_word_on_the_way_up_stands_two_cycles_and_a_stop_none() -> None:
    machine = PowerMachine()
    machine.seek(Goal.ENABLED)
    # A drive that shows each state at once: the master alone paces the way.
    shown, words = 0x40, []
    for _ in range(8):
        words.append(machine.step(shown).controlword)
        shown = {0x06: 0x31, 0x07: 0x33, 0x0F: 0x37}[words[-1]]
    assert words == [0x06, 0x06, 0x07, 0x07, 0x0F, 0x0F, 0x0F, 0x0F]
    for goal, word in ((Goal.QUICK_STOP, 0x02), (Goal.DISABLED, 0x00)):
        for age in range(3):
            machine = PowerMachine()
            machine.seek(Goal.ENABLED)
            for _ in range(1 + age):
                machine.step(0x37)
            machine.seek(goal)
            assert machine.step(0x37).controlword == word


def test_a_drive_that_is_ahead_of_its_word_is_given_the_word_that_keeps_it() -> None:
    for shown, goal, word in (
        (0x37, Goal.ENABLED, 0x0F),
        (0x33, Goal.SWITCHED_ON, 0x07),
        (0x31, Goal.READY, 0x06),
    ):
        machine = PowerMachine()
        machine.seek(goal)
        machine.step(0x40)
        words = [machine.step(shown).controlword for _ in range(4)]
        assert words[1:] == [word] * 3
        # And again one state below, whose word has just been sent.
        machine = PowerMachine()
        machine.seek(Goal.ENABLED)
        for status in (0x40, 0x40, 0x31, 0x37):
            machine.step(status)
        assert [machine.step(0x37).controlword for _ in range(3)] == [0x0F] * 3


@pytest.mark.parametrize("waited", [0, 1, 2, 5])
def test_a_fault_reset_waits_for_two_low_cycles_and_is_given_up_after_50(waited: int) -> None:
    machine = PowerMachine()
    machine.seek(Goal.DISABLED)
    for _ in range(waited):
        machine.step(0x08)
    machine.seek(Goal.FAULT_RESET)
    steps = [machine.step(0x08) for _ in range(70)]
    low = max(0, 2 - waited)
    assert [step.controlword for step in steps] == [0x00] * low + [0x80] * 2 + [0x00] * (68 - low)
    # More than 50 cycles since the edge was over.
    refused = [number for number, step in enumerate(steps) if step.way is Way.REFUSED]
    assert refused[0] == low + 2 + 51
    assert not machine.lost


@pytest.mark.parametrize("goal", list(Goal))
def test_an_unreadable_state_is_sent_stops_and_nothing_else(goal: Goal) -> None:
    for known in (0x37, 0x40):
        machine = PowerMachine()
        machine.seek(Goal.ENABLED)
        before = [machine.step(known).controlword for _ in range(3)][-1]
        machine.seek(goal)
        blind = {Goal.QUICK_STOP: 0x02, Goal.DISABLED: 0x00}.get(goal, before)
        for _ in range(4):
            step = machine.step(0x01)
            assert (step.controlword, step.state, step.way) == (blind, None, Way.MOVING)
        assert machine.controlword == blind


def test_network_management_has_the_numbers_of_the_standard() -> None:
    # CiA 301, tables 16, 27, 30, 33, 38, 39 and 7.2.8.
    assert (frame.NMT_ID, frame.SYNC_ID, frame.TIME_ID) == (0x000, 0x080, 0x100)
    assert (frame.EMCY_BASE, frame.HEARTBEAT_BASE) == (0x080, 0x700)
    assert frame.TPDO_BASES == (0x180, 0x280, 0x380, 0x480)
    assert frame.RPDO_BASES == (0x200, 0x300, 0x400, 0x500)
    assert (frame.SDO_REPLY_BASE, frame.SDO_REQUEST_BASE) == (0x580, 0x600)
    assert (frame.LAST_NODE, frame.COB_MASK) == (127, 0x7FF)
    assert (frame.COB_INVALID, frame.COB_NO_REMOTE) == (0x80000000, 0x40000000)
    assert {order.name: int(order) for order in nmt.NmtCommand} == {
        "START": 1,
        "STOP": 2,
        "ENTER_PRE_OPERATIONAL": 128,
        "RESET_NODE": 129,
        "RESET_COMMUNICATION": 130,
    }
    assert {state.name: int(state) for state in nmt.NmtState} == {
        "BOOT_UP": 0,
        "STOPPED": 4,
        "OPERATIONAL": 5,
        "PRE_OPERATIONAL": 127,
    }


NAMED = {
    "EMCY": (0x081, 0x0FF),
    "TPDO1": (0x181, 0x1FF),
    "RPDO1": (0x201, 0x27F),
    "TPDO2": (0x281, 0x2FF),
    "RPDO2": (0x301, 0x37F),
    "TPDO3": (0x381, 0x3FF),
    "RPDO3": (0x401, 0x47F),
    "TPDO4": (0x481, 0x4FF),
    "RPDO4": (0x501, 0x57F),
    "SDO reply": (0x581, 0x5FF),
    "SDO request": (0x601, 0x67F),
    "heartbeat": (0x701, 0x77F),
}
"""The predefined connection set (CiA 301, tables 38 and 39): first and last identifier."""


def test_all_2048_identifiers_carry_what_the_connection_set_says() -> None:
    special = {0x000: "NMT", 0x080: "SYNC", 0x100: "TIME"}
    for cob_id in range(1 << 11):
        words = special.get(cob_id, f"id {cob_id:03X}h")
        for name, (first, last) in NAMED.items():
            if first <= cob_id <= last:
                words = f"{name} of {cob_id - first + 1}"
        assert frame.describe_id(cob_id) == words


def test_nmt_orders_and_heartbeats_are_read_byte_by_byte() -> None:
    orders = {1, 2, 128, 129, 130}
    for command, node_id in itertools.product(range(256), range(256)):
        read = nmt.decode_nmt(bytes((command, node_id)))
        assert read == ((command, node_id) if command in orders and node_id <= 127 else None)
    for byte in range(256):
        state = byte & 0x7F
        assert nmt.decode_heartbeat(bytes((byte,))) == (state if state in (0, 4, 5, 127) else None)
    for length in (0, 1, 3, 8):
        assert nmt.decode_nmt(bytes((1,) * length)) is None
    for length in (0, 2, 8):
        assert nmt.decode_heartbeat(bytes((5,) * length)) is None
    # Without a node the order goes to all of them.
    assert nmt.nmt_frame(nmt.NmtCommand.START) == frame.Frame(0x000, b"\x01\x00")


def test_data_types_have_the_index_and_the_size_of_table_44() -> None:
    sizes = {
        (0x01, "BOOLEAN"): 1,
        (0x02, "INTEGER8"): 1,
        (0x03, "INTEGER16"): 2,
        (0x04, "INTEGER32"): 4,
        (0x05, "UNSIGNED8"): 1,
        (0x06, "UNSIGNED16"): 2,
        (0x07, "UNSIGNED32"): 4,
        (0x08, "REAL32"): 4,
        (0x09, "VISIBLE_STRING"): None,
        (0x0A, "OCTET_STRING"): None,
        (0x15, "INTEGER64"): 8,
        (0x1B, "UNSIGNED64"): 8,
    }
    assert {(int(kind), kind.name): size_of(kind) for kind in DataType} == sizes


def test_strings_are_text_or_bytes_and_a_boolean_is_one_of_two() -> None:
    assert unpack(DataType.VISIBLE_STRING, b"drive\0\0") == "drive"
    assert unpack(DataType.OCTET_STRING, b"drive\0\0") == b"drive\0\0"
    assert pack(DataType.VISIBLE_STRING, "drive") == b"drive"
    assert pack(DataType.OCTET_STRING, b"\xff") == b"\xff"
    for kind, value in (
        (DataType.VISIBLE_STRING, b"drive"),
        (DataType.OCTET_STRING, "drive"),
        (DataType.VISIBLE_STRING, "\xe4"),
        (DataType.VISIBLE_STRING, 1),
    ):
        with pytest.raises(CodecError, match=f"is no {kind.name}"):
            pack(kind, value)
    assert range_of(DataType.BOOLEAN) == (0, 1)
    assert [range_of(kind) for kind in (DataType.INTEGER8, DataType.UNSIGNED8)] == [
        (-128, 127),
        (0, 255),
    ]


ABORTS = {
    # CiA 301, table 22.
    0x05030000: "toggle bit not alternated",
    0x05040000: "SDO protocol timed out",
    0x05040001: "command specifier not valid",
    0x05040005: "out of memory",
    0x06010000: "unsupported access to an object",
    0x06010001: "attempt to read a write only object",
    0x06010002: "attempt to write a read only object",
    0x06020000: "object does not exist in the object dictionary",
    0x06040041: "object cannot be mapped to the PDO",
    0x06040042: "would exceed the PDO length",
    0x06040043: "general parameter incompatibility",
    0x06060000: "hardware error",
    0x06070010: "length does not match",
    0x06070012: "length too high",
    0x06070013: "length too low",
    0x06090011: "sub-index does not exist",
    0x06090030: "value",
    0x06090031: "too high",
    0x06090032: "too low",
    0x08000000: "general error",
    0x08000020: "transferred or stored",
    0x08000021: "local control",
    0x08000022: "device state",
    0x08000024: "no data",
}


def test_aborts_have_the_codes_of_table_22() -> None:
    assert {int(code) for code in sdo.Abort} == set(ABORTS)
    for code in sdo.Abort:
        assert ABORTS[int(code)] in sdo.MEANINGS[code]


def test_an_emergency_has_eight_bytes_code_register_vendor() -> None:
    told = emcy.Emergency(node_id=5, code=0x8611, register=0x21, vendor=b"abcde")
    assert emcy.emcy_frame(told) == frame.Frame(0x085, bytes.fromhex("118621") + b"abcde")
    for length in (7, 9):
        assert emcy.decode_emcy(5, bytes(length)) is None
    bare = emcy.Emergency(node_id=127, code=0x1000, register=1)
    assert emcy.emcy_frame(bare) == frame.Frame(0x0FF, bytes.fromhex("0010010000000000"))


def test_storing_has_the_objects_signatures_and_parts_of_the_standard() -> None:
    # CiA 301, 7.5.2.13 and .14: "save" and "load", least significant byte first.
    assert (memory.STORE, memory.RESTORE) == (0x1010, 0x1011)
    assert (memory.SAVE_SIGNATURE, memory.LOAD_SIGNATURE) == (0x65766173, 0x64616F6C)
    assert (memory.ON_COMMAND, memory.BY_ITSELF) == (0b01, 0b10)
    # Sub-index 1 is everything, 2 communication (1000h to 1FFFh), 3 the profile (6000h to 9FFFh).
    parts = {1: (0x1000, 0xFFFF), 2: (0x1000, 0x1FFF), 3: (0x6000, 0x9FFF)}
    for part in range(6):
        first, last = parts.get(part, (0, -1))
        for index in (0, 0xFFF, 0x1000, 0x1FFF, 0x2000, 0x5FFF, 0x6000, 0x9FFF, 0xA000, 0xFFFF):
            assert memory.in_part((index, 3), part) is (first <= index <= last)
        assert not memory.in_part((0x10000, 0), part)


def test_layer_setting_services_have_the_numbers_of_cia_305() -> None:
    assert (lss.REQUEST_ID, lss.ANSWER_ID) == (0x7E5, 0x7E4)
    assert (lss.FRAME, lss.UNCONFIGURED, lss.WORDS, lss.RESET_SCAN) == (8, 0xFF, 4, 0x80)
    assert {specifier.name: int(specifier) for specifier in lss.Lss} == {
        "SWITCH_GLOBAL": 4,
        "CONFIGURE_NODE_ID": 17,
        "CONFIGURE_BIT_TIMING": 19,
        "ACTIVATE_BIT_TIMING": 21,
        "STORE": 23,
        "SELECT_VENDOR": 64,
        "SELECT_SERIAL": 67,
        "SELECTED": 68,
        "IDENTIFY_VENDOR": 70,
        "IDENTIFY_SERIAL_HIGH": 75,
        "IDENTIFY_UNCONFIGURED": 76,
        "IDENTIFIED": 79,
        "UNCONFIGURED_IDENTIFIED": 80,
        "FAST_SCAN": 81,
        "INQUIRE_VENDOR": 90,
        "INQUIRE_SERIAL": 93,
        "INQUIRE_NODE_ID": 94,
    }
    assert [int(mode) for mode in (lss.LssMode.WAITING, lss.LssMode.CONFIGURATION)] == [0, 1]
    errors = lss.LssError
    assert [int(e) for e in (errors.NONE, errors.OUT_OF_RANGE, errors.STORE_FAILED)] == [0, 1, 2]
    words = (0x11223344, 0x55667788, 0x99AABBCC, 0xDDEEFF00)
    assert [frame.hex() for frame in lss.select_frames(words)] == [
        "4044332211000000",
        "4188776655000000",
        "42ccbbaa99000000",
        "4300ffeedd000000",
    ]
    assert lss.scan_frame(0x11223344, 31, 2, 3).hex() == "51443322111f0203"
    assert lss.lss_frame(lss.Lss.INQUIRE_NODE_ID).hex() == "5e00000000000000"


EMERGENCIES = {
    # CiA 301, table 26; CiA 402-2, 603Fh; FFxxh are the emulated drive's own.
    0x0000: "error reset",
    0x1000: "generic error",
    0x2310: "over-current",
    0x3210: "over-voltage",
    0x3220: "under-voltage",
    0x4310: "drive over-temperature",
    0x5441: "safe torque off",
    0x6320: "parameter error",
    0x7305: "encoder",
    0x8100: "connection ended",
    0x8110: "CAN overrun",
    0x8120: "CAN error passive",
    0x8130: "heartbeat lost",
    0x8140: "recovered from bus-off",
    0x8210: "PDO too short",
    0x8220: "PDO too long",
    0x8240: "SYNC of unexpected length",
    0x8250: "RPDO timeout",
    0x8611: "following error",
    0x8612: "reference limit",
    0xFF10: "set points missing",
    0xFF11: "SYNC missing",
}


def test_every_error_code_has_its_words_and_others_are_told_apart_by_their_maker() -> None:
    for code in range(1 << 16):
        words = EMERGENCIES.get(code, "vendor error" if code >= 0xFF00 else "error")
        assert emcy.Emergency(node_id=5, code=code, register=0).meaning == words


def test_error_codes_say_what_the_standard_says_they_mean() -> None:
    # CiA 301, table 26, and CiA 402-2, 603Fh.
    words = {
        drive.UNDER_VOLTAGE: (0x3220, "under-voltage"),
        drive.OVER_TEMPERATURE: (0x4310, "drive over-temperature"),
        drive.HEARTBEAT_LOST: (0x8130, "heartbeat lost"),
        connection.CONNECTION_ENDED: (0x8100, "connection ended"),
        connection.WAS_OFF_BUS: (0x8140, "recovered from bus-off"),
        reception.PDO_SHORT: (0x8210, "PDO too short"),
        reception.PDO_LONG: (0x8220, "PDO too long"),
        reception.SYNC_LENGTH: (0x8240, "SYNC of unexpected length"),
        reception.RPDO_LATE: (0x8250, "RPDO timeout"),
        axis.FOLLOWING_ERROR: (0x8611, "following error"),
        axis.SETPOINTS_MISSING: (0xFF10, "set points missing"),
        axis.SYNC_MISSING: (0xFF11, "SYNC missing"),
    }
    for code, (printed, meaning) in words.items():
        assert code == printed
        assert emcy.Emergency(node_id=1, code=code, register=0).meaning == meaning


def test_the_error_register_names_the_group_of_each_code() -> None:
    # 1001h: bit 0 generic, 1 current, 2 voltage, 3 temperature, 4 communication, 5 profile,
    # 7 manufacturer; the group is the code's first digit (CiA 301, table 26).
    groups = {0x2: 0b11, 0x3: 0b101, 0x4: 0b1001, 0x8: 0b10001}
    for code in range(1 << 16):
        expected = groups.get(code >> 12, 0b1)
        if code >> 8 == 0x86:
            expected = 0b100001
        if code >= 0xFF00:
            expected = 0b10000001
        assert register_of(code) == (expected if code else 0)


def test_process_data_map_the_objects_of_the_profile() -> None:
    # 6040h u16, 6041h u16, 6064h i32, 607Ah i32, 60E4h:01 i32; 2064h is the manufacturer's.
    assert [
        entry.word
        for entry in (
            CONTROLWORD,
            STATUSWORD,
            POSITION_ACTUAL,
            TARGET_POSITION,
            LINK_POSITION,
            LINK_POSITION_SHORT,
        )
    ] == [0x60400010, 0x60410010, 0x60640020, 0x607A0020, 0x60E40120, 0x20640010]
    signed = (POSITION_ACTUAL, TARGET_POSITION, LINK_POSITION, LINK_POSITION_SHORT)
    assert {entry.kind.name[:3] for entry in signed} == {"INT"}
    assert {entry.kind.name[:3] for entry in (CONTROLWORD, STATUSWORD)} == {"UNS"}


def test_a_drive_has_four_command_and_four_answer_frames_of_eight_objects_each() -> None:
    # CiA 301, 7.5.2.33 to .38 and table 38: all switched off, sent at events, and mapping nothing.
    expected: dict[tuple[int, int], tuple[str, DataType, str, int]] = {}
    for base, first in ((0x1400, 0x200), (0x1800, 0x180)):
        for number in range(4):
            sender = "TPDO" if base == 0x1800 else "RPDO"
            inhibited = "rw" if base == 0x1800 else "ro"
            name, comm, mapped = f"{sender}{number + 1}", base + number, base + 0x200 + number
            cob_id = (1 << 31) + first + 0x100 * number
            u8, u16, u32 = DataType.UNSIGNED8, DataType.UNSIGNED16, DataType.UNSIGNED32
            expected[comm, 0] = (f"{name} parameter count", u8, "const", 5)
            expected[comm, 1] = (f"{name} COB-ID", u32, "rw", cob_id)
            expected[comm, 2] = (f"{name} transmission type", u8, "rw", 255)
            expected[comm, 3] = (f"{name} inhibit time [100 us]", u16, inhibited, 0)
            expected[comm, 5] = (f"{name} event timer [ms]", u16, "rw", 0)
            expected[mapped, 0] = (f"{name} mapped objects", u8, "rw", 0)
            for sub in range(1, 9):
                expected[mapped, sub] = (f"{name} mapping {sub}", u32, "rw", 0)
    found = {
        key: (entry.name, entry.kind, entry.access.value, entry.default)
        for key, entry in OBJECTS.items()
        if 0x1400 <= key[0] < 0x1C00
    }
    assert found == expected
    assert list(OBJECTS) == sorted(OBJECTS)
    assert (objects.PDO_COUNT, objects.LAST_PDO, objects.MAX_MAPPED) == (4, 512, 8)
    assert (objects.LINK_SHORT, objects.TEMPERATURE) == (0x2064, 0x2070)


@pytest.mark.parametrize(
    ("key", "name", "kind", "access", "default", "mappable"),
    [
        ((0x1000, 0), "Device type", "UNSIGNED32", "const", 0x00020192, False),
        ((0x1001, 0), "Error register", "UNSIGNED8", "ro", 0, True),
        (
            (0x1008, 0),
            "Manufacturer device name",
            "VISIBLE_STRING",
            "const",
            "legbench-drive",
            False,
        ),
        ((0x6040, 0), "Controlword", "UNSIGNED16", "rw", 0, True),
        ((0x6065, 0), "Following error window", "UNSIGNED32", "rw", 0xFFFFFFFF, False),
        ((0x607A, 0), "Target position", "INTEGER32", "rw", 0, True),
        ((0x60C2, 2), "Interpolation time index", "INTEGER8", "rw", -2, False),
        ((0x6502, 0), "Supported drive modes", "UNSIGNED32", "const", 0xA0, False),
    ],
)
def test_a_row_of_the_table_is_read_as_it_stands(
    key: tuple[int, int], name: str, kind: str, access: str, default: int | str, mappable: bool
) -> None:
    entry = OBJECTS[key]
    assert (entry.key, entry.name, entry.kind.name) == (key, name, kind)
    assert (entry.access.value, entry.default, entry.mappable) == (access, default, mappable)
    assert objects.name_of(*key) == f"{key[0]:04X}h:{key[1]:02X} {name}"
    assert objects.name_of(0x5FFF, 3) == "5FFFh:03"


def test_an_emulated_drive_knows_its_objects_by_the_numbers_of_the_standard() -> None:
    assert dictionary.MAX_SPEED == (0x6080, 0)
    assert (dictionary.MODE, dictionary.MODE_DISPLAY) == ((0x6060, 0), (0x6061, 0))
    assert dictionary.CYCLIC == 8
