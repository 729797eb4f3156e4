"""One emulated wire behind a socket file, with whoever hangs on it."""

import os
import select
import socket
import stat
from collections.abc import Collection
from pathlib import Path
from typing import final

from legbench.closing import Closing
from legbench.drives.emulated.error_frames import OVERFLOW_FRAME
from legbench.drives.emulated.network import PASSIVE, Network
from legbench.drives.emulated.station import Heard, Station
from legbench.drives.errors import BusError
from legbench.drives.transport.unix_packet import (
    PACKET,
    Controller,
    opening_of,
    pack_frame,
    unpack_frame,
)

UNREAD = 64
"""Number of frames that wait here for a master who does not read; what comes then is lost to it.

The kernel's queue, about 280 frames, is full before. A longer one would feed a slow reader with
what was true a second ago; SocketCAN's queue of a socket is as long.
"""


@final
class UnixWire(Closing):
    """One emulated network behind a socket file, any number of masters and listeners on it."""

    def __init__(self, network: Network, path: Path) -> None:
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

    @property
    def readers(self) -> list[socket.socket]:
        """Sockets to wait for.

        Frames for which a controller has no room stay in the kernel's queue, so that in the end it
        is their sender who gets an error.
        """
        takes = self.network.takes
        heard = [client for client, station in self._stations.items() if takes(station)]
        return [self._listener, *heard]

    def take(self, ready: Collection[socket.socket]) -> None:
        """Let in who connects, and hand over what has come at those sockets that are ready."""
        for one in self.readers:
            if one not in ready:
                continue
            if one is self._listener:
                client, _ = self._listener.accept()
                client.setblocking(False)
                self._stations[client] = self.network.attach()
            else:
                self._take(one)

    def give(self) -> None:
        """Pass on what the wire has carried, and let go who has hung up."""
        for client, station in tuple(self._stations.items()):
            self._give(client, station)
            if self.network.off_bus(station) and _hung_up(client):
                self._drop(client)

    def _take(self, client: socket.socket) -> None:
        while self.network.takes(self._stations[client]):
            try:
                packet = client.recv(PACKET.size + 1)
            except BlockingIOError:
                return
            except ConnectionResetError:
                # It has gone and left frames unread; what it has sent before is still there.
                continue
            if not packet:
                self._drop(client)
                return
            frame = unpack_frame(packet)
            if frame is None:
                continue
            asked = opening_of(frame)
            if asked is not None:
                self.network.detach(self._stations[client])
                station = self.network.attach(bitrate=asked.bitrate, echo=asked.own)
                self._stations[client] = station
            elif not frame.error:
                self.network.send(self._stations[client], frame)

    def _give(self, client: socket.socket, station: Station) -> None:
        received, controller = station.received, self._controller(station)
        while received:
            _, frame, own = received[0]
            try:
                client.send(pack_frame(frame, controller, own=own))
            except BlockingIOError:
                break
            except OSError:
                # It has gone; the end of what it has sent says so, in its turn.
                received.clear()
                return
            received.popleft()
        if len(received) > UNREAD:
            while len(received) >= UNREAD:
                received.pop()
            received.append(Heard(self.network.now_ns, OVERFLOW_FRAME))

    def _controller(self, station: Station) -> Controller:
        if self.network.off_bus(station):
            return Controller.BUS_OFF
        passive = self.network.level(station) >= PASSIVE
        return Controller.PASSIVE if passive else Controller.ACTIVE

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


def _hung_up(client: socket.socket) -> bool:
    """Whether a master that is not read from has gone."""
    poll = select.poll()
    poll.register(client, 0)
    return bool(poll.poll(0))
