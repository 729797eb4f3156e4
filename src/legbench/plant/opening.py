"""Opening of a plant: its leg, its settings, and what belongs to a run on it besides the plant."""

from collections.abc import Callable, Collection
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, ClassVar, Protocol, runtime_checkable

from legbench.clock import AbstractClock, VirtualClock
from legbench.design import LegDesign
from legbench.errors import ConfigError
from legbench.imperfections import Imperfections
from legbench.mjcf.options import BuildOptions
from legbench.plant.abstract import AbstractPlant
from legbench.plant.start import Start
from legbench.servo import PERFECT, ServoConfig

if TYPE_CHECKING:
    from legbench.recording.writer import RunWriter


def _nobody(known: Collection[str]) -> tuple[str, ...]:
    """Nobody runs on a plant whose controllers are not known."""
    return ()


@dataclass(frozen=True, slots=True, kw_only=True)
class Needs:
    """What the controller of a run needs of the plant."""

    controller: str = ""
    """Kind of the controller."""
    signals: frozenset[str] = frozenset()
    """Names of the measured signals that it cannot do without."""
    run_on: Callable[[Collection[str]], tuple[str, ...]] = _nobody
    """Kinds of the controllers that can run where only some signals are known."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Leg:
    """Leg that the plant is to be."""

    design: LegDesign
    """Design that the controller believes."""
    options: BuildOptions
    """Options of the model of that design."""
    start: Start
    servo: ServoConfig
    imperfections: Imperfections = PERFECT
    """What the leg has that its controller does not know of."""
    seed: int = 0
    """Source of all randomness."""
    needs: Needs = field(default_factory=Needs)
    """What its controller needs; by default nothing is asked for."""


def _no_log(writer: "RunWriter") -> None:
    """Log nothing, as most plants do."""


def _nothing() -> str | None:
    """Return no events, as most plants have none."""
    return None


@dataclass(frozen=True, slots=True, kw_only=True)
class OpenPlant:
    """Plant that is ready to be reset, and what belongs to a run on it."""

    plant: AbstractPlant
    clock: AbstractClock = field(default_factory=VirtualClock)
    """Clock that paces the plant if no other one is asked for."""
    facts: dict[str, Any] = field(default_factory=dict)
    """Entries of a run's manifest about the plant."""
    notes: tuple[str, ...] = ()
    """What a person should know before anything moves, such as what does not protect the leg."""
    start_log: Callable[["RunWriter"], None] = _no_log
    """Function that begins a log beside the rows, such as raw frames, see `RunWriter.log`."""
    events: Callable[[], dict[str, dict[str, Any]]] = dict
    """Function that returns the events of the end of a run on it, by name."""
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
    """Name of the plant in files and on the command line."""

    def open(self, leg: Leg) -> AbstractPlant | OpenPlant:
        """Open the plant of this leg; nothing moves before its `reset`."""
        ...


def open_plant(settings: PlantSettings, leg: Leg) -> OpenPlant:
    """Open the plant of some settings; nothing moves before its `reset`.

    Raises:
        ConfigError: a file or a setting makes no sense, limits are looser than the design's, or
            the plant cannot have the leg's imperfections.
        BusError: the interface is not there, is down, or has a master.
        DriveError: a drive is missing, is another one, or refuses its configuration.
    """
    if not (leg.imperfections.perfect or getattr(type(settings), "imperfect", False)):
        raise ConfigError(
            f"plant '{settings.kind}' knows no imperfections: leave them out, or give its settings "
            "`imperfect: ClassVar[bool] = True` once it obeys `leg.imperfections`"
        )
    opened = settings.open(leg)
    return opened if isinstance(opened, OpenPlant) else OpenPlant(plant=opened)
