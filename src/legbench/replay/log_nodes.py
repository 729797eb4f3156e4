"""Nodes and channels that a log of a bus holds, beside those of the bus file."""

from collections import Counter
from collections.abc import Iterable, Sequence
from typing import Final, final

import can

from legbench.drives.protocol.frame import (
    EMCY_BASE,
    HEARTBEAT_BASE,
    LAST_NODE,
    RPDO_BASES,
    SDO_REPLY_BASE,
    SDO_REQUEST_BASE,
    TPDO_BASES,
)
from legbench.drives.setup.config import BusConfig
from legbench.errors import ConfigError

Channel = str | int | Sequence[int] | None
"""Channel of a frame as python-can tells it."""
BASES: Final = frozenset(
    (EMCY_BASE, *TPDO_BASES, *RPDO_BASES, SDO_REPLY_BASE, SDO_REQUEST_BASE, HEARTBEAT_BASE)
)
"""Identifiers of the predefined connection set without the node."""


def channels_of(
    head: Iterable[can.Message], config: BusConfig, source: str
) -> frozenset[Channel] | None:
    """Channels of a log on which the drives of a bus file talk; none if they are silent so far.

    Args:
        head: first frames of the log.
        config: the bus file.
        source: its name.

    Raises:
        ConfigError: several channels carry them, and the bus file names none of these.
    """
    answers = {node.tpdo_id(pdo) for node in config.nodes for pdo in node.tpdos}
    talking = {message.channel for message in head if message.arbitration_id in answers}
    named = talking & {channel for channel in config.channels if channel is not None}
    if named or len(talking) < 2:
        return frozenset(named or talking) or None
    told = ", ".join(sorted(map(str, talking)))
    raise ConfigError(
        f"the log has the drives' answers on channels {told}; {source} names "
        f"{', '.join(str(channel) for channel in config.channels)}: correct its 'channel'"
    )


@final
class NodesSeen:
    """Counts the frames of the nodes that a bus file does not have."""

    def __init__(self, config: BusConfig) -> None:
        self._own = {node.node_id for node in config.nodes} | {config.master_id, 0}
        own = [node.tpdo_id(pdo) for node in config.nodes for pdo in node.tpdos]
        own += [node.rpdo_id(pdo) for node in config.nodes for pdo in node.rpdos]
        self._ours = frozenset(own)
        self._ids: Counter[int] = Counter()

    def take(self, cob_id: int) -> None:
        """Count a frame."""
        self._ids[cob_id] += 1

    @property
    def others(self) -> dict[int, int]:
        """Other node -> number of its frames, by the predefined connection set."""
        found: Counter[int] = Counter()
        for cob_id, count in self._ids.items():
            node = cob_id & LAST_NODE
            if cob_id & ~LAST_NODE in BASES and node not in self._own and cob_id not in self._ours:
                found[node] += count
        return dict(sorted(found.items()))

    @property
    def frames(self) -> int:
        """Number of all frames."""
        return self._ids.total()

    def count(self, cob_id: int) -> int:
        """Number of frames with an identifier."""
        return self._ids[cob_id]
