"""Every frame of SDO transfers against the bit fields of CiA 301, 7.2.4.3, both sides alone.

A client and a server of one hand may agree on a wrong frame; here each talks to a transcript
that was built from the tables of the standard.
"""

import random

import pytest

from legbench.drives.errors import CodecError, SdoAbortError
from legbench.drives.protocol.datatypes import DataType
from legbench.drives.protocol.sdo import Abort
from legbench.drives.protocol.sdo_client import Download, Progress, Upload
from legbench.drives.protocol.sdo_server import SdoServer

INDEX, SUB = 0x2345, 0x67
MUX = bytes.fromhex("452367")
EMPTY = bytes(7)
LENGTHS = (1, 2, 3, 4, 5, 6, 7, 8, 13, 14, 15, 21, 22, 889, 65_536)
Exchange = list[tuple[bytes, bytes]]
"""Request and reply of each step."""


def content(length: int) -> bytes:
    return random.Random(length).randbytes(length)


def segments(data: bytes) -> list[tuple[int, int, bytes]]:
    """Toggle bit, bits n and c of the command, and the seven bytes of each segment."""
    parts = [data[start : start + 7] for start in range(0, len(data), 7)] or [b""]
    last = len(parts) - 1
    return [
        (place % 2, 2 * (7 - len(part)) + (place == last), part.ljust(7, b"\0"))
        for place, part in enumerate(parts)
    ]


def upload(data: bytes) -> Exchange:
    """Reading an object: ccs 2 and 3, scs 2 and 0."""
    begin = bytes((0b010_00000,)) + MUX + bytes(4)
    if 1 <= len(data) <= 4:
        command = 0b010_0_00_1_1 + 4 * (4 - len(data))
        return [(begin, bytes((command,)) + MUX + data.ljust(4, b"\0"))]
    told = bytes((0b010_0_00_0_1,)) + MUX + len(data).to_bytes(4, "little")
    rest = [
        (bytes((0b011_0_0000 + 16 * toggle,)) + EMPTY, bytes((16 * toggle + bits,)) + part)
        for toggle, bits, part in segments(data)
    ]
    return [(begin, told), *rest]


def download(data: bytes) -> Exchange:
    """Writing an object: ccs 1 and 0, scs 3 and 1."""
    done = bytes((0b011_00000,)) + MUX + bytes(4)
    if len(data) <= 4:
        command = 0b001_0_00_1_1 + 4 * (4 - len(data))
        return [(bytes((command,)) + MUX + data.ljust(4, b"\0"), done)]
    begin = bytes((0b001_0_00_0_1,)) + MUX + len(data).to_bytes(4, "little")
    rest = [
        (bytes((16 * toggle + bits,)) + part, bytes((0b001_0_0000 + 16 * toggle,)) + EMPTY)
        for toggle, bits, part in segments(data)
    ]
    return [(begin, done), *rest]


def abort(code: int, mux: bytes = MUX) -> bytes:
    """Cs 4, the object and the code."""
    return bytes((0b100_00000,)) + mux + code.to_bytes(4, "little")


class Object:
    """The one object behind a server."""

    def __init__(self, data: bytes = b"") -> None:
        self.data = data
        self.writes: list[bytes] = []
        self.server = SdoServer(lambda index, sub: self.data, self._write)

    def _write(self, index: int, sub: int, data: bytes) -> None:
        assert (index, sub) == (INDEX, SUB)
        self.writes.append(data)


@pytest.mark.parametrize("length", [0, *LENGTHS])
def test_reading_is_the_transcript_on_both_sides(length: int) -> None:
    exchange = upload(content(length))
    transfer, held = Upload(INDEX, SUB), Object(content(length))
    for step, (request, reply) in enumerate(exchange, start=1):
        assert transfer.request == request
        assert held.server.feed(request) == reply
        done = step == len(exchange)
        assert transfer.feed(reply) is (Progress.DONE if done else Progress.NEXT)
    assert transfer.result == content(length)


@pytest.mark.parametrize("length", LENGTHS)
def test_writing_is_the_transcript_on_both_sides(length: int) -> None:
    exchange = download(content(length))
    transfer, held = Download(INDEX, SUB, content(length)), Object()
    for step, (request, reply) in enumerate(exchange, start=1):
        assert transfer.request == request
        assert held.writes == []
        assert held.server.feed(request) == reply
        done = step == len(exchange)
        assert transfer.feed(reply) is (Progress.DONE if done else Progress.NEXT)
    assert held.writes == [content(length)]


