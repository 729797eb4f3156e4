"""Raw frames in candump's log format, beside the telemetry."""

from typing import final

import can

from legbench.closing import Closing
from legbench.recording.abstract_disk import AbstractLog

LOG_FAILED = "bus log not written"
"""Event of a run whose log ends before it does."""
ERROR_FLAG, BUS_ERROR = 0x20000000, 0x80
"""Bits of SocketCAN's error frames: that one is an error frame, and that a bus error is among its
reasons. python-can's reader takes what lacks either of them for data."""


@final
class BusLog(Closing):
    """A listener for `Port` that writes lines such as `(0.001055) can0 080#` to a log of the run.

    `canplayer`, `cansniffer` and python-can's `CanutilsLogReader` read it. Its disk neither holds
    up a cycle nor ends one: where it fails, the log ends, and `error` says why.
    """

    def __init__(self, log: AbstractLog, channel: str) -> None:
        """Begin; the log is closed with this one."""
        self._channel = "".join(letter for letter in channel if letter.isalnum()) or "can"
        self._log, self._write = log, log.write

    @property
    def error(self) -> str | None:
        """Why frames are missing at the end of the log, None if none are."""
        return self._log.error

    def __call__(self, message: can.Message) -> None:
        """Add one frame to the log."""
        if message.is_error_frame:
            name = f"{ERROR_FLAG | BUS_ERROR | message.arbitration_id:08X}"
        elif message.is_extended_id:
            name = f"{message.arbitration_id:08X}"
        else:
            name = f"{message.arbitration_id:03X}"
        data = f"R{message.dlc}" if message.is_remote_frame else message.data.hex().upper()
        self._write(f"({message.timestamp:.6f}) {self._channel} {name}#{data}\n".encode())

    def close(self) -> None:
        """Wait until every frame is written or lost; may be called twice, never raises."""
        self._log.close()
