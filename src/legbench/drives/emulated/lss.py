"""LSS slave of an emulated drive (CiA 305); pure.

The bitrate of an emulated bus is that of its wire, so a change of the bit timing is answered as not
supported.
"""

from collections.abc import Callable, Mapping
from typing import final

from legbench.drives.protocol.frame import LAST_NODE
from legbench.drives.protocol.lss import (
    ADDRESS,
    FRAME,
    RESET_SCAN,
    UNCONFIGURED,
    WORDS,
    Lss,
    LssAddress,
    LssError,
    LssMode,
    lss_frame,
)
from legbench.drives.protocol.objects import Key


def address_of(values: Mapping[Key, int]) -> LssAddress:
    """LSS address of a drive: the four words of its identity, 0 where it has none (1018h)."""
    words = [values.get((0x1018, sub), 0) for sub in range(1, WORDS + 1)]
    return (words[0], words[1], words[2], words[3])


@final
class LssSlave:
    """LSS slave with the identity of one drive.

    Attributes:
        node_id: node id in use, `UNCONFIGURED` of a drive without one.
        mode: waiting, or in configuration.
    """

    def __init__(self, address: LssAddress, node_id: int) -> None:
        self._address = address
        self.node_id = self._pending = self._stored = node_id
        self.mode = LssMode.WAITING
        self._selected: list[int] = []
        self._asked: list[int] = []
        self._scanned = 0

    def begin(self, *, cold: bool) -> int:
        """Take the stored node id when the drive starts, or the last one when it resets its bus."""
        self.node_id = self._pending = self._stored if cold else self._pending
        self.mode = LssMode.WAITING
        return self.node_id

    @property
    def released(self) -> bool:
        """Whether a drive without node id has got one and may leave initialisation."""
        waiting = self.mode is LssMode.WAITING
        return waiting and self.node_id == UNCONFIGURED and self._pending != UNCONFIGURED

    def feed(self, data: bytes) -> bytes | None:
        """Data of the answer to a request; none where a slave is to keep silent."""
        if len(data) != FRAME:
            return None
        specifier, word = data[0], int(ADDRESS.unpack_from(data, 1)[0])
        if specifier == Lss.SWITCH_GLOBAL:
            if data[1] in (LssMode.WAITING, LssMode.CONFIGURATION):
                self.mode = LssMode(data[1])
            return None
        if Lss.IDENTIFY_VENDOR <= specifier <= Lss.IDENTIFY_SERIAL_HIGH:
            return self._identify(specifier - Lss.IDENTIFY_VENDOR, word)
        if specifier == Lss.IDENTIFY_UNCONFIGURED:
            alone = self.node_id == self._pending == UNCONFIGURED
            return lss_frame(Lss.UNCONFIGURED_IDENTIFIED) if alone else None
        if self.mode is LssMode.CONFIGURATION:
            return self._configure(specifier, data)
        if Lss.SELECT_VENDOR <= specifier <= Lss.SELECT_SERIAL:
            return self._select(specifier - Lss.SELECT_VENDOR, word)
        return self._scan(word, *data[5:8]) if specifier == Lss.FAST_SCAN else None

    def _select(self, place: int, word: int) -> bytes | None:
        self._selected = [*self._selected[:place], word]
        if tuple(self._selected) != self._address:
            return None
        self.mode = LssMode.CONFIGURATION
        return lss_frame(Lss.SELECTED)

    def _identify(self, place: int, word: int) -> bytes | None:
        """Compare vendor and product, and the ranges of revision and serial number."""
        self._asked = [*self._asked[:place], word]
        if len(self._asked) != WORDS + 2 or place != WORDS + 1:
            return None
        vendor, product, *ranges = self._asked
        mine = (vendor, product) == self._address[:2]
        within = ranges[0] <= self._address[2] <= ranges[1]
        within = within and ranges[2] <= self._address[3] <= ranges[3]
        return lss_frame(Lss.IDENTIFIED) if mine and within else None

    def _scan(self, word: int, bit: int, sub: int, following: int) -> bytes | None:
        if self.node_id != UNCONFIGURED or self._pending != UNCONFIGURED:
            return None
        if bit == RESET_SCAN:
            self._scanned = 0
            return lss_frame(Lss.IDENTIFIED)
        if bit > 31 or sub >= WORDS or sub != self._scanned:
            return None
        if self._address[sub] >> bit != word >> bit:
            return None
        if bit == 0:
            self._scanned = following
            if following < sub:
                self.mode = LssMode.CONFIGURATION
        return lss_frame(Lss.IDENTIFIED)

    def _configure(self, specifier: int, data: bytes) -> bytes | None:
        if Lss.INQUIRE_VENDOR <= specifier <= Lss.INQUIRE_SERIAL:
            return lss_frame(specifier, ADDRESS.pack(self._address[specifier - Lss.INQUIRE_VENDOR]))
        services: dict[int, Callable[[], bytes]] = {
            Lss.INQUIRE_NODE_ID: lambda: bytes((self._pending,)),
            Lss.CONFIGURE_NODE_ID: lambda: bytes((self._take(data[1]),)),
            Lss.CONFIGURE_BIT_TIMING: lambda: bytes((LssError.OUT_OF_RANGE,)),
            Lss.STORE: lambda: bytes((self._keep(),)),
        }
        service = services.get(specifier)
        return None if service is None else lss_frame(specifier, service())

    def _take(self, node_id: int) -> LssError:
        if not (1 <= node_id <= LAST_NODE or node_id == UNCONFIGURED):
            return LssError.OUT_OF_RANGE
        self._pending = node_id
        return LssError.NONE

    def _keep(self) -> LssError:
        self._stored = self._pending
        return LssError.NONE
