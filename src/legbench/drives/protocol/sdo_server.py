"""The drive's side of SDO transfers, frame by frame."""

from collections.abc import Callable
from enum import Enum
from typing import final

from legbench.drives.errors import SdoAbortError
from legbench.drives.protocol.sdo import (
    EXPEDITED,
    FRAME,
    MAX_TRANSFER,
    MUX,
    SEGMENT,
    SIZE,
    Abort,
    abort_data,
)

Reader = Callable[[int, int], bytes]
"""Bytes of an object by index and sub-index; raises SdoAbortError."""
Writer = Callable[[int, int, bytes], None]
"""Take the bytes of an object; raises SdoAbortError."""

LEFT_OVER = b"\xa5"
"""Filler behind objects in answers without a size."""


class SdoAnswers(Enum):
    """Ways in which a drive answers for an object of one to three bytes."""

    SIZED = "sized"
    """Answers are as long as the object, as the standard says."""
    FOUR_BYTES = "four bytes"
    """All answers have four bytes, with zeros behind the object."""
    UNSIZED = "without size"
    """No size is told; what follows the object is left over from another answer."""


@final
class SdoServer:
    """Answers one client; a request that makes no sense is aborted and changes nothing."""

    def __init__(self, read: Reader, write: Writer, answers: SdoAnswers = SdoAnswers.SIZED) -> None:
        """Answer for the objects behind `read` and `write`; short ones in the way of `answers`."""
        self._read, self._write, self._answers = read, write, answers
        self._object = (0, 0)
        self._toggle = 0
        self._to_send: memoryview | None = None
        self._to_take: bytearray | None = None
        self._size: int | None = None

    def feed(self, data: bytes) -> bytes | None:
        """Take a request; returns the answer, none where the protocol has none."""
        if len(data) != FRAME:
            return None
        command = data[0] >> 5
        try:
            if command == 1:
                return self._download(data)
            if command == 2:
                return self._upload(data)
            if command == 0:
                return self._download_segment(data)
            if command == 3:
                return self._upload_segment(data)
        except SdoAbortError as error:
            self._forget()
            return abort_data(error.code, *self._object)
        self._forget()
        if command == 4:
            return None
        _, index, sub = MUX.unpack_from(data)
        return abort_data(Abort.COMMAND, index, sub)

    def _forget(self) -> None:
        self._to_send = self._to_take = self._size = None
        self._toggle = 0

    def _begin(self, data: bytes) -> None:
        _, index, sub = MUX.unpack_from(data)
        self._forget()
        self._object = (index, sub)

    def _stop(self, code: Abort) -> SdoAbortError:
        return SdoAbortError(code, *self._object, "")

    def _upload(self, data: bytes) -> bytes:
        self._begin(data)
        content = self._read(*self._object)
        if 0 < len(content) <= EXPEDITED:
            return self._short(content)
        self._to_send = memoryview(content)
        return MUX.pack(0x41, *self._object) + SIZE.pack(len(content))

    def _short(self, content: bytes) -> bytes:
        """The answer with an object of one to four bytes."""
        if self._answers is SdoAnswers.SIZED:
            specifier = 0x43 | (EXPEDITED - len(content)) << 2
            return MUX.pack(specifier, *self._object) + content.ljust(EXPEDITED, b"\0")
        if self._answers is SdoAnswers.UNSIZED:
            return MUX.pack(0x42, *self._object) + content.ljust(EXPEDITED, LEFT_OVER)
        return MUX.pack(0x43, *self._object) + content.ljust(EXPEDITED, b"\0")

    def _upload_segment(self, data: bytes) -> bytes:
        if self._to_send is None:
            raise self._stop(Abort.COMMAND)
        if data[0] >> 4 & 1 != self._toggle:
            raise self._stop(Abort.TOGGLE)
        part, left = bytes(self._to_send[:SEGMENT]), self._to_send[SEGMENT:]
        specifier = self._toggle << 4 | (SEGMENT - len(part)) << 1 | (not left)
        if left:
            self._to_send = left
            self._toggle ^= 1
        else:
            self._forget()
        return bytes((specifier,)) + part.ljust(SEGMENT, b"\0")

    def _download(self, data: bytes) -> bytes:
        self._begin(data)
        specifier = data[0]
        if specifier & 2:
            length = EXPEDITED - (specifier >> 2 & 3) if specifier & 1 else EXPEDITED
            self._write(*self._object, data[4 : 4 + length])
        else:
            if specifier & 1:
                self._size = size = int(SIZE.unpack_from(data, 4)[0])
                if size > MAX_TRANSFER:
                    raise self._stop(Abort.OUT_OF_MEMORY)
            self._to_take = bytearray()
        return MUX.pack(0x60, *self._object) + bytes(4)

    def _download_segment(self, data: bytes) -> bytes:
        taken, toggle = self._to_take, self._toggle
        if taken is None:
            raise self._stop(Abort.COMMAND)
        if data[0] >> 4 & 1 != toggle:
            raise self._stop(Abort.TOGGLE)
        taken += data[1 : 1 + SEGMENT - (data[0] >> 1 & 7)]
        if len(taken) > MAX_TRANSFER:
            raise self._stop(Abort.OUT_OF_MEMORY)
        if data[0] & 1:
            if self._size is not None and self._size != len(taken):
                raise self._stop(Abort.TYPE_LENGTH)
            self._forget()
            self._write(*self._object, bytes(taken))
        else:
            self._toggle ^= 1
        return bytes((0x20 | toggle << 4,)) + bytes(7)
