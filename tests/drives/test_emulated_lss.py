"""LSS of an emulated drive, by the byte as CiA 305 prints it."""

import struct

import pytest
from drive_bench import Bench
from drives_rig import node

from legbench.drives.emulated.lss import LssSlave
from legbench.drives.protocol.frame import Frame
from legbench.drives.protocol.nmt import NmtCommand, NmtState, nmt_frame

VENDOR, PRODUCT, REVISION, SERIAL = ADDRESS = (0x1234, 7, 0x10002, 0x80000065)
WAITING, CONFIGURATION = b"\x04\x00", b"\x04\x01"


def ask(slave: LssSlave, *content: int | bytes) -> bytes | None:
    data = b"".join(one if isinstance(one, bytes) else bytes((one,)) for one in content)
    return slave.feed(data.ljust(8, b"\0"))


def word(value: int) -> bytes:
    return struct.pack("<I", value)


def configuring(node_id: int = 9) -> LssSlave:
    slave = LssSlave(ADDRESS, node_id)
    assert ask(slave, CONFIGURATION) is None
    return slave


def test_inquiries_tell_identity_and_node_id() -> None:
    slave = configuring()
    for code, value in zip((0x5A, 0x5B, 0x5C, 0x5D), ADDRESS, strict=True):
        assert ask(slave, code) == bytes((code, *word(value), 0, 0, 0))
    assert ask(slave, 0x5E) == bytes((0x5E, 9, 0, 0, 0, 0, 0, 0))
    ask(slave, WAITING)
    assert [ask(slave, code) for code in (0x5A, 0x5E, 0x11, 0x17)] == [None] * 4


@pytest.mark.parametrize("wrong", [None, 0, 1, 2, 3])
def test_a_slave_is_selected_by_its_whole_address_alone(wrong: int | None) -> None:
    slave = LssSlave(ADDRESS, 9)
    answers = [
        ask(slave, 0x40 + place, word(value + (place == wrong)))
        for place, value in enumerate(ADDRESS)
    ]
    assert answers[:3] == [None] * 3
    assert (answers[3] is None) == (wrong is not None)
    if wrong is None:
        assert answers[3] == b"\x44" + bytes(7)
    assert (ask(slave, 0x5E) is None) == (wrong is not None)


@pytest.mark.parametrize(("new", "error"), [(1, 0), (127, 0), (255, 0), (0, 1), (128, 1), (254, 1)])
def test_a_node_id_is_checked_and_in_use_after_a_reset_only(new: int, error: int) -> None:
    slave = configuring()
    assert ask(slave, 0x11, new) == bytes((0x11, error, 0, 0, 0, 0, 0, 0))
    assert slave.node_id == 9
    assert slave.begin(cold=False) == (9 if error else new)


def test_a_node_id_that_is_not_stored_is_gone_with_the_power() -> None:
    slave = configuring()
    ask(slave, 0x11, 20)
    assert slave.begin(cold=True) == 9
    ask(slave, CONFIGURATION)
    ask(slave, 0x11, 20)
    assert ask(slave, 0x17) == b"\x17" + bytes(7)
    assert slave.begin(cold=True) == 20


def test_bit_timing_is_answered_as_not_supported() -> None:
    slave = configuring()
    assert ask(slave, 0x13, 0, 2) == b"\x13\x01" + bytes(6)
    assert ask(slave, 0x15, 10, 0) is None


def identified(slave: LssSlave, revisions: tuple[int, int], serials: tuple[int, int]) -> bool:
    asked = (VENDOR, PRODUCT, *revisions, *serials)
    return [ask(slave, 0x46 + place, word(value)) for place, value in enumerate(asked)][-1] == (
        b"\x4f" + bytes(7)
    )


def test_ranges_of_revision_and_serial_number_identify_it() -> None:
    slave = LssSlave(ADDRESS, 9)
    assert identified(slave, (REVISION, REVISION), (SERIAL, SERIAL))
    assert identified(slave, (0, 0xFFFFFFFF), (0, 0xFFFFFFFF))
    assert not identified(slave, (0, REVISION - 1), (0, 0xFFFFFFFF))
    assert not identified(slave, (0, 0xFFFFFFFF), (SERIAL + 1, 0xFFFFFFFF))
    # The last question alone asks nothing.
    assert ask(slave, 0x4B, word(0xFFFFFFFF)) is None


