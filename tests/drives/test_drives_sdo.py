import random

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from legbench.drives.errors import CodecError, SdoAbortError
from legbench.drives.protocol.sdo import MAX_TRANSFER, MEANINGS, Abort, abort_data, abort_error
from legbench.drives.protocol.sdo_client import Download, Progress, Upload
from legbench.drives.protocol.sdo_server import SdoServer

LENGTHS = [*range(1, 300), 888, 889, 890, 4096, MAX_TRANSFER]


class Shelf:
    """An object dictionary of one object."""

    def __init__(self, content: bytes = b"") -> None:
        self.content = content
        self.server = SdoServer(self.read, self.write)

    def read(self, index: int, sub: int) -> bytes:
        if (index, sub) != (0x2000, 3):
            raise abort_error(Abort.NO_OBJECT, index, sub)
        return self.content

    def write(self, index: int, sub: int, data: bytes) -> None:
        self.read(index, sub)
        self.content = data


def carry(transfer: Upload | Download, server: SdoServer) -> Progress:
    """Carry frames between both sides until nothing more is to be said."""
    progress = Progress.NEXT
    while progress is Progress.NEXT:
        assert len(transfer.request) == 8
        reply = server.feed(transfer.request)
        assert reply is not None
        assert len(reply) == 8
        progress = transfer.feed(reply)
    return progress


@pytest.mark.parametrize("length", LENGTHS)
def test_every_length_goes_both_ways(length: int) -> None:
    content = random.Random(length).randbytes(length)
    shelf = Shelf()
    assert carry(Download(0x2000, 3, content), shelf.server) is Progress.DONE
    assert shelf.content == content
    upload = Upload(0x2000, 3)
    assert carry(upload, shelf.server) is Progress.DONE
    assert upload.result == content


def test_an_empty_object_can_be_read() -> None:
    upload = Upload(0x2000, 3)
    assert carry(upload, Shelf().server) is Progress.DONE
    assert upload.result == b""


def test_frames_of_the_standard() -> None:
    # CiA 301, 7.2.4.3: expedited download of two bytes, upload of four.
    assert Download(0x6040, 0, b"\x06\x00").request.hex() == "2b40600006000000"
    assert Upload(0x6064, 0).request.hex() == "4064600000000000"
    assert Download(0x2000, 3, b"12345").request.hex() == "2100200305000000"
    shelf = Shelf(b"\x01\x02\x03\x04")
    assert (shelf.server.feed(Upload(0x2000, 3).request) or b"").hex() == "4300200301020304"


@pytest.mark.parametrize("content", [b"", bytes(MAX_TRANSFER + 1)])
def test_what_cannot_be_written_is_refused(content: bytes) -> None:
    with pytest.raises(CodecError, match="an SDO writes 1 to 65536 bytes"):
        Download(0x2000, 3, content)


def test_an_abort_is_raised_in_words() -> None:
    upload = Upload(0x2001, 0)
    with pytest.raises(SdoAbortError, match=r"2001h:00: object does not exist .*06020000h"):
        carry(upload, Shelf().server)
    for code in Abort:
        assert code in MEANINGS
        with pytest.raises(SdoAbortError) as caught:
            Upload(1, 2).feed(abort_data(code, 1, 2))
        assert caught.value.code == code


def test_a_reply_to_another_object_is_ignored() -> None:
    upload = Upload(0x2000, 3)
    for stray in (
        bytes.fromhex("4300200401020304"),
        bytes.fromhex("4301200301020304"),
        abort_data(Abort.GENERAL, 0x2000, 4),
        b"",
        bytes(7),
    ):
        assert upload.feed(stray) is Progress.IGNORED
    assert upload.result == b""


def test_a_wrong_toggle_ends_the_transfer_on_both_sides() -> None:
    shelf = Shelf(bytes(30))
    upload = Upload(0x2000, 3)
    upload.feed(shelf.server.feed(upload.request) or b"")
    first = shelf.server.feed(upload.request) or b""
    upload.feed(first)
    with pytest.raises(SdoAbortError, match="toggle bit"):
        upload.feed(first)
    assert upload.request == abort_data(Abort.TOGGLE, 0x2000, 3)
    assert shelf.server.feed(b"\x60" + bytes(7)) == abort_data(Abort.TOGGLE, 0x2000, 3)


def test_a_size_that_is_not_kept_changes_nothing() -> None:
    shelf = Shelf(b"before")
    assert shelf.server.feed(bytes.fromhex("2100200305000000")) is not None
    reply = shelf.server.feed(bytes.fromhex("0731323300000000"))
    assert reply == abort_data(Abort.TYPE_LENGTH, 0x2000, 3)
    assert shelf.content == b"before"


@settings(derandomize=True, max_examples=50)
@given(st.lists(st.binary(max_size=9), max_size=20))
def test_any_bytes_are_survived_by_the_server(frames: list[bytes]) -> None:
    shelf = Shelf(b"0123456789")
    for data in frames:
        reply = shelf.server.feed(data)
        assert reply is None or len(reply) == 8
    upload = Upload(0x2000, 3)
    assert carry(upload, shelf.server) is Progress.DONE
    assert upload.result == shelf.content


@settings(derandomize=True, max_examples=50)
@given(st.lists(st.binary(max_size=9), max_size=20), st.booleans())
def test_any_bytes_are_survived_by_the_client(frames: list[bytes], write: bool) -> None:
    transfer = Download(0x2000, 3, bytes(20)) if write else Upload(0x2000, 3)
    for data in frames:
        try:
            progress = transfer.feed(data)
        except SdoAbortError:
            break
        if progress is Progress.DONE:
            break
