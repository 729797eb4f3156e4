"""The master's side of an SDO transfer, frame by frame."""

from enum import Enum
from typing import final

from legbench.drives.errors import CodecError
from legbench.drives.protocol.datatypes import (
    FORMATS,
    DataType,
    Value,
    resized,
    size_of,
    unpack,
)
from legbench.drives.protocol.sdo import (
    EXPEDITED,
    FRAME,
    MAX_TRANSFER,
    MUX,
    SEGMENT,
    SIZE,
    Abort,
    abort_data,
    abort_error,
)

WIDTHS = (1, 2, 4, 8)
"""Lengths of whole numbers [bytes]."""


class Progress(Enum):
    """Effects of a reply on a transfer."""

    IGNORED = "not a reply to this transfer"
    NEXT = "send `request`"
    DONE = "finished"


class _Transfer:
    """Common part of uploads and downloads: the object, aborts, the toggle bit.

    Attributes:
        request: the frame to send next; after an error the abort to send, or empty.
    """

    request: bytes

    def __init__(self, index: int, sub: int) -> None:
        self.index, self.sub = index, sub
        self._toggle = 0
        self._segments = False

    def _refused(self, data: bytes) -> bool:
        """Whether the reply is for somebody else; raises when it ends the transfer."""
        if len(data) != FRAME:
            return True
        specifier, index, sub = MUX.unpack_from(data)
        mine = (index, sub) == (self.index, self.sub)
        if specifier == 0x80:
            if not mine:
                return True
            self.request = b""
            raise abort_error(SIZE.unpack_from(data, 4)[0], index, sub)
        return not self._segments and not mine

    def _abort(self, code: Abort) -> None:
        self.request = abort_data(code, self.index, self.sub)
        raise abort_error(code, self.index, self.sub)


@final
class Upload(_Transfer):
    """Read an object: send `request`, feed replies until done, then look at `result`."""

    def __init__(self, index: int, sub: int = 0) -> None:
        super().__init__(index, sub)
        self.request = MUX.pack(0x40, index, sub) + bytes(4)
        self._size: int | None = None
        self._got = bytearray()
        self._sized = True

    @property
    def result(self) -> bytes:
        """The object's bytes, as they came."""
        return bytes(self._got)

    def value(self, kind: DataType) -> Value:
        """The object's value, from a longer answer or one without a size, too.

        Some drives have whole numbers in a longer type than the standard, and some answer for short
        ones with all four bytes of the frame. What is beyond the type is left out where no size is
        told; where one is, it must repeat the sign, or be zero.

        Raises:
            CodecError: the bytes are none of this type.
        """
        content, size = self.result, size_of(kind)
        if size is None or kind not in FORMATS or len(content) not in WIDTHS:
            return unpack(kind, content)
        value = unpack(kind, content[:size])
        beyond = max(0, len(content) - size)
        padding = {bytes(beyond)}
        if isinstance(value, int) and value < 0:
            padding.add(b"\xff" * beyond)
        if self._sized and content[size:] not in padding:
            return unpack(kind, content)
        return value

    def widened(self, kind: DataType) -> Value:
        """The object's value, from an answer of another length: a shorter number is widened.

        It is taken to have the sign of the type that is asked for, which the bus cannot tell; a
        number that protects something is therefore read by `certain`.

        Raises:
            CodecError: the bytes are none of this type.
        """
        length, size = len(self.result), size_of(kind)
        narrow = resized(kind, length) if size is not None and length < size else None
        return self.value(kind if narrow is None else narrow)

    def certain(self, kind: DataType) -> Value:
        """The object's value as `widened` reads it, where its sign cannot be another.

        Raises:
            CodecError: the bytes are none of this type, or a shorter number is positive in it and
                negative in a type of their own length.
        """
        value, length = self.widened(kind), len(self.result)
        if length < (size_of(kind) or 0) and isinstance(value, int) and value >> 8 * length - 1 > 0:
            raise CodecError(
                f"reads {value} in {length} bytes, or {value - (1 << 8 * length)} if it has a "
                "sign: give it in the drive's type in the bus file"
            )
        return value

    def feed(self, data: bytes) -> Progress:
        """Take a reply.

        Raises:
            SdoAbortError: the drive has aborted, or its reply broke the protocol; if `request`
                is not empty, send it.
        """
        if self._refused(data):
            return Progress.IGNORED
        return self._segment(data) if self._segments else self._initiate(data)

    def _initiate(self, data: bytes) -> Progress:
        specifier = data[0]
        if specifier >> 5 != 2:
            return Progress.IGNORED
        if specifier & 2:
            self._sized = bool(specifier & 1)
            length = EXPEDITED - (specifier >> 2 & 3) if self._sized else EXPEDITED
            self._got += data[4 : 4 + length]
            return Progress.DONE
        if specifier & 1:
            self._size = size = int(SIZE.unpack_from(data, 4)[0])
            if size > MAX_TRANSFER:
                self._abort(Abort.OUT_OF_MEMORY)
        self._segments = True
        self.request = bytes((0x60,)) + bytes(7)
        return Progress.NEXT

    def _segment(self, data: bytes) -> Progress:
        specifier = data[0]
        if specifier >> 5 != 0:
            return Progress.IGNORED
        if specifier >> 4 & 1 != self._toggle:
            self._abort(Abort.TOGGLE)
        self._got += data[1 : 1 + SEGMENT - (specifier >> 1 & 7)]
        if len(self._got) > MAX_TRANSFER:
            self._abort(Abort.OUT_OF_MEMORY)
        if specifier & 1:
            if self._size is not None and self._size != len(self._got):
                self._abort(Abort.TYPE_LENGTH)
            return Progress.DONE
        self._toggle ^= 1
        self.request = bytes((0x60 | self._toggle << 4,)) + bytes(7)
        return Progress.NEXT


