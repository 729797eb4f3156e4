"""Identity of a drive, by which it is told apart from others."""

from dataclasses import dataclass

from legbench.drives.setup.bus_numbers import LONG
from legbench.limits.upper_ends import check_number


@dataclass(frozen=True, slots=True, kw_only=True)
class Identity:
    """Identity object 1018h; what is not given is not checked.

    Raises:
        ConfigError: a number that 32 bits do not hold.
    """

    vendor: int
    product: int | None = None
    serial: int | None = None
    revision: int | None = None

    def __post_init__(self) -> None:
        for name in ("vendor", "product", "serial", "revision"):
            value = getattr(self, name)
            if value is not None:
                check_number(name, value, 0, LONG, "")
