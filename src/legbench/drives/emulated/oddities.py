"""Object dictionary of an emulated drive that lacks objects, or holds them in other types; pure."""

from collections.abc import Iterator
from dataclasses import replace

from legbench.drives.emulated.behaviour import Behaviour
from legbench.drives.emulated.dictionary import Dictionary
from legbench.drives.protocol.objects import PDO_COUNT, Access, Key, ObjectEntry
from legbench.drives.protocol.pdo import Mapped
from legbench.drives.setup.config import NodeConfig
from legbench.drives.setup.pdos import PdoConfig

RPDO, TPDO = 0x1400, 0x1800
"""First communication objects of RPDOs and TPDOs; their mappings lie 200h above."""


def changed(dictionary: Dictionary, node: NodeConfig, behaviour: Behaviour) -> Dictionary:
    """Return a dictionary with what one drive lacks or holds otherwise.

    Values of objects that it lacks are still those that it works with.

    Args:
        dictionary: objects of a drive; those that a bus file names are only added to the usual
            drive's, as a data sheet tells all that there is.
        node: configuration, which names objects and types of positions, torque and temperature.
        behaviour: objects that it lacks, number of PDOs, and values at power-on.
    """
    entries = {entry.key: entry for entry in dictionary.entries}
    _count(entries, behaviour)
    heat, links = dictionary.temperature, dictionary.links
    if node.eds is None:
        entries |= {entry.key: entry for entry in _named(node, entries)}
        if node.link is not None and node.link_object.key not in links:
            links = (*links, node.link_object.key)
        heat = heat if node.temperature_object is None else node.temperature_object.key
    if behaviour.fixed_mapping:
        entries |= {entry.key: entry for entry in _fixed(node, entries)}
    for key, value in behaviour.defaults:
        if key in entries:
            entries[key] = replace(entries[key], default=value)
    hidden = {**dictionary.hidden}
    for key, entry in tuple(entries.items()):
        if key in behaviour.lacks or entry.index in behaviour.lacks:
            del entries[key]
            hidden[key] = entry.default if isinstance(entry.default, int) else 0
    return replace(
        dictionary,
        entries=tuple(entry for _, entry in sorted(entries.items())),
        hidden=hidden,
        links=links,
        temperature=heat,
    )


def _named(node: NodeConfig, entries: dict[Key, ObjectEntry]) -> Iterator[ObjectEntry]:
    """Yield the objects that the bus file names, in the types that it names."""
    shown = [node.motor_object, node.torque_object, node.temperature_object]
    shown += [] if node.link is None else [node.link_object]
    for entry in shown:
        if entry is not None:
            yield _typed(entry, entries, Access.RO)
    yield _typed(node.target_object, entries, Access.RW)


def _typed(entry: Mapped, entries: dict[Key, ObjectEntry], access: Access) -> ObjectEntry:
    there = entries.get(entry.key)
    if there is not None and there.kind is entry.kind:
        return there
    name = f"Object {entry.index:04X}h of this drive" if there is None else there.name
    return ObjectEntry(entry.index, entry.sub, name, entry.kind, access, 0, mappable=True)


def _count(entries: dict[Key, ObjectEntry], behaviour: Behaviour) -> None:
    """Give the dictionary as many PDOs each way as the drive has."""
    for base, count in ((RPDO, behaviour.rpdos), (TPDO, behaviour.tpdos)):
        if count == PDO_COUNT:
            continue
        for index in (base, base + 0x200):
            first = [entry for entry in entries.values() if entry.index == index]
            for number in range(count, PDO_COUNT):
                for entry in first:
                    entries.pop((index + number, entry.sub), None)
            for number in range(PDO_COUNT, count):
                copies = [replace(entry, index=index + number) for entry in first]
                entries |= {entry.key: entry for entry in copies}


def _fixed(node: NodeConfig, entries: dict[Key, ObjectEntry]) -> Iterator[ObjectEntry]:
    """Yield mappings that nobody can change and that are what the bus file wants."""
    wanted: dict[Key, int] = {}
    for base, pdos in ((RPDO, node.rpdos), (TPDO, node.tpdos)):
        for pdo in pdos:
            wanted |= _mapping(base + 0x200 + pdo.number - 1, pdo)
    for key, entry in entries.items():
        if any(base + 0x200 <= entry.index < base + 0x400 for base in (RPDO, TPDO)):
            yield replace(entry, access=Access.RO, default=wanted.get(key, 0))


def _mapping(index: int, pdo: PdoConfig) -> dict[Key, int]:
    words = {(index, sub): entry.word for sub, entry in enumerate(pdo.objects, start=1)}
    return {(index, 0): len(pdo.objects), **words}
