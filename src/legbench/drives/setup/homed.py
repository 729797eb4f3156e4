"""Condition that a drive is homed, as its maker shows it; CiA 402 knows no object for it."""

from dataclasses import dataclass

from legbench.drives.protocol.pdo import Mapped
from legbench.errors import ConfigError


@dataclass(frozen=True, slots=True, kw_only=True)
class HomedCondition:
    """Bits of an object that tell whether a position refers to a home since power-on.

    Raises:
        ConfigError: the bits are none of the object's, or the value is not made of them.
    """

    object: Mapped
    """Object that shows it, such as the statusword, `6041:00 u16`."""
    mask: int
    """Bits of it that count, such as 8000h."""
    value: int | None = None
    """What these bits are when the drive is homed; by default all are set."""

    def __post_init__(self) -> None:
        all_bits = (1 << self.object.bits) - 1
        if not 0 < self.mask <= all_bits:
            raise ConfigError(
                f"mask is {self.mask:#x}; {self.object} has {self.object.bits} bits, so it must be "
                f"1 to {all_bits:#x}"
            )
        if not 0 <= self.wanted <= all_bits or self.wanted & ~self.mask:
            raise ConfigError(
                f"value is {self.wanted:#x}; it must have no bits outside of mask, {self.mask:#x}"
            )

    @property
    def wanted(self) -> int:
        """Value of the bits when the drive is homed."""
        return self.mask if self.value is None else self.value

    def met(self, shown: int) -> bool:
        """Whether the value of the object says that the drive is homed."""
        return shown & self.mask == self.wanted

    def __str__(self) -> str:
        return f"{self.object} has not {self.wanted:X}h in the bits {self.mask:X}h"
