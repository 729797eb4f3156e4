"""Heartbeats that an emulated drive watches, and its own (CiA 301, 1016h and 1017h)."""

from collections.abc import Iterator, Mapping
from typing import final

from legbench.drives.emulated.rules import watched
from legbench.drives.protocol.nmt import HeartbeatWatch, decode_heartbeat
from legbench.drives.protocol.objects import Key


@final
class HeartbeatConsumer:
    """Watches over the nodes whose heartbeats a drive consumes."""

    def __init__(self, values: Mapping[Key, int]) -> None:
        self._values = values
        self._watches: dict[int, HeartbeatWatch] = {}

    def clear(self) -> None:
        """Watch nobody, until a heartbeat comes or the drive becomes operational again."""
        self._watches.clear()

    def start(self, now_ns: int) -> None:
        """Begin to watch all nodes that are to be watched and are not yet."""
        for node_id, timeout_ns in self._consumed():
            self._watches.setdefault(node_id, HeartbeatWatch(timeout_ns, now_ns))

    def take(self, node_id: int, data: bytes, now_ns: int) -> bool:
        """Take a heartbeat; returns whether it is one of a node that is to be watched."""
        if decode_heartbeat(data) is None:
            return False
        timeouts = [timeout_ns for watched, timeout_ns in self._consumed() if watched == node_id]
        if timeouts:
            self._watches[node_id] = HeartbeatWatch(timeouts[-1], now_ns)
        return bool(timeouts)

    def lost(self, now_ns: int) -> bool:
        """Whether any heartbeat is overdue."""
        return any([watch.lost(now_ns) for watch in self._watches.values()])

    def _consumed(self) -> Iterator[tuple[int, int]]:
        """Yield the node and time-out [ns] of every heartbeat to watch (1016h)."""
        for sub in (1, 2):
            asked = watched(self._values[0x1016, sub])
            if asked is not None:
                yield asked[0], 1_000_000 * asked[1]


@final
class HeartbeatProducer:
    """Grid of the heartbeats that a drive produces (1017h).

    Attributes:
        since_ns: time of the last one, or of the boot-up message [ns].
        mute: whether none is sent, while their time goes on.
    """

    def __init__(self) -> None:
        self.since_ns = 0
        self.mute = False

    def due(self, period_ns: int, now_ns: int) -> bool:
        """Whether a heartbeat is to be sent now; none is with a period of 0."""
        if not period_ns or now_ns - self.since_ns < period_ns:
            return False
        self.since_ns = now_ns
        return not self.mute