def test_a_drive_with_a_node_id_takes_no_part_in_scans() -> None:
    slave = LssSlave(ADDRESS, 9)
    assert ask(slave, 0x4C) is None
    assert ask(slave, 0x51, word(0), 0x80, 0, 0) is None
    bare = LssSlave(ADDRESS, 255)
    assert ask(bare, 0x4C) == b"\x50" + bytes(7)
    assert ask(bare, 0x51, word(0), 0x80, 0, 0) == b"\x4f" + bytes(7)


def test_a_scan_can_begin_anew_and_asks_32_bits_of_4_words() -> None:
    slave = LssSlave(ADDRESS, 255)
    vendor = word(VENDOR)
    assert ask(slave, 0x51, vendor, 0, 0, 1) == b"\x4f" + bytes(7)
    # The next word is asked for now, and no longer the first one.
    assert ask(slave, 0x51, vendor, 0, 0, 1) is None
    assert ask(slave, 0x51, word(PRODUCT), 31, 1, 1) == b"\x4f" + bytes(7)
    ask(slave, 0x51, word(0), 0x80, 0, 0)
    assert ask(slave, 0x51, vendor, 31, 0, 0) == b"\x4f" + bytes(7)
    assert ask(slave, 0x51, vendor, 32, 0, 0) is None
    assert ask(slave, 0x51, vendor, 0, 4, 0) is None


def test_a_mode_that_does_not_exist_is_ignored() -> None:
    slave = configuring()
    assert ask(slave, 0x04, 2) is None
    assert ask(slave, 0x5E) is not None


def test_frames_of_another_length_are_ignored() -> None:
    slave = configuring()
    for length in (0, 1, 7):
        assert slave.feed(b"\x5e".ljust(length, b"\0")[:length]) is None


# --- the drive -------------------------------------------------------------------------------


def lss(bench: Bench, *content: int) -> bytes | None:
    bench.sent.clear()
    bench.give(Frame(0x7E5, bytes(content).ljust(8, b"\0")))
    answers = [frame.data for _, frame in bench.sent if frame.cob_id == 0x7E4]
    return answers[0] if answers else None


def test_a_new_node_id_moves_every_service_of_the_drive() -> None:
    bench = Bench(configured=False)
    lss(bench, 0x04, 1)
    lss(bench, 0x11, 33)
    assert lss(bench, 0x17) == b"\x17" + bytes(7)
    lss(bench, 0x04, 0)
    bench.give(nmt_frame(NmtCommand.RESET_COMMUNICATION, 1))
    bench.sent.clear()
    while bench.drive.state is NmtState.BOOT_UP:
        bench.wait(1)
    assert [frame for _, frame in bench.sent if frame.cob_id > 0x700] == [Frame(0x721, b"\0")]
    # The end of the connection is a fault by default (6007h), told under the new node id.
    assert [frame.cob_id for _, frame in bench.sent if frame.cob_id < 0x100] == [0xA1]
    bench.sent.clear()
    for request in (0x601, 0x621):
        bench.give(Frame(request, bytes.fromhex("4014100000000000")))
    assert [frame.cob_id for _, frame in bench.sent] == [0x5A1]
    # COB-ID EMCY follows the node id, and so do those of the PDOs.
    assert bench.sent[0][1].data[4:] == struct.pack("<I", 0x80 + 33)
    assert bench.drive._values[0x1400, 1] & 0x7FF == 0x221
    bench.drive.trip(0x3220, bench.now_ns)
    bench.wait(1)
    assert 0x80 + 33 in [frame.cob_id for _, frame in bench.sent]


def test_a_drive_without_node_id_hears_lss_alone_and_boots_once_it_has_one() -> None:
    bench = Bench(configured=False)
    lss(bench, 0x04, 1)
    lss(bench, 0x11, 255)
    lss(bench, 0x17)
    bench.give(nmt_frame(NmtCommand.RESET_NODE, 1))
    bench.sent.clear()
    bench.wait(50)
    bench.give(Frame(0x601, bytes.fromhex("4000100000000000")))
    bench.give(nmt_frame(NmtCommand.START, 0))
    bench.wait(50)
    assert bench.sent == []
    assert bench.drive.state is NmtState.BOOT_UP
    assert lss(bench, 0x4C) == b"\x50" + bytes(7)
    lss(bench, 0x04, 1)
    lss(bench, 0x11, 4)
    bench.wait(20)
    assert bench.drive.state is NmtState.BOOT_UP
    lss(bench, 0x04, 0)
    bench.sent.clear()
    bench.wait(20)
    assert [frame for _, frame in bench.sent] == [Frame(0x704, b"\0")]
    assert bench.drive.node_id == 4
    assert node(0).node_id == 1
