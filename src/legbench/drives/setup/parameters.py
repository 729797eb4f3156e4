"""Objects that a bus file adds to the configuration of a drive, and those that it may not."""

from dataclasses import dataclass

from legbench.drives.protocol.datatypes import FORMATS, SHORT_NAMES, DataType, range_of
from legbench.drives.protocol.objects import Key, name_of
from legbench.errors import ConfigError


@dataclass(frozen=True, slots=True, kw_only=True)
class Parameter:
    """An object that is written before enabling, and read back."""

    index: int
    sub: int
    kind: DataType
    value: int

    @property
    def key(self) -> Key:
        """Index and sub-index."""
        return (self.index, self.sub)

    def __str__(self) -> str:
        short = next(name for name, kind in SHORT_NAMES.items() if kind is self.kind)
        return f'{name_of(*self.key)} ("{self.index:04X}:{self.sub:02X} {short}")'


CONSUMERS = 0x1016
OWN_OBJECTS = (0x1005, 0x1006, CONSUMERS, 0x1017, 0x1029, 0x6007, 0x6040, 0x605A, 0x6060)
OWN_OBJECTS += (0x607A, 0x60B0, 0x60C2)
"""Written from the rest of the bus file; a parameter would undo it."""
PDO_OBJECTS = range(0x1400, 0x1C00)
MEMORY_OBJECTS = (0x1010, 0x1011)
"""Objects that store a configuration in a drive's memory, or load its defaults."""
SERVICE_OBJECTS = (0x1012, 0x1014, *range(0x1200, 0x1300))
"""COB-IDs of TIME, EMCY and the SDO channels, which a master expects where CiA 301 has them."""
STOP_OBJECTS = range(0x605B, 0x605F)
FOLLOWING_WINDOW, NO_WINDOW, SOFT_LIMITS = 0x6065, 0xFFFFFFFF, 0x607D


def check_parameter(name: str, parameter: Parameter) -> None:
    """Refuse a parameter that takes a protection away; raises ConfigError."""
    index, what = parameter.index, None
    low, high = range_of(parameter.kind) if parameter.kind in FORMATS else (0, -1)
    if not low <= parameter.value <= high:
        held = f"holds {low} to {high}" if low <= high else "is no number"
        what = f"is {parameter.value}, but its type {parameter.kind.name} {held}: correct one"
    if index == CONSUMERS and parameter.sub > 1:
        # A drive may watch other nodes from its maker on, of which none is on this bus.
        what = "watches another node: give 0, which ends that" if parameter.value else what
    elif index in OWN_OBJECTS or index in PDO_OBJECTS:
        what = "is written by itself, from the rest of the bus file: leave it out"
    elif index in MEMORY_OBJECTS:
        what = "would wear out the drive's memory at every start: run `legbench drives store` once"
    elif index in SERVICE_OBJECTS:
        what = "moves a service of CiA 301 to where this master does not look: leave it out"
    elif index == SOFT_LIMITS:
        what = "would not move with offset_counts: give soft_limits = [low, high] in rad"
    elif index in STOP_OBJECTS and parameter.value <= 0:
        what = f"is {parameter.value}, which lets the leg drop: give 1 to 4"
    elif index == FOLLOWING_WINDOW and parameter.value == NO_WINDOW:
        what = "switches the following error off: give a window in counts"
    if what is not None:
        raise ConfigError(f"node '{name}': parameter {parameter} {what}")
