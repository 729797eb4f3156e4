"""PDOs of an emulated drive: mapping by SDO, latching at SYNC, sampling at SYNC."""

from typing import final

from legbench.drives.emulated.rules import usable
from legbench.drives.emulated.store import ObjectStore, fit
from legbench.drives.errors import CodecError, SdoAbortError
from legbench.drives.protocol.datatypes import size_of
from legbench.drives.protocol.frame import COB_INVALID, COB_MASK, Frame
from legbench.drives.protocol.objects import Access, Key
from legbench.drives.protocol.pdo import Mapped, PdoMap, split_word
from legbench.drives.protocol.sdo import Abort

RPDO, TPDO = 0x1400, 0x1800
ACYCLIC, LAST_SYNCHRONOUS = 0, 240
"""Transmission types: at SYNC if it has changed, and the last of those at every nth SYNC."""
_EVENT_TYPES = (254, 255)
EVENT_DRIVEN = 255
MAX_MAPPED = 64
"""Most objects that a PDO has room for, a bit each (CiA 301, 7.5.2.36)."""


@final
class Pdo:
    """Process data object (PDO) as its communication and mapping objects describe it."""

    def __init__(
        self, cob_id: int, kind: int, *, inhibit: int, timer_ms: int, layout: PdoMap
    ) -> None:
        self.cob_id, self.kind, self.layout = cob_id, kind, layout
        self.inhibit_ns, self.timer_ns = 100_000 * inhibit, 1_000_000 * timer_ms
        self.keys = tuple(entry.key for entry in layout.entries)
        self.waiting: tuple[int, ...] | None = None
        """Values of an RPDO that are received and not yet latched."""
        self.seen_ns: int | None = None
        """Time at which the PDO was last received or sent [ns]."""
        self.last: bytes | None = None
        self.syncs = 0