@final
class Download(_Transfer):
    """Write an object: send `request`, feed replies until done.

    Raises:
        CodecError: nothing to write, or too much.
    """

    def __init__(self, index: int, sub: int, content: bytes) -> None:
        super().__init__(index, sub)
        if not 0 < len(content) <= MAX_TRANSFER:
            raise CodecError(f"an SDO writes 1 to {MAX_TRANSFER} bytes, not {len(content)}")
        self._left = memoryview(bytes(content))
        self._last = False
        if len(content) <= EXPEDITED:
            specifier = 0x23 | (EXPEDITED - len(content)) << 2
            self.request = MUX.pack(specifier, index, sub) + content.ljust(EXPEDITED, b"\0")
            self._last = True
        else:
            self.request = MUX.pack(0x21, index, sub) + SIZE.pack(len(content))

    def feed(self, data: bytes) -> Progress:
        """Take a reply.

        Raises:
            SdoAbortError: the drive has aborted, or its reply broke the protocol; if `request`
                is not empty, send it.
        """
        if self._refused(data):
            return Progress.IGNORED
        if not self._segments:
            if data[0] != 0x60:
                return Progress.IGNORED
            if self._last:
                return Progress.DONE
            self._segments = True
            return self._send()
        if data[0] >> 5 != 1:
            return Progress.IGNORED
        if data[0] >> 4 & 1 != self._toggle:
            self._abort(Abort.TOGGLE)
        if self._last:
            return Progress.DONE
        self._toggle ^= 1
        return self._send()

    def _send(self) -> Progress:
        part, self._left = bytes(self._left[:SEGMENT]), self._left[SEGMENT:]
        self._last = not self._left
        specifier = self._toggle << 4 | (SEGMENT - len(part)) << 1 | self._last
        self.request = bytes((specifier,)) + part.ljust(SEGMENT, b"\0")
        return Progress.NEXT
