"""Values of data sheets that cannot be meant as they stand: identifiers and limits; pure."""

from collections.abc import Iterable, Mapping

from legbench.drives.protocol.datatypes import FORMATS, DataType, range_of
from legbench.drives.protocol.frame import COB_INVALID, COB_MASK, RPDO_BASES, TPDO_BASES
from legbench.drives.protocol.objects import LINK_SHORT, OBJECTS, TEMPERATURE, Key
from legbench.drives.protocol.pdo import split_word
from legbench.drives.setup.needs import MAPPINGS, RPDOS, TPDOS

OUR_OWN = (LINK_SHORT, TEMPERATURE)
"""Manufacturer specific objects of the emulated drive, which mean something else elsewhere."""
POSITIONS = (0x6064, 0x607A, 0x607D, 0x60E4)
"""Positions and their limits, which count from 0 on some drives and from both sides on others."""
NAMING = (0x1016, *MAPPINGS[0], *MAPPINGS[1])
"""Objects that name a node or another object, in 32 bits."""
BASES: Mapping[Key, int] = {
    (0x1014, 0): 0x80,
    **{(0x1400 + place, 1): base for place, base in enumerate(RPDO_BASES)},
    **{(0x1800 + place, 1): base for place, base in enumerate(TPDO_BASES)},
}
"""Identifiers of the predefined connection set (CiA 301, 7.3.5), which the node id is added to."""


def without_node(key: Key, value: int, node_id: int | None) -> int | None:
    """Return an identifier less the node id; none where it is not that of the connection set.

    Many makers leave $NODEID out, and configured devices (DCF) have it added already.

    Args:
        key: the object.
        value: what the data sheet tells, without $NODEID.
        node_id: node id of a configured device.
    """
    base = BASES.get(key)
    for node in {0, node_id or 0}:
        if base is not None and value & COB_MASK == base + node:
            return value - node
    return None


def are_limits(key: Key, kind: DataType, limits: tuple[int, int], default: int | None) -> bool:
    """Whether limits are those of a drive.

    They are not where the type cannot hold them, where the object's own default does not keep them
    (0 apart, which often says that it is not set), and where an identifier could not be switched
    off (bit 31).
    """
    low, high = limits
    if kind not in FORMATS:
        return False
    least, most = range_of(kind)
    if low < least or high > most or (default and not low <= default <= high):
        return False
    return not (_is_identifier(key) and high <= COB_INVALID)


def _is_identifier(key: Key) -> bool:
    return key in BASES or (key[1] == 1 and (key[0] in RPDOS or key[0] in TPDOS))


def meant_type(key: Key, kind: DataType, default: int | None) -> DataType:
    """Return the type of a whole number: that of the profile where its own cannot be meant.

    Makers mix up the signs of types, which are the same bits on the bus, and tell types that cannot
    hold the object's own default, or what it is there to name. Positions may have either sign, and
    are left as they are; so are a maker's own objects.
    """
    known = None if key[0] in (*POSITIONS, *OUR_OWN) else OBJECTS.get(key)
    if known is None or known.kind not in FORMATS or kind not in FORMATS:
        return kind
    if default is not None and in_type(kind, default) is None:
        return kind if in_type(known.kind, default) is None else known.kind
    own, usual = _span(kind), _span(known.kind)
    cannot_name = own < usual and (key in BASES or key[0] in NAMING)
    return known.kind if own == usual or cannot_name else kind


def in_type(kind: DataType, value: int) -> int | None:
    """Return a value in a whole number's type, by its bits; none where it has more of them."""
    low, span = range_of(kind)[0], _span(kind)
    return (value - low) % span + low if -(span >> 1) <= value < span else None


def _span(kind: DataType) -> int:
    low, high = range_of(kind)
    return high - low + 1


def mapped_keys(values: Iterable[tuple[Key, object]]) -> frozenset[Key]:
    """Objects that stand in a mapping at power-on, which can be mapped whatever is said of them."""
    return frozenset(
        split_word(value)[:2]
        for (index, _), value in values
        if isinstance(value, int) and any(index in mapping for mapping in MAPPINGS)
    )
