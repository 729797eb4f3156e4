"""Object dictionary of an emulated drive: what it has, lacks, or holds in other types; pure."""

from collections.abc import Iterable, Iterator
from dataclasses import replace

from legbench.drives.emulated.behaviour import Behaviour
from legbench.drives.protocol.objects import OBJECTS, PDO_COUNT, Access, Key, ObjectEntry
from legbench.drives.protocol.pdo import Mapped
from legbench.drives.setup.config import NodeConfig

PDO_BASES = (0x1400, 0x1800)
"""First communication objects of RPDOs and TPDOs; their mappings lie 200h above."""


def dictionary_of(
    node: NodeConfig, behaviour: Behaviour, base: Iterable[ObjectEntry] = OBJECTS.values()
) -> tuple[ObjectEntry, ...]:
    """Return the objects of a drive.

    Args:
        node: its configuration, which names objects and types of its positions and temperature.
        behaviour: which objects it lacks, how many PDOs it has, and what it holds at power-on.
        base: objects of the drive that these change.
    """
    entries = {entry.key: entry for entry in base}
    _count(entries, behaviour)
    for entry, access in _named(node):
        name = f"Object {entry.index:04X}h of the drive"
        there = entries.get(entry.key) or OBJECTS.get(entry.key)
        entries[entry.key] = ObjectEntry(
            entry.index,
            entry.sub,
            name if there is None else there.name,
            entry.kind,
            access,
            0,
            True,
        )
    for key, value in behaviour.defaults:
        if key in entries:
            entries[key] = replace(entries[key], default=value)
    lacks = behaviour.lacks
    return tuple(
        entry
        for key, entry in sorted(entries.items())
        if key not in lacks and entry.index not in lacks
    )


def _named(node: NodeConfig) -> Iterator[tuple[Mapped, Access]]:
    yield node.motor_object, Access.RO
    yield node.target_object, Access.RW
    if node.link is not None:
        yield node.link_object, Access.RO
    for entry in (node.torque_object, node.temperature_object):
        if entry is not None:
            yield entry, Access.RO


def _count(entries: dict[Key, ObjectEntry], behaviour: Behaviour) -> None:
    """Give the dictionary as many PDOs as the drive has, each way."""
    for base, count in zip(PDO_BASES, (behaviour.rpdos, behaviour.tpdos), strict=True):
        for number in range(max(count, PDO_COUNT)):
            for comm in (base + number, base + 0x200 + number):
                like = [entry for key, entry in entries.items() if key[0] == comm]
                if number >= count:
                    for entry in like:
                        del entries[entry.key]
                elif not like:
                    first = base + (comm & 0x200)
                    copied = [entry for key, entry in entries.items() if key[0] == first]
                    entries |= {(comm, one.sub): replace(one, index=comm) for one in copied}
