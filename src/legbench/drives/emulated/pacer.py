"""Virtual time of an emulated bus, led by the machine's clock."""

from collections.abc import Callable
from typing import final

from legbench.drives.emulated.network import Network

FORGIVEN_NS = 3_000_000
"""Longest step of virtual time at once; the rest of a longer pause is left out [ns]."""


@final
class Pacer:
    """Lets a network catch up with a clock."""

    def __init__(self, network: Network, now_ns: Callable[[], int]) -> None:
        self._network, self._now_ns = network, now_ns
        self._offset_ns = now_ns() - network.now_ns

    def advance(self) -> None:
        """Move the network to now."""
        network = self._network
        now_ns = self._now_ns() - self._offset_ns
        away_ns = now_ns - network.now_ns
        if away_ns > FORGIVEN_NS:
            self._offset_ns += away_ns - FORGIVEN_NS
            now_ns = network.now_ns + FORGIVEN_NS
        network.advance(now_ns)

    def wait_s(self) -> float:
        """How long nothing happens on the network by itself [s]."""
        at_ns, _ = self._network._next()
        return max(0.0, 1e-9 * (at_ns + self._offset_ns - self._now_ns()))
