"""Objects of an emulated drive that depend on which drive it is, and on its node id."""

from collections.abc import MutableMapping

from legbench.drives.protocol.objects import Key
from legbench.drives.setup.config import NodeConfig


def write_identity(values: MutableMapping[Key, int], node: NodeConfig) -> None:
    """Write identity (1018h) and COB-IDs of a node over the defaults of all drives (CiA 301)."""
    identity, node_id = node.identity, node.node_id
    values[0x1018, 1], values[0x1018, 2] = identity.vendor, identity.product
    values[0x1018, 3], values[0x1018, 4] = identity.revision or 0, identity.serial or 0
    values[0x1014, 0] = 0x80 + node_id
    for index, sub in tuple(values):
        if sub == 1 and any(base <= index < base + 0x200 for base in (0x1400, 0x1800)):
            values[index, sub] += node_id
