"""Process data of a drive: its PDOs, and the objects that close the loop."""

from collections.abc import Sequence
from dataclasses import dataclass

from legbench.drives.errors import CodecError
from legbench.drives.protocol.datatypes import DataType
from legbench.drives.protocol.objects import LAST_PDO, LINK_SHORT, PDO_COUNT
from legbench.drives.protocol.pdo import MAX_BYTES, Mapped, PdoMap
from legbench.drives.setup.bus_numbers import WORD
from legbench.drives.setup.cob_ids import check_cob_id
from legbench.errors import ConfigError
from legbench.limits.upper_ends import check_number

STATUSWORD = Mapped(0x6041, 0, DataType.UNSIGNED16)
CONTROLWORD = Mapped(0x6040, 0, DataType.UNSIGNED16)
POSITION_ACTUAL = Mapped(0x6064, 0, DataType.INTEGER32)
TARGET_POSITION = Mapped(0x607A, 0, DataType.INTEGER32)
LINK_POSITION_SHORT = Mapped(LINK_SHORT, 0, DataType.INTEGER16)
LINK_POSITION = Mapped(0x60E4, 1, DataType.INTEGER32)


@dataclass(frozen=True, slots=True, kw_only=True)
class PdoConfig:
    """Synchronous process data object (1400h/1600h or 1800h/1A00h and following).

    Raises:
        ConfigError: a number that does not exist, or objects that fill no frame.
    """

    number: int
    """Number of the RPDO or TPDO; beyond 4 it needs a `cob_id`."""
    objects: tuple[Mapped, ...]
    cob_id: int | None = None
    """COB-ID of the PDO; by default that of the predefined connection set."""
    deadline_ms: int = 0
    """Time without an RPDO after which the drive faults (140xh:05) [ms]; 0 leaves that object,
    which not every drive has, alone."""

    def __post_init__(self) -> None:
        if not 1 <= self.number <= LAST_PDO:
            raise ConfigError(f"PDO number {self.number}; a drive has 1 to {LAST_PDO}")
        if self.number > PDO_COUNT and self.cob_id is None:
            raise ConfigError(
                f"PDO number {self.number} has no COB-ID by the standard, as 1 to {PDO_COUNT} "
                "have; give it a 'cob_id'"
            )
        try:
            PdoMap(self.objects)
        except CodecError as error:
            raise ConfigError(f"PDO {self.number}: {error}") from None
        if self.cob_id is not None:
            check_cob_id(self.cob_id)
        check_number("deadline_ms", self.deadline_ms, 0, WORD, "ms")

    def identifier(self, bases: Sequence[int], node_id: int) -> int:
        """COB-ID that is given, else that of the predefined connection set by its `bases`."""
        return bases[self.number - 1] + node_id if self.cob_id is None else self.cob_id


RPDO = PdoConfig(number=1, objects=(CONTROLWORD, TARGET_POSITION), deadline_ms=20)
"""Command frame used by default: controlword and target position, six bytes."""
TPDO = PdoConfig(number=1, objects=(STATUSWORD, POSITION_ACTUAL, LINK_POSITION_SHORT))
"""Answer frame used by default: statusword, motor and link position, eight bytes."""


def check_mapped(name: str, pdos: Sequence[PdoConfig], needed: Sequence[Mapped], word: str) -> None:
    """Refuse process data in which an object that closes the loop is missing, or stands twice.

    Args:
        name: name of the drive.
        pdos: its RPDOs, or its TPDOs.
        needed: objects that have to stand in one of them.
        word: `RPDO` or `TPDO`.

    Raises:
        ConfigError: an object stands in none of them, or in two.
    """
    mapped = [entry for pdo in pdos for entry in pdo.objects]
    for entry in needed:
        if mapped.count(entry) != 1:
            raise ConfigError(
                f"node '{name}' maps {entry} {mapped.count(entry)} times; it must stand in one "
                f"{word}"
            )


def packed(objects: Sequence[Mapped], deadline_ms: int = 0) -> tuple[PdoConfig, ...]:
    """PDOs 1, 2, ... that hold some objects in their order, each as full as it gets.

    The deadline [ms] is that of the first one.

    Raises:
        ConfigError: they fill more PDOs than there are.
    """
    frames: list[list[Mapped]] = [[]]
    for entry in objects:
        if sum(each.bits for each in (*frames[-1], entry)) > 8 * MAX_BYTES:
            frames.append([])
        frames[-1].append(entry)
    return tuple(
        PdoConfig(
            number=number, objects=tuple(frame), deadline_ms=deadline_ms if number == 1 else 0
        )
        for number, frame in enumerate(frames, start=1)
    )
