"""Serves an emulated bus to other processes, paced by the machine's clock."""

import os
import select
import socket
import stat
import time
from collections.abc import Callable
from pathlib import Path
from typing import final

from legbench.closing import Closing
from legbench.drives.emulated.network import Network
from legbench.drives.emulated.pacer import Pacer
from legbench.drives.emulated.station import Station
from legbench.drives.errors import BusError
from legbench.drives.transport.unix_bus import PACKET, opened_at, pack_frame, unpack_frame


@final
class UnixServer(Closing):
    """One emulated bus behind a socket file, any number of masters and listeners on it."""

    def __init__(
        self, network: Network, path: Path, now_ns: Callable[[], int] = time.monotonic_ns
    ) -> None:
        """Make the socket file.

        Raises:
            BusError: it cannot be made, or somebody serves there already.
        """
        self.network, self.path = network, path
        self._listener = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        try:
            self._replace_dead(path)
            self._listener.bind(str(path))
            self._listener.listen()
        except OSError as error:
            self._listener.close()
            raise BusError(f"cannot serve a bus at {path}: {error.strerror or error}") from None
        self._stations: dict[socket.socket, Station] = {}
        self._pacer = Pacer(network, now_ns)

    @staticmethod
    def _replace_dead(path: Path) -> None:
        """Remove a socket file that no process serves any more."""
        if not (path.exists() and stat.S_ISSOCK(path.stat().st_mode)):
            return
        with socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET) as probe:
            try:
                probe.connect(str(path))
            except ConnectionRefusedError:
                path.unlink()

    def poll(self) -> None:
        """Wait a moment for frames, pass them on and advance virtual time."""
        ready, _, _ = select.select([self._listener, *self._stations], [], [], self._pacer.wait_s())
        self._pacer.advance()
        for one in ready:
            if one is self._listener:
                client, _ = self._listener.accept()
                client.setblocking(False)
                self._stations[client] = self.network.attach()
            else:
                self._take(one)
        for client, station in tuple(self._stations.items()):
            self._give(client, station)

    def _take(self, client: socket.socket) -> None:
        while True:
            try:
                packet = client.recv(PACKET.size + 1)
            except BlockingIOError:
                return
            except OSError:
                packet = b""
            if not packet:
                self._drop(client)
                return
            frame = unpack_frame(packet)
            if frame is None:
                continue
            bitrate = opened_at(frame)
            if bitrate is not None:
                self.network.detach(self._stations[client])
                self._stations[client] = self.network.attach(bitrate=bitrate)
                continue
            try:
                self.network.send(self._stations[client], frame)
            except BusError:
                # A full queue or bus-off loses the frame, as on a real bus.
                continue

    def _give(self, client: socket.socket, station: Station) -> None:
        while station.received:
            _, frame = station.received.popleft()
            try:
                client.send(pack_frame(frame))
            except BlockingIOError:
                continue
            except OSError:
                self._drop(client)
                return

    def _drop(self, client: socket.socket) -> None:
        self.network.detach(self._stations.pop(client))
        client.close()

    def close(self) -> None:
        """Disconnect everybody and remove the socket file; may be called twice."""
        for client in tuple(self._stations):
            self._drop(client)
        if self._listener.fileno() >= 0:
            self._listener.close()
            if self.path.exists():
                os.unlink(self.path)
