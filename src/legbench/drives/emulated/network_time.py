"""Time base of an emulated bus."""

from typing import final

from legbench.drives.emulated.network import Network


@final
class NetworkTime:
    """Virtual time of an emulated bus, which waiting advances."""

    def __init__(self, network: Network) -> None:
        self._network = network

    def now_ns(self) -> int:
        """Return the present time [ns]."""
        return self._network.now_ns

    def next_ns(self) -> int:
        """Time of the next event [ns]."""
        return self._network.upcoming()[0]

    def wait_until(self, at_ns: int) -> None:
        """Advance the bus to `at_ns`."""
        self._network.advance(at_ns)