def test_sizes_may_be_left_out() -> None:
    # Bit s clear: an expedited transfer carries four bytes, a segmented one ends with its bit c.
    transfer, held = Upload(INDEX, SUB), Object()
    assert transfer.feed(bytes((0b010_0_11_1_0,)) + MUX + b"1234") is Progress.DONE
    assert transfer.result == b"1234"
    held.server.feed(bytes((0b001_0_11_1_0,)) + MUX + b"1234")
    assert held.writes == [b"1234"]
    transfer, held = Upload(INDEX, SUB), Object()
    assert transfer.feed(bytes((0b010_0_00_0_0,)) + MUX + b"\xff" * 4) is Progress.NEXT
    assert transfer.feed(upload(b"12345")[1][1]) is Progress.DONE
    assert transfer.result == b"12345"
    assert (
        held.server.feed(bytes((0b001_0_00_0_0,)) + MUX + b"\xff" * 4) == download(b"12345")[0][1]
    )
    held.server.feed(download(b"12345")[1][0])
    assert held.writes == [b"12345"]


def given_up(transfer: Upload | Download, reply: bytes, code: Abort, answer: bytes) -> None:
    """A reply ends a transfer with an error, and with an answer to the drive."""
    with pytest.raises(SdoAbortError) as caught:
        transfer.feed(reply)
    assert caught.value.code == code
    assert transfer.request == answer


def test_a_transfer_is_longer_than_64_kib_on_neither_side() -> None:
    whole, long = (65_536).to_bytes(4, "little"), (65_537).to_bytes(4, "little")
    memory = abort(Abort.OUT_OF_MEMORY)
    assert Upload(INDEX, SUB).feed(b"\x41" + MUX + whole) is Progress.NEXT
    given_up(Upload(INDEX, SUB), b"\x41" + MUX + long, Abort.OUT_OF_MEMORY, memory)
    assert Object().server.feed(b"\x21" + MUX + whole) == b"\x60" + MUX + bytes(4)
    assert Object().server.feed(b"\x21" + MUX + long) == memory
    # 9362 segments hold two bytes less than the limit, the next may hold two.
    for more, kept in ((2, True), (3, False)):
        transfer, held = Upload(INDEX, SUB), Object()
        transfer.feed(b"\x40" + MUX + bytes(4))
        held.server.feed(b"\x20" + MUX + bytes(4))
        for place in range(9362):
            segment = bytes((16 * (place % 2),)) + EMPTY
            assert transfer.feed(segment) is Progress.NEXT
            assert held.server.feed(segment) is not None
        last = bytes((2 * (7 - more) + 1,)) + EMPTY
        if kept:
            assert transfer.feed(last) is Progress.DONE
            held.server.feed(last)
            assert [len(data) for data in held.writes] == [65_536]
        else:
            given_up(transfer, last, Abort.OUT_OF_MEMORY, memory)
            assert held.server.feed(last) == memory
            assert held.writes == []


def test_replies_of_another_service_are_not_taken_for_an_answer() -> None:
    specifiers = range(256)
    for specifier in specifiers:
        reply = bytes((specifier,)) + MUX + bytes(4)
        if specifier == 0x80:
            continue
        reading = Upload(INDEX, SUB).feed(reply)
        assert (reading is Progress.IGNORED) == (specifier >> 5 != 2)
        expedited = Download(INDEX, SUB, b"1").feed(reply)
        assert expedited is (Progress.DONE if specifier == 0x60 else Progress.IGNORED)
        segmented = Download(INDEX, SUB, bytes(5)).feed(reply)
        assert segmented is (Progress.NEXT if specifier == 0x60 else Progress.IGNORED)
    for specifier in specifiers:
        if specifier == 0x80:
            continue
        transfer, writing = Upload(INDEX, SUB), Download(INDEX, SUB, bytes(20))
        transfer.feed(upload(bytes(20))[0][1])
        writing.feed(download(bytes(20))[0][1])
        if specifier >> 5 != 0:
            assert transfer.feed(bytes((specifier,)) + EMPTY) is Progress.IGNORED
        if specifier >> 5 != 1:
            assert writing.feed(bytes((specifier,)) + EMPTY) is Progress.IGNORED


def test_an_abort_of_the_drive_ends_a_transfer_at_every_step() -> None:
    for transfer, exchange in (
        (Upload(INDEX, SUB), upload(bytes(20))),
        (Download(INDEX, SUB, bytes(20)), download(bytes(20))),
    ):
        for _, reply in exchange[:-1]:
            for other in (bytes.fromhex("452366"), bytes.fromhex("462367")):
                assert transfer.feed(abort(Abort.GENERAL, other)) is Progress.IGNORED
            transfer.feed(reply)
        given_up(transfer, abort(Abort.HARDWARE), Abort.HARDWARE, b"")


def test_a_toggle_bit_that_stands_still_ends_a_transfer() -> None:
    for steps in (1, 2):
        for transfer, exchange in (
            (Upload(INDEX, SUB), upload(bytes(30))),
            (Download(INDEX, SUB, bytes(30)), download(bytes(30))),
        ):
            for _, reply in exchange[:steps]:
                transfer.feed(reply)
            wrong = bytes((exchange[steps][1][0] ^ 0x10,)) + exchange[steps][1][1:]
            given_up(transfer, wrong, Abort.TOGGLE, abort(Abort.TOGGLE))
        for exchange, held in (
            (upload(bytes(30)), Object(bytes(30))),
            (download(bytes(30)), Object()),
        ):
            for request, _ in exchange[:steps]:
                held.server.feed(request)
            wrong = bytes((exchange[steps][0][0] ^ 0x10,)) + exchange[steps][0][1:]
            assert held.server.feed(wrong) == abort(Abort.TOGGLE)
            # Nothing is left of the transfer.
            assert held.server.feed(exchange[steps][0]) == abort(Abort.COMMAND)


