"""Memory of an emulated drive, in which parameters outlast its power (CiA 301, 1010h and 1011h)."""

from collections.abc import Container, Sequence
from typing import final

from legbench.drives.emulated.dictionary import Dictionary
from legbench.drives.emulated.store import ObjectStore
from legbench.drives.protocol.memory import (
    LOAD_SIGNATURE,
    RESTORE,
    SAVE_SIGNATURE,
    STORE,
    in_part,
)
from legbench.drives.protocol.objects import Access, Key
from legbench.drives.protocol.sdo import Abort
from legbench.drives.setup.parameters import Parameter

NEVER = (0x1003, STORE, RESTORE, 0x6040, 0x6071, 0x607A)
"""Objects that are no parameters: history, signatures, controlword and targets."""

ALL = range(0x10000)
"""Indices of all objects."""


@final
class Memory:
    """Parameters of one drive that differ from its defaults, as it keeps them without power."""

    def __init__(
        self,
        store: ObjectStore,
        dictionary: Dictionary,
        node_id: int,
        kept: Sequence[Parameter] = (),
    ) -> None:
        """Begin with some parameters, of which the last value of an object counts.

        Args:
            store: objects of the drive.
            dictionary: their values at power-on.
            node_id: node id for which these are.
            kept: what is kept; an object that is not there, or takes another value, is left out.
        """
        self._store, self._dictionary, self._node_id = store, dictionary, node_id
        self._defaults: dict[Key, int] = {}
        self._kept = {entry.key: entry.value for entry in kept if self._takes(entry)}

    def _takes(self, parameter: Parameter) -> bool:
        key = parameter.key
        entry = self._store.entry(key)
        refused = self._dictionary.refusal(key, parameter.value) is not None
        return entry is not None and entry.access is Access.RW and not refused

    def recall(self, node_id: int, indices: Container[int] = ALL) -> None:
        """Set objects to their defaults for a node id, then to what is kept, as at power-on."""
        values = self._store.values
        self._store.load_defaults(indices)
        among = [key for key in values if key[0] in indices]
        for key in self._dictionary.relative.intersection(among):
            values[key] += node_id - self._node_id
        self._defaults |= {key: values[key] for key in among}
        values |= {key: self._kept[key] for key in among if key in self._kept}

    @staticmethod
    def owns(key: Key) -> bool:
        """Whether an object makes the drive store or restore."""
        return key[0] in (STORE, RESTORE)

    @staticmethod
    def check(key: Key, value: int, *, powered: bool) -> Abort | None:
        """Abort code that refuses a signature; none if it is accepted."""
        if value != (SAVE_SIGNATURE if key[0] == STORE else LOAD_SIGNATURE):
            return Abort.NOT_TRANSFERRED
        return Abort.DEVICE_STATE if powered else None

    def obey(self, key: Key) -> None:
        """Store or restore a part of the parameters, and show again what the object can do.

        Defaults that are restored become valid at the next reset (CiA 301, 7.5.2.14).
        """
        index, part = key
        values, defaults = self._store.values, self._defaults
        values[key] = defaults[key]
        self._kept = {old: value for old, value in self._kept.items() if not in_part(old, part)}
        if index == RESTORE:
            return
        for one, value in values.items():
            entry = self._store.entry(one)
            stored = entry is not None and entry.access is Access.RW and one[0] not in NEVER
            if stored and in_part(one, part) and value != defaults[one]:
                self._kept[one] = value