@final
class ProcessData:
    """Process data objects (PDOs) of a drive.

    Attributes:
        rpdos: RPDOs that exist, by COB-ID.
        tpdos: TPDOs that exist, in order.
        repeats: whether every TPDO repeats itself bit for bit.
    """

    def __init__(self, store: ObjectStore) -> None:
        self._store = store
        described = [index for index, sub in store.keys if self.owns((index, sub)) and sub == 1]
        self._comms = tuple(index for index in described if not index & 0x200)
        self.rpdos: dict[int, Pdo] = {}
        self.tpdos: list[Pdo] = []
        self.repeats = False

    @staticmethod
    def owns(key: Key) -> bool:
        """Whether an object describes a PDO."""
        return RPDO <= key[0] < TPDO + 0x400

    def check(self, key: Key, value: int) -> Abort | None:
        """Abort code that refuses a value for a PDO's object, if any (CiA 301, 7.5.2.36)."""
        index, sub = key
        mapping = bool(index & 0x200)
        comm = index & ~0x200
        exists = not self._store.values.get((comm, 1), COB_INVALID) & COB_INVALID
        if not mapping:
            return self._check_comm(comm, sub, value, exists)
        if exists:
            return Abort.DEVICE_STATE
        if sub == 0:
            return self._check_layout(index, value)
        if self._store.values.get((index, 0)):
            return Abort.DEVICE_STATE
        return None if self._mapped(value, index) is not None else Abort.NOT_MAPPABLE

    def _check_comm(self, comm: int, sub: int, value: int, exists: bool) -> Abort | None:
        if sub == 1:
            if value & COB_INVALID:
                return None
            moved = bool((value ^ self._store.values[comm, 1]) & COB_MASK)
            return Abort.INVALID_VALUE if (exists and moved) or not usable(value) else None
        if sub == 2 and LAST_SYNCHRONOUS < value < _EVENT_TYPES[0]:
            return Abort.INVALID_VALUE
        return Abort.DEVICE_STATE if sub == 3 and exists else None

    def _check_layout(self, index: int, count: int) -> Abort | None:
        if self._store.entry((index, count)) is None:
            return Abort.PDO_LENGTH
        values = self._store.values
        entries = [self._mapped(values.get((index, sub), 0), index) for sub in range(1, count + 1)]
        known = [entry for entry in entries if entry is not None]
        if len(known) < count:
            return Abort.NOT_MAPPABLE
        return Abort.PDO_LENGTH if sum(entry.bits for entry in known) > 64 else None

    def _mapped(self, word: int, index: int) -> Mapped | None:
        """The object of a mapping entry, if it may stand in this PDO."""
        at, sub, bits = split_word(word)
        entry = self._store.entry((at, sub))
        if entry is None or not entry.mappable or size_of(entry.kind) is None:
            return None
        if index < TPDO and entry.access not in (Access.RW, Access.WO):
            return None
        mapped = Mapped(at, sub, entry.kind)
        return mapped if mapped.bits == bits else None

    def rebuild(self) -> None:
        """Read the PDOs' objects again, after one of them was written."""
        old = {pdo.cob_id: pdo for pdo in (*self.rpdos.values(), *self.tpdos)}
        found = [self._build(comm, old) for comm in self._comms if comm < TPDO]
        self.rpdos = {pdo.cob_id: pdo for pdo in found if pdo is not None}
        found = [self._build(comm, old) for comm in self._comms if comm >= TPDO]
        self.tpdos = [pdo for pdo in found if pdo is not None]

    def _build(self, comm: int, old: dict[int, Pdo]) -> Pdo | None:
        values = self._store.values
        cob = values[comm, 1]
        if cob & COB_INVALID:
            return None
        mapping = comm + 0x200
        count = min(values.get((mapping, 0), 0), MAX_MAPPED)
        if not count:
            return None
        words = [values.get((mapping, sub), 0) for sub in range(1, count + 1)]
        entries = [self._mapped(word, mapping) for word in words]
        try:
            layout = PdoMap([entry for entry in entries if entry is not None])
        except CodecError:
            return None
        pdo = Pdo(
            cob & COB_MASK,
            values.get((comm, 2), EVENT_DRIVEN),
            inhibit=values.get((comm, 3), 0),
            timer_ms=values.get((comm, 5), 0),
            layout=layout,
        )
        known = old.get(pdo.cob_id)
        if known is not None and known.keys == pdo.keys:
            pdo.seen_ns = known.seen_ns
        return pdo

    def sample(self, pdo: Pdo) -> bytes:
        """Sample the bytes of a TPDO."""
        if self.repeats and pdo.last is not None:
            return pdo.last
        values = self._store.values
        try:
            pdo.last = pdo.layout.pack([values[key] for key in pdo.keys])
        except CodecError:
            # An object of a data sheet may be shorter than what the drive works with.
            entries = pdo.layout.entries
            pdo.last = pdo.layout.pack([fit(one.kind, values[one.key]) for one in entries])
        return pdo.last

    def at_sync(self) -> list[Frame]:
        """Sample the TPDOs that a SYNC makes due."""
        frames: list[Frame] = []
        for pdo in self.tpdos:
            if pdo.kind == ACYCLIC:
                before, data = pdo.last, self.sample(pdo)
                if data != before:
                    frames.append(Frame(pdo.cob_id, data))
            elif pdo.kind <= LAST_SYNCHRONOUS:
                pdo.syncs += 1
                if pdo.syncs >= pdo.kind:
                    pdo.syncs = 0
                    frames.append(Frame(pdo.cob_id, self.sample(pdo)))
        return frames

    def latch(self) -> None:
        """Apply the synchronous RPDOs received before a SYNC."""
        for pdo in self.rpdos.values():
            if pdo.waiting is not None and pdo.kind <= LAST_SYNCHRONOUS:
                values, pdo.waiting = pdo.waiting, None
                self.apply(pdo, values)

    def apply(self, pdo: Pdo, values: tuple[int, ...]) -> None:
        """Write the values of an RPDO to its objects; one that is refused keeps its value."""
        for key, value in zip(pdo.keys, values, strict=True):
            try:
                self._store.put(key, value)
            except SdoAbortError:
                continue

    def events(self, now_ns: int) -> list[Frame]:
        """Sample the event-driven TPDOs that have changed or whose timer has run out."""
        frames: list[Frame] = []
        for pdo in self.tpdos:
            if pdo.kind <= LAST_SYNCHRONOUS:
                continue
            before, data = pdo.last, self.sample(pdo)
            since_ns = None if pdo.seen_ns is None else now_ns - pdo.seen_ns
            late = bool(pdo.timer_ns) and (since_ns is None or since_ns >= pdo.timer_ns)
            if since_ns is not None and since_ns < pdo.inhibit_ns:
                # What has changed meanwhile is sent when the time is over.
                pdo.last = before
            elif data != before or late:
                pdo.seen_ns = now_ns
                frames.append(Frame(pdo.cob_id, data))
        return frames

    def forget(self) -> None:
        """Discard what was received and not yet latched, as on leaving operational."""
        for pdo in self.rpdos.values():
            pdo.waiting = pdo.seen_ns = None
        for pdo in self.tpdos:
            pdo.last = pdo.seen_ns = None