def test_a_size_that_is_not_kept_is_refused_on_both_sides() -> None:
    for told in (4, 6):
        size = told.to_bytes(4, "little")
        transfer, held = Upload(INDEX, SUB), Object()
        transfer.feed(b"\x41" + MUX + size)
        last = upload(b"12345")[1][1]
        given_up(transfer, last, Abort.TYPE_LENGTH, abort(Abort.TYPE_LENGTH))
        held.server.feed(b"\x21" + MUX + size)
        assert held.server.feed(download(b"12345")[1][0]) == abort(Abort.TYPE_LENGTH)
        assert held.writes == []


def test_a_server_aborts_what_it_does_not_know_and_forgets_what_ran() -> None:
    for command in range(8):
        request = bytes((command << 5,)) + MUX + bytes(4)
        held = Object(bytes(20))
        held.server.feed(upload(bytes(20))[0][0])
        if command >= 5:
            assert held.server.feed(request) == abort(Abort.COMMAND)
        elif command == 4:
            assert held.server.feed(request) is None
        if command >= 4:
            assert held.server.feed(upload(bytes(20))[1][0]) == abort(Abort.COMMAND)
    # A transfer that is over, or begun anew, has toggle bit 0 again.
    held = Object(bytes(30))
    for _ in range(2):
        for request, reply in upload(bytes(30))[:3]:
            assert held.server.feed(request) == reply
    for request, reply in (*upload(bytes(30)), *download(bytes(30)), *upload(bytes(30))):
        assert held.server.feed(request) == reply
    for request in (upload(bytes(30))[1][0], download(bytes(30))[1][0]):
        assert held.server.feed(request) == abort(Abort.COMMAND)


def test_frames_of_another_length_are_answered_by_neither_side() -> None:
    exchange = upload(bytes(20))
    for length in (*range(8), 9):
        data = exchange[0][0].ljust(9, b"\0")[:length]
        assert Object(bytes(20)).server.feed(data) is None
        assert Upload(INDEX, SUB).feed(exchange[0][1].ljust(9, b"\0")[:length]) is Progress.IGNORED


def test_a_write_that_the_object_refuses_is_aborted_with_its_reason() -> None:
    def refuse(index: int, sub: int, data: bytes) -> None:
        raise SdoAbortError(Abort.TOO_HIGH, index, sub, "")

    server = SdoServer(lambda index, sub: bytes(5), refuse)
    assert server.feed(download(b"1")[0][0]) == abort(Abort.TOO_HIGH)
    for request, _ in download(bytes(9))[:-1]:
        server.feed(request)
    assert server.feed(download(bytes(9))[-1][0]) == abort(Abort.TOO_HIGH)


def test_four_bytes_for_a_shorter_number_repeat_its_sign_or_are_zero() -> None:
    expedited = {True: 0b010_0_00_1_1, False: 0b010_0_00_1_0}
    for content, kind, sized, value in (
        ("05000000", DataType.INTEGER8, True, 5),
        ("FB000000", DataType.INTEGER8, True, -5),
        ("FBFFFFFF", DataType.INTEGER8, True, -5),
        ("FFFEFFFF", DataType.INTEGER16, True, -257),
        ("05FFFFFF", DataType.INTEGER8, True, None),
        ("FBFFFF00", DataType.INTEGER8, True, None),
        ("00FFFFFF", DataType.INTEGER8, True, None),
        ("05010000", DataType.UNSIGNED8, True, None),
        # Without a size the rest of the frame means nothing.
        ("05FFFFFF", DataType.INTEGER8, False, 5),
        ("05010000", DataType.UNSIGNED8, False, 5),
    ):
        whole = Upload(INDEX, SUB)
        data = bytes.fromhex(content)
        assert whole.feed(bytes((expedited[sized],)) + MUX + data) is Progress.DONE
        transfers = [whole]
        if sized:
            # In a segment the four bytes are the object's, too.
            transfers.append(Upload(INDEX, SUB))
            transfers[1].feed(b"\x41" + MUX + (4).to_bytes(4, "little"))
            assert transfers[1].feed(b"\x07" + data + bytes(3)) is Progress.DONE
        for transfer in transfers:
            if value is None:
                with pytest.raises(CodecError, match="4 bytes are no"):
                    transfer.value(kind)
            else:
                assert transfer.value(kind) == value


def test_a_segment_before_any_object_is_aborted_for_no_object() -> None:
    nothing = bytes(3)
    for request in (b"\x00" + EMPTY, b"\x60" + EMPTY):
        assert Object().server.feed(request) == abort(Abort.COMMAND, nothing)
