"""Frames that wait for the wire of an emulated bus, and the one of them that goes next."""

from typing import NamedTuple, final

from legbench.drives.emulated.station import Node, Station
from legbench.drives.protocol.frame import Frame

NEVER_NS = 1 << 62
"""Later than any event [ns]."""


class Waiting(NamedTuple):
    """A frame that waits for the wire."""

    ready_ns: int
    """Time from which it may be sent [ns]."""
    cob_id: int
    sequence: int
    """Number of frames that were handed over before it."""
    sender: Node
    frame: Frame


@final
class SendQueue:
    """Frames that wait for the wire: a drive's go by priority, a master's in their order.

    Masters queue their frames, as SocketCAN and serial adapters do: one of a lower identifier waits
    for those that were handed over before it.

    Attributes:
        earliest_ns: time from which the first of the frames that wait may be sent, `NEVER_NS`
            without any [ns].
    """

    def __init__(self) -> None:
        self._waiting: list[Waiting] = []
        self._count = 0
        self.earliest_ns = NEVER_NS

    def put(self, sender: Node, ready_ns: int, frame: Frame) -> int:
        """Add a frame that may be sent from a time on [ns]; returns its number."""
        self._count += 1
        self._waiting.append(Waiting(ready_ns, frame.cob_id, self._count, sender, frame))
        if ready_ns < self.earliest_ns:
            self.earliest_ns = ready_ns
        return self._count

    def put_back(self, entry: Waiting, ready_ns: int) -> None:
        """Return a frame that was destroyed on the wire to its place, to be sent again."""
        self._waiting.insert(0, entry._replace(ready_ns=ready_ns))
        self._find_earliest()

    def drop(self, sender: Node) -> None:
        """Forget all frames of a node."""
        self._waiting = [entry for entry in self._waiting if entry.sender is not sender]
        self._find_earliest()

    def pop(self, now_ns: int) -> Waiting:
        """Remove the frame that wins the arbitration at a time [ns], and return it.

        Of the frames that are ready the one with the lowest identifier wins (ISO 11898-1).
        """
        if len(self._waiting) == 1:
            self.earliest_ns = NEVER_NS
            return self._waiting.pop()
        winner = min(self._competing(now_ns), key=lambda entry: entry[1:3])
        self._waiting.remove(winner)
        self._find_earliest()
        return winner

    def _find_earliest(self) -> None:
        self.earliest_ns = min([entry[0] for entry in self._waiting], default=NEVER_NS)

    def _competing(self, now_ns: int) -> list[Waiting]:
        competing: list[Waiting] = []
        queued: set[Node] = set()
        for entry in self._waiting:
            sender = entry[3]
            if entry[0] > now_ns or sender in queued:
                continue
            if isinstance(sender, Station):
                queued.add(sender)
            competing.append(entry)
        return competing
