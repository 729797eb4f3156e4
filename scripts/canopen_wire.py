"""A pytest plugin that gives python-can's `virtual` interface emulated wires over AF_UNIX.

Buses of one channel meet on one wire, on which there are no drives.
"""

import tempfile
import threading
from pathlib import Path
from typing import Any, final

import can
import pytest

from legbench.drives.emulated.network import Network
from legbench.drives.emulated.unix_server import UnixServer
from legbench.drives.transport.unix_bus import UnixBus


@final
class Wires:
    """Wires of all channels, each served by a thread."""

    def __init__(self) -> None:
        self._folder = tempfile.TemporaryDirectory()
        self._paths: dict[object, Path] = {}
        self._threads: list[threading.Thread] = []
        self._over = threading.Event()

    def open(self, channel: object = None, *_: object, **options: Any) -> can.BusABC:
        """Open a bus on the wire of a channel, in place of `can.Bus`."""
        own = bool(options.get("receive_own_messages"))
        return UnixBus(str(self._path(channel)), receive_own_messages=own)

    def _path(self, channel: object) -> Path:
        path = self._paths.get(channel)
        if path is None:
            path = self._paths[channel] = Path(self._folder.name) / f"{len(self._paths)}.sock"
            server = UnixServer(Network([]), path)
            thread = threading.Thread(target=self._serve, args=(server,), daemon=True)
            thread.start()
            self._threads.append(thread)
        return path

    def _serve(self, server: UnixServer) -> None:
        with server:
            while not self._over.is_set():
                server.poll()

    def close(self) -> None:
        """End all threads."""
        self._over.set()
        for thread in self._threads:
            thread.join(2.0)
        self._folder.cleanup()


@pytest.fixture(autouse=True, scope="session")
def wires() -> Any:
    """Wires instead of `virtual` for the whole session."""
    patch, made = pytest.MonkeyPatch(), Wires()
    patch.setattr(can, "Bus", made.open)
    patch.setattr(can.interface, "Bus", made.open)
    yield
    patch.undo()
    made.close()
