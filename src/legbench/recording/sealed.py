"""Parquet files in which a flipped bit is noticed, and how they are opened.

Compression alone does not notice it: what does not shrink is stored as it is. Pages carry the
checksums of the format. The footer, which the format does not check, says which bytes are which
column and for which rows; between the last page and the footer, where a reader of Parquet looks at
nothing, stands a seal: a mark and the CRC-32 of all that follows it, as eight hexadecimal digits.
Files of older versions, and those that another program wrote, have no seal: their footer is read
unchecked.
"""

import io
import zlib
from pathlib import Path
from typing import IO, Final

import pyarrow as pa
from pyarrow import parquet

from legbench.errors import RecordingError
from legbench.writing import reason

MARK: Final = b"legbench crc32:"
"""Beginning of a seal; the checksum follows."""
SEAL_BYTES: Final = len(MARK) + 8
MAGIC: Final = b"PAR1"
"""Last bytes of a Parquet file; before them stands the length of the footer, little-endian."""
LENGTH_BYTES: Final = 4
UNREADABLE: Final = (OSError, pa.ArrowException, UnicodeDecodeError)
"""What `opened`, and reading what it opened, raises of a damaged file; in one without a seal the
name of a column may be no text any more."""


def seal(file: IO[bytes]) -> None:
    """Put a seal before the footer of a Parquet file, which is told by no offset and may move."""
    first, footer = _footer(file)
    file.seek(first)
    file.write(_seal_of(footer) + footer)


def sealed_bytes(table: pa.Table) -> bytes:
    """Return a table as a Parquet file; equal tables give equal bytes."""
    buffer = io.BytesIO()
    parquet.write_table(table, buffer, compression="zstd", write_page_checksum=True)
    seal(buffer)
    return buffer.getvalue()


def opened(source: Path | bytes) -> parquet.ParquetFile:
    """Open a Parquet file that is checked against its checksums, where it carries them.

    Raises:
        OSError: it is not there, is no Parquet file, or its footer is not the one that was written.
        pyarrow.ArrowException: its footer means nothing; a damaged page raises when it is read.
    """
    if isinstance(source, bytes):
        _check_footer(io.BytesIO(source))
        return parquet.ParquetFile(pa.BufferReader(source), page_checksum_verification=True)
    with source.open("rb") as file:
        _check_footer(file)
    return parquet.ParquetFile(str(source), page_checksum_verification=True)


def damaged(path: Path, error: Exception) -> RecordingError:
    """Return the error of a damaged archive of samples, which says what helps."""
    return RecordingError(
        f"{path} is damaged: {reason(error)}; bring it back from a copy of the run, or run its "
        "experiment again"
    )


def require_every_row(found: int, told: int) -> None:
    """Refuse rows that end early, as at a page whose kind is none, before those of the footer.

    A reader of Parquet leaves the rest out without a word, if it reads one column, or in batches.

    Raises:
        OSError: there are others than were told.
    """
    if found != told:
        raise OSError(f"it gave back {found} of {told} rows")


def _check_footer(file: IO[bytes]) -> None:
    """Compare the footer of a file with its seal, if it has one; raises OSError."""
    first, footer = _footer(file)
    file.seek(max(0, first - SEAL_BYTES))
    found = file.read(SEAL_BYTES)
    if found.startswith(MARK) and found != _seal_of(footer):
        raise OSError("its footer does not match its checksum")


def _seal_of(footer: bytes) -> bytes:
    return MARK + b"%08x" % zlib.crc32(footer)


def _footer(file: IO[bytes]) -> tuple[int, bytes]:
    """Place of the footer of a Parquet file, and its bytes to the end of the file."""
    tail = LENGTH_BYTES + len(MAGIC)
    end = file.seek(0, io.SEEK_END)
    file.seek(max(0, end - tail))
    told = file.read()
    first = end - tail - int.from_bytes(told[:LENGTH_BYTES], "little")
    if told[LENGTH_BYTES:] != MAGIC or first < len(MAGIC):
        raise OSError("it does not end as a Parquet file does")
    file.seek(first)
    return first, file.read()
