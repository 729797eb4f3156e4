"""Configuration of drives that a log of their bus shows: process data as SDO writes mapped it."""

from typing import Final, final

from legbench.drives.protocol.frame import COB_INVALID, COB_MASK, SDO_REQUEST_BASE
from legbench.drives.protocol.sdo import MUX
from legbench.drives.setup.config import BusConfig, NodeConfig, PdoConfig
from legbench.errors import ConfigError

RPDO_MAPS, TPDO_MAPS = 0x1600, 0x1A00
"""First mapping objects of RPDOs and TPDOs (CiA 301, 7.5.2.36 and .38)."""
COMMUNICATION: Final = 0x200
"""Way from a PDO's mapping object back to its communication object, 1400h or 1800h."""
EXPEDITED: Final = 0x22
"""Command specifier of an expedited download, without the bits that tell its length."""
LENGTHS: Final = 0x0D
"""Bits of the specifier that tell how many bytes are none: n, and s, which says that n counts."""


@final
class MappingsSeen:
    """Collects what a log shows of the mapping of process data.

    Attributes:
        by_node: node -> object and sub-index -> the value written last.
    """

    def __init__(self, config: BusConfig) -> None:
        self._nodes = {SDO_REQUEST_BASE + node.node_id: node for node in config.nodes}
        self.by_node: dict[int, dict[tuple[int, int], int]] = {}

    def take(self, cob_id: int, data: bytes) -> None:
        """Take a frame; what is no SDO write of a mapping is left alone."""
        node = self._nodes.get(cob_id)
        if node is None or len(data) != 8:
            return
        command, index, sub = MUX.unpack_from(data)
        known = RPDO_MAPS - COMMUNICATION <= index < TPDO_MAPS + COMMUNICATION
        if command & ~LENGTHS != EXPEDITED or not known:
            return
        unused = command >> 2 & 3 if command & 1 else 0
        value = int.from_bytes(data[4 : 8 - unused], "little")
        self.by_node.setdefault(node.node_id, {})[index, sub] = value

    def check(self, config: BusConfig, source: str) -> tuple[str, ...]:
        """Hold what was seen against the bus file.

        Args:
            config: the bus file.
            source: its name.

        Returns:
            Names of the drives whose process data was not seen to be configured.

        Raises:
            ConfigError: a drive was configured otherwise than the bus file says.
        """
        unseen: list[str] = []
        for node in config.nodes:
            seen = self.by_node.get(node.node_id, {})
            found = [
                self._agrees(seen, node, pdo, base, source)
                for pdos, base in ((node.rpdos, RPDO_MAPS), (node.tpdos, TPDO_MAPS))
                for pdo in pdos
            ]
            if not all(found):
                unseen.append(node.name)
        return tuple(unseen)

    def _agrees(
        self,
        seen: dict[tuple[int, int], int],
        node: NodeConfig,
        pdo: PdoConfig,
        base: int,
        source: str,
    ) -> bool:
        """Whether a PDO was seen to be configured; raises ConfigError where otherwise."""
        index, words = base + pdo.number - 1, "RPDO" if base == RPDO_MAPS else "TPDO"
        count = seen.get((index, 0))
        if not count:
            return False
        wrote = [seen.get((index, sub), 0) for sub in range(1, count + 1)]
        wanted = [entry.word for entry in pdo.objects]
        if wrote != wanted:
            raise ConfigError(
                f"the log maps {_objects(wrote)} into {words}{pdo.number} of '{node.name}', "
                f"{source} {_objects(wanted)}: give the bus file of that time"
            )
        cob = seen.get((index - COMMUNICATION, 1))
        wanted_cob = node.rpdo_id(pdo) if base == RPDO_MAPS else node.tpdo_id(pdo)
        if cob is not None and not cob & COB_INVALID and cob & COB_MASK != wanted_cob:
            raise ConfigError(
                f"the log gives {words}{pdo.number} of '{node.name}' the COB-ID "
                f"{cob & COB_MASK:X}h, {source} {wanted_cob:X}h: give the bus file of that time"
            )
        return True


def _objects(words: list[int]) -> str:
    return ", ".join(f"{word >> 16:04X}h:{word >> 8 & 0xFF:02X}" for word in words)
