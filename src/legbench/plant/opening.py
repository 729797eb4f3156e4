"""What a plant is opened with, and what belongs to a run on it besides the plant."""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, ClassVar, Protocol, runtime_checkable

from legbench.clock import AbstractClock, VirtualClock
from legbench.design import LegDesign
from legbench.mjcf.options import BuildOptions
from legbench.plant.abstract import AbstractPlant
from legbench.plant.start import Start
from legbench.servo import ServoConfig

if TYPE_CHECKING:
    from legbench.recording.writer import RunWriter


@dataclass(frozen=True, slots=True, kw_only=True)
class Leg:
    """The leg that the plant is to be."""

    design: LegDesign
    options: BuildOptions
    start: Start
    servo: ServoConfig


def _no_log(writer: "RunWriter") -> None:
    """Most plants log nothing of their own."""


def _nothing() -> str | None:
    """Most plants have nothing to tell."""
    return None


@dataclass(frozen=True, slots=True, kw_only=True)
class OpenPlant:
    """A plant that is ready to be reset, and what belongs to a run on it."""

    plant: AbstractPlant
    clock: AbstractClock = field(default_factory=VirtualClock)
    """What paces it if nobody asks for another pace."""
    facts: dict[str, Any] = field(default_factory=dict)
    """What a run has to say of it."""
    start_log: Callable[["RunWriter"], None] = _no_log
    """Begin to log beside the rows of a run, such as raw frames, with `RunWriter.log`."""
    events: Callable[[], dict[str, dict[str, Any]]] = dict
    """What a run on it has to tell in the end, by name."""
    realtime: bool = False
    """Whether the machine's clock paces it: whoever holds up its loop holds up drives."""
    gone: Callable[[], str | None] = _nothing
    """Why a run that has lasted its time was none to its end, asked before the plant is closed."""
    trouble: Callable[[], str | None] = _nothing
    """What a person beside the plant has to know once it is closed, such as a drive with power."""


@runtime_checkable
class PlantSettings(Protocol):
    """Settings of a plant: a frozen dataclass whose fields become TOML keys and flags."""

    kind: ClassVar[str]
    """Name in files and on the command line."""

    def open(self, leg: Leg) -> AbstractPlant | OpenPlant:
        """The plant of this leg; nothing moves before its `reset`."""
        ...


def open_plant(settings: PlantSettings, leg: Leg) -> OpenPlant:
    """Open the plant of some settings; nothing moves before its `reset`.

    Raises:
        ConfigError: a file or a setting makes no sense, or limits are looser than the design's.
        BusError: the interface is not there, is down, or has a master.
        DriveError: a drive is missing, is another one, or refuses its configuration.
    """
    opened = settings.open(leg)
    return opened if isinstance(opened, OpenPlant) else OpenPlant(plant=opened)
