"""A CAN adapter on a serial line, bytes in, bytes out; pure."""

from typing import final

from legbench.drives.emulated.network import Network
from legbench.drives.emulated.station import Station
from legbench.drives.errors import BusError
from legbench.drives.protocol.slcan import (
    BITRATES,
    OK,
    REFUSED,
    bitrate_of_registers,
    format_frame,
    parse_frame,
)

LONGEST = 32
"""Longest line that is kept [characters]; an extended frame has 27, longer lines are garbage."""
WARNING, PASSIVE_FLAG, BUS_ERROR = 1 << 2, 1 << 5, 1 << 7
"""Status flags in the answer to the command `F`."""
ERRORS = ((96, WARNING), (128, PASSIVE_FLAG), (256, BUS_ERROR))
"""Pairs of an error count and the flag that is shown from this count on."""


@final
class SlcanAdapter:
    """One adapter, plugged into an emulated network while its channel is open.

    Attributes:
        bitrate: bitrate set by the computer, none before [bit/s].
        openings: number of times that the channel was opened.
    """

    def __init__(self, network: Network) -> None:
        self._network = network
        self._station: Station | None = None
        self._line = bytearray()
        self.bitrate: int | None = None
        self.openings = 0

    def feed(self, chunk: bytes) -> bytes:
        """Take bytes of the computer; returns the answers to the lines that they complete."""
        answers = b""
        for byte in chunk:
            if byte != OK[0]:
                self._line.append(byte)
                if len(self._line) > LONGEST:
                    self._line.clear()
                    answers += REFUSED
                continue
            line = self._line.decode("ascii", "replace")
            self._line.clear()
            answers += self._obey(line)
        return answers

    def take(self) -> bytes:
        """Lines of the frames that were received since the last call."""
        station, lines = self._station, b""
        while station is not None and station.received:
            frame = station.received.popleft().frame
            # An error frame has no line; the flags of `F` report it.
            if not frame.error:
                lines += format_frame(frame)
        return lines

    def close(self) -> None:
        """Leave the network."""
        if self._station is not None:
            self._network.detach(self._station)
            self._station = None

    def _obey(self, line: str) -> bytes:
        kind = line[:1]
        if kind in ("t", "T", "r", "R") and line:
            return self._transmit(line)
        if kind in ("O", "L") and len(line) == 1:
            return self._open(listen_only=kind == "L")
        if kind in ("S", "s"):
            return self._set_bitrate(line)
        if line == "C":
            was_open = self._station is not None
            self.close()
            return OK if was_open else REFUSED
        plain = {"": OK, "V": b"V1013\r", "N": b"NLEGB\r", "Z0": OK, "X0": OK, "X1": OK}
        return self._flags() if line == "F" else plain.get(line, REFUSED)

    def _set_bitrate(self, line: str) -> bytes:
        rate = BITRATES.get(line) if line[0] == "S" else bitrate_of_registers(line[1:])
        if rate is None or self._station is not None:
            return REFUSED
        self.bitrate = rate
        return OK

    def _open(self, *, listen_only: bool) -> bytes:
        if self.bitrate is None or self._station is not None:
            return REFUSED
        self._station = self._network.attach(bitrate=self.bitrate, listen_only=listen_only)
        self.openings += 1
        return OK

    def _transmit(self, line: str) -> bytes:
        frame, station = parse_frame(line), self._station
        if frame is None or station is None or station.listen_only:
            return REFUSED
        try:
            self._network.send(station, frame)
        except BusError:
            return REFUSED
        return OK

    def _flags(self) -> bytes:
        if self._station is None:
            return REFUSED
        errors = self._network.level(self._station)
        flags = sum(flag for count, flag in ERRORS if errors >= count)
        return f"F{flags:02X}\r".encode()
