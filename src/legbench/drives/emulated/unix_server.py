"""Serves emulated channels to other processes, paced by the machine's clock."""

import select
import time
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import final

from legbench.closing import Closing
from legbench.drives.emulated.network import Network
from legbench.drives.emulated.network_time import NetworkTime
from legbench.drives.emulated.pacer import Pacer
from legbench.drives.emulated.shared_body import LockstepChannels
from legbench.drives.emulated.unix_wire import UnixWire


def _poll(wires: Sequence[UnixWire], pacer: Pacer) -> None:
    """Wait a moment for frames on any wire, pass them on and advance virtual time."""
    waited = [reader for wire in wires for reader in wire.readers]
    ready = frozenset(select.select(waited, [], [], pacer.wait_s())[0])
    pacer.advance()
    for wire in wires:
        if ready:
            wire.take(ready)
        wire.give()


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
        self._wire = UnixWire(network, path)
        self._pacer = Pacer(NetworkTime(network), now_ns)

    def poll(self) -> None:
        """Wait a moment for frames, pass them on and advance virtual time."""
        _poll((self._wire,), self._pacer)

    def close(self) -> None:
        """Disconnect everybody and remove the socket file; may be called twice."""
        self._wire.close()


@final
class ChannelsServer(Closing):
    """Emulated channels of one leg, each behind a socket file of its own."""

    def __init__(
        self,
        networks: Sequence[Network],
        paths: Sequence[Path],
        now_ns: Callable[[], int] = time.monotonic_ns,
    ) -> None:
        """Make the socket files, one for each channel; all channels pass time together.

        Raises:
            BusError: one cannot be made, or somebody serves there already; none is left then.
        """
        with ExitStack() as made:
            self._wires = [
                made.enter_context(UnixWire(network, path))
                for network, path in zip(networks, paths, strict=True)
            ]
            made.pop_all()
        self._pacer = Pacer(LockstepChannels(networks), now_ns)

    def poll(self) -> None:
        """Wait a moment for frames on any channel, pass them on and advance virtual time."""
        _poll(self._wires, self._pacer)

    def close(self) -> None:
        """Disconnect everybody and remove the socket files; may be called twice."""
        for wire in self._wires:
            wire.close()
