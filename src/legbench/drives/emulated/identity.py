"""Objects of an emulated drive that depend on which drive it is, and on its node id."""

from collections.abc import MutableMapping

from legbench.drives.emulated.lss import lss_address
from legbench.drives.protocol.objects import Key
from legbench.drives.setup.config import Identity


def write_identity(values: MutableMapping[Key, int], identity: Identity, node_id: int) -> None:
    """Write identity (1018h) and COB-IDs of a node over the defaults of all drives (CiA 301)."""
    for sub, word in enumerate(lss_address(identity), start=1):
        values[0x1018, sub] = word
    values[0x1014, 0] = 0x80 + node_id
    for base in (0x1400, 0x1800):
        for number in range(4):
            values[base + number, 1] += node_id
