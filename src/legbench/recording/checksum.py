"""Checksums inside the batches of a stream, by which bytes that have rotted are noticed.

Each batch carries two texts in its Arrow metadata: `crc32:` with eight hexadecimal digits, the
CRC-32 of the batch's own message with those digits at zero, and `schema:` with the CRC-32 of the
message that opens the stream. Readers of Arrow that do not know them pass them over. Older streams
have none, and are read unchecked.
"""

import zlib
from typing import Final, final

import pyarrow as pa
from pyarrow import ipc

BATCH, SCHEMA = b"crc32:", b"schema:"
"""Beginnings of the two texts; a batch's header holds no other letters."""
DIGITS: Final = 8
BLANK: Final = b"0" * DIGITS
PREFIX: Final = 8
"""Bytes before the header of a message: continuation and length, which no checksum covers since
a reader that is misled by them reads other bytes."""
CHECKED_KEY: Final = b"legbench_checksum"
"""Key of the schema's metadata that says how batches are checked."""
CHECKED: Final = {CHECKED_KEY: b"crc32"}


def blank_checksums(opening: bytes | memoryview) -> dict[str, str]:
    """Metadata of a batch of the stream with this opening, its own checksum not yet filled in."""
    said = SCHEMA + b"%08x" % zlib.crc32(opening)
    return {"crc32": (BATCH + BLANK).decode(), "schema": said.decode()}


@final
class Sealer:
    """Fills in the checksum of one message, over and over as its numbers change."""

    def __init__(self, message: bytearray) -> None:
        """Take a message whose metadata is that of `blank_checksums`."""
        self._message = message
        self._content = memoryview(message)[PREFIX:]
        at = message.index(BATCH) + len(BATCH)
        self._digits = slice(at, at + DIGITS)

    def seal(self) -> None:
        """Compute the checksum of the message as it is now and write it into its metadata."""
        self._message[self._digits] = BLANK
        self._message[self._digits] = b"%08x" % zlib.crc32(self._content)


@final
class Checker:
    """Checks the messages of one stream against the checksums that they carry.

    Attributes:
        opening_damaged: whether a whole batch says that the stream was opened by another schema.
    """

    def __init__(self, opening: bytes, schema: pa.Schema) -> None:
        """Begin with the bytes of the message that opens the stream, and what they mean."""
        self._opening = b"%08x" % zlib.crc32(opening)
        self._expected = CHECKED_KEY in (schema.metadata or {})
        self.opening_damaged = False

    def whole(self, message: ipc.Message) -> bool:
        """Whether a batch is as it was written; one of an older stream is taken for whole."""
        header = message.metadata.to_pybytes()
        found = header.find(BATCH)
        if found < 0:
            return not self._expected and SCHEMA not in header
        first = found + len(BATCH)
        stop = first + DIGITS
        computed = zlib.crc32(header[:first] + BLANK + header[stop:])
        if message.body is not None:
            computed = zlib.crc32(message.body, computed)
        if header[first:stop] != b"%08x" % computed:
            return False
        at = header.find(SCHEMA) + len(SCHEMA)
        self.opening_damaged |= header[at : at + DIGITS] != self._opening
        return True
