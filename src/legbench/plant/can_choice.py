"""Choosing servo drives on a CAN bus; imports python-can only when the bus is opened."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, ClassVar, Final

from legbench.choices import choose
from legbench.drives.emulated.faults import Fault
from legbench.guests import WHERE, load_text
from legbench.limits.safety import SafetyLimits
from legbench.plant.landing import End
from legbench.plant.opening import Leg, OpenPlant
from legbench.shipped import locate

if TYPE_CHECKING:
    from legbench.drives.setup.config import BusConfig

EMULATED: Final = "legbench"
"""Interface of the emulated leg in this process, in virtual time."""
LIMITS_NAME: Final = "limits.toml"
"""Name of the limits file beside the bus file."""
BUS_LOG: Final = "bus.log"
"""Name of the file of raw frames in the run folder, in candump format."""
_WHERE: Final[Mapping[str, bool]] = WHERE


@dataclass(frozen=True, slots=True, kw_only=True)
class CanChoice:
    """Settings of the CAN plant: servo drives on a bus, real or emulated."""

    kind: ClassVar[str] = "can"
    imperfect: ClassVar[bool] = True
    bus: Path = field(default=Path("hardware/leg.toml"), metadata=_WHERE)
    """Bus file, which describes the drives."""
    interface: str | None = field(default=None, metadata=_WHERE)
    """Name of the interface in python-can, legbench for an emulated leg; else the bus file's."""
    channel: str | None = field(default=None, metadata=_WHERE)
    """Channel such as can0; by default the bus file's."""
    bitrate: int | None = None
    """Bitrate of interfaces that set their own; by default the bus file's [bit/s]."""
    read_only: bool = False
    """Whether to observe without changing a drive; commands are recorded and not sent."""
    limits: SafetyLimits | None = None
    """Safety limits, by default those of limits.toml beside the bus file [a limits file]."""
    end: End = End.REST
    """End of a run whose time is over: rest leads the leg to its start posture and waits until it
    is still, for 30 s at most; stop is a quick stop at the last row, in mid-flight, too."""
    faults: tuple[Fault, ...] = ()
    """Faults to inject into the emulated leg in this process, on its virtual time."""

    def __post_init__(self) -> None:
        choose(self, end=End)

    @property
    def bus_file(self) -> Path:
        """Bus file that is read.

        Where the one that is named is not there, emulated drives take the package's own; real ones
        are never driven by a file that their laboratory has not written.
        """
        return locate(self.bus) if self.interface == EMULATED else self.bus

    def is_virtual(self, config: "BusConfig") -> bool:
        """Whether it is the emulated leg in this process, in virtual time."""
        return (self.interface or config.interface) == EMULATED

    def open(self, leg: Leg) -> OpenPlant:
        """Open the leg on its bus.

        Raises:
            ConfigError: a file or a setting makes no sense, or limits are looser than the design's.
            BusError: the interface is not there, is down, or has a master.
            DriveError: a drive is missing, is another one, or refuses its configuration.
        """
        return load_text("legbench.plant.can_open:open_can")(self, leg)
