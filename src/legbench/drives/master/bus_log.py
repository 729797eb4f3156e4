"""Raw frames in candump's log format, written beside the telemetry."""

from pathlib import Path
from typing import final

import can

from legbench.closing import Closing
from legbench.drives.errors import BusError

FLUSH_FRAMES = 500
"""Number of frames between two flushes of the log: about 100 ms of a busy bus."""
ERROR_FLAG, BUS_ERROR = 0x20000000, 0x80
"""Bits of SocketCAN's error frames: that one is an error frame, and that a bus error is among its
reasons. python-can's reader takes what lacks either of them for data."""


def line_of(message: can.Message, channel: str) -> str:
    """The line of a frame in candump's format, its end included."""
    if message.is_error_frame:
        name = f"{ERROR_FLAG | BUS_ERROR | message.arbitration_id:08X}"
    else:
        width = 8 if message.is_extended_id else 3
        name = f"{message.arbitration_id:0{width}X}"
    data = f"R{message.dlc}" if message.is_remote_frame else message.data.hex().upper()
    return f"({message.timestamp:.6f}) {channel} {name}#{data}\n"


@final
class BusLog(Closing):
    """A listener for `Port` that appends lines such as `(0.001055) can0 080#`.

    `canplayer`, `cansniffer` and python-can's `CanutilsLogReader` read it. A disk that fails ends
    the log, never the cycle; `error` then says why.
    """

    def __init__(self, path: Path, channel: str) -> None:
        """Create the log.

        Raises:
            BusError: it cannot be written.
        """
        self._channel = "".join(letter for letter in channel if letter.isalnum()) or "can"
        self.error: str | None = None
        self._lines: list[str] = []
        try:
            self._file = path.open("x", encoding="ascii")
        except OSError as error:
            raise BusError(f"{path}: cannot write a bus log: {error.strerror}") from None

    def __call__(self, message: can.Message) -> None:
        """Add one frame to the log."""
        self._lines.append(line_of(message, self._channel))
        if len(self._lines) >= FLUSH_FRAMES:
            self._flush()

    def _flush(self) -> None:
        lines, self._lines = self._lines, []
        if self.error is None:
            try:
                self._file.writelines(lines)
                self._file.flush()
            except OSError as error:
                self.error = error.strerror or str(error)

    def close(self) -> None:
        """Write what waits; may be called twice, never raises."""
        if self._file.closed:
            return
        self._flush()
        try:
            self._file.close()
        except OSError as error:
            self.error = self.error or error.strerror
