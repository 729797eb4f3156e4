"""Frames of a log of a bus, in any of the formats that python-can reads."""

import os
import struct
import zlib
from collections.abc import Iterator
from itertools import chain, islice
from pathlib import Path
from typing import IO, Final, final

import can
from can.io.blf import BLFParseError

from legbench.errors import RecordingError
from legbench.replay.log_names import SUFFIXES, is_log
from legbench.writing import reason

BLF_HEAD: Final = 144
"""Length of the header of a .blf [bytes]."""
HEAD: Final = 20_000
"""Number of frames by which the channel of a log is chosen: some seconds of a busy bus."""
UNREADABLE: Final = (
    ValueError,  # a number or a header that is none; text that is no UTF-8
    LookupError,  # a line that lacks a field
    TypeError,  # a frame without its time
    AttributeError,  # a line that fits no pattern
    ArithmeticError,
    EOFError,
    struct.error,
    zlib.error,
    can.CanError,
    BLFParseError,
    NotImplementedError,  # a part of a format that python-can does not read
    AssertionError,  # python-can's own check of a header
)
"""Exceptions with which python-can meets what is not of its format; it has none of its own."""


@final
class LogFrames:
    """Frames of classic CAN with data in a log, up to its end or to what cannot be read.

    Iterate it once; then the attributes are final.

    Attributes:
        tear: what is wrong with the rest of the log, none if it could be read to its end.
        left_out: number of error, remote, extended and FD frames.
    """

    def __init__(self, path: Path) -> None:
        """Look at the file.

        Raises:
            RecordingError: it cannot be read, or is no log.
        """
        self._path = path
        self.tear: str | None = None
        self.left_out = self._read = 0
        if not path.exists():
            raise RecordingError(f"{path} does not exist")
        if not path.is_file():
            raise RecordingError(f"{path} is no regular file; give a log of a bus")
        if not is_log(path):
            raise RecordingError(
                f"{path} is no log of a bus by its name; known are {', '.join(SUFFIXES)}"
            )
        try:
            _check_head(path)
            self._reader = can.LogReader(path)
        except UNREADABLE as error:
            raise RecordingError(f"{path} cannot be read as a log: {_told(error)}") from error
        except OSError as error:
            raise RecordingError(f"{path} cannot be read: {reason(error)}") from error

    def __iter__(self) -> Iterator[can.Message]:
        """Yield frames in the order of the log.

        Raises:
            RecordingError: not one frame of it can be read.
        """
        with self._reader as reader:
            try:
                for message in reader:
                    self._read += 1
                    if _plain(message):
                        yield message
                    else:
                        self.left_out += 1
            except UNREADABLE as error:
                self._torn(_told(error))
            except OSError as error:
                self._torn(reason(error))
        if self._read == 0:
            raise RecordingError(f"{self._path} holds no frames: is it a log of a bus?")

    @property
    def place(self) -> tuple[int, int]:
        """How far the file has been read, and its length [bytes]."""
        # Every reader of a file has it, but the type of all readers does not say so.
        file: IO[str] | IO[bytes] = vars(self._reader)["file"]
        descriptor = file.fileno()
        return os.lseek(descriptor, 0, os.SEEK_CUR), os.fstat(descriptor).st_size

    def _torn(self, why: str) -> None:
        if self._read == 0:
            raise RecordingError(f"{self._path} cannot be read as a log: {why}")
        self.tear = f"{self._path.name} cannot be read after {self._read} frames: {why}"


def _check_head(path: Path) -> None:
    """Refuse what does not begin as a .blf does; python-can would leave such a file open.

    Raises:
        ValueError: it does not.
        OSError: it cannot be read.
    """
    if path.suffix.lower() == ".blf":
        with path.open("rb") as file:
            head = file.read(BLF_HEAD)
        if len(head) < BLF_HEAD or not head.startswith(b"LOGG"):
            raise ValueError("it does not begin with LOGG and a header")


def with_head(frames: LogFrames) -> tuple[list[can.Message], Iterator[can.Message]]:
    """Return the first frames of a log to look at, and all of them to go through."""
    rest = iter(frames)
    head = list(islice(rest, HEAD))
    return head, chain(head, rest)


def _plain(message: can.Message) -> bool:
    odd = message.is_error_frame or message.is_remote_frame or message.is_extended_id
    return not (odd or message.is_fd)


def _told(error: Exception) -> str:
    text = " ".join(str(error).split())
    told = text[:80] if text else type(error).__name__
    return f"what stands there has not the form of a frame ({told})"
