"""Leg and controller of a recorded run, read from its manifest, with edits."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any, Final, TypeVar

from legbench.control import CONTROLLERS, ControllerSettings, LegTargets, make_controller
from legbench.control.abstract import AbstractController
from legbench.design import LegDesign
from legbench.design.setup import Setup
from legbench.errors import ConfigError
from legbench.experiment.data import Conventions, check_seed
from legbench.experiment.format_1 import upgraded
from legbench.experiment.overrides import overlaid
from legbench.experiment.reading import REGISTRY, placed
from legbench.experiment.tables import read_tables
from legbench.guests import GuestError
from legbench.imperfections import Imperfections
from legbench.mjcf.options import BuildOptions, Ground, Linkage, Numerics
from legbench.plant.opening import PlantSettings
from legbench.plants import PLANTS, SimChoice
from legbench.recording.reader import Recording
from legbench.servo import PERFECT, ServoConfig
from legbench.shipped import locate

Edits = Mapping[str, Any]
"""Dotted key of an entry of the experiment -> its new value, as `--set` has them."""
Read = TypeVar("Read", "RecordedLeg", "RecordedController")
REGISTRIES: Final = {"controller": CONTROLLERS, "plant": PLANTS}


@dataclass(frozen=True, slots=True, kw_only=True)
class RecordedLeg:
    """Leg and plant of a recorded run: everything of its experiment but the controller.

    Raises:
        ConfigError: the seed is none, or no leg has these imperfections.
    """

    design: LegDesign
    setup: Setup = field(default_factory=Setup)
    linkage: Linkage = field(default_factory=Linkage)
    ground: Ground = field(default_factory=Ground)
    numerics: Numerics = field(default_factory=Numerics)
    servo: ServoConfig = field(default_factory=ServoConfig)
    imperfections: Imperfections = PERFECT
    conventions: Conventions = field(default_factory=Conventions)
    plant: PlantSettings = field(default_factory=SimChoice, metadata={REGISTRY: PLANTS})
    seed: int = 0

    def __post_init__(self) -> None:
        check_seed(self.seed)
        self.imperfections.leg_of(self.design)
        self.options.built(self.imperfections)

    @property
    def options(self) -> BuildOptions:
        """Options of the model besides the design."""
        return BuildOptions(
            setup=self.setup, linkage=self.linkage, ground=self.ground, numerics=self.numerics
        )

    @property
    def targets(self) -> LegTargets:
        """Set points of the leg in its setup."""
        return _targets(self.design, self.setup, self.conventions)


@dataclass(frozen=True, slots=True, kw_only=True)
class RecordedController:
    """Controller of a recorded run, and what it knows of the leg."""

    design: LegDesign
    controller: ControllerSettings = field(metadata={REGISTRY: CONTROLLERS})
    setup: Setup = field(default_factory=Setup)
    conventions: Conventions = field(default_factory=Conventions)

    def build(self) -> AbstractController:
        """Make the controller anew; raises ConfigError where the leg refuses its settings."""
        targets = _targets(self.design, self.setup, self.conventions)
        return make_controller(self.controller, targets)


def _targets(design: LegDesign, setup: Setup, conventions: Conventions) -> LegTargets:
    return LegTargets(
        designs=design,
        support=setup.support,
        meaning=conventions.setpoint,
        convention=conventions.modal,
    )


def recorded_leg(
    recording: Recording, edits: Edits | None = None, *, plant: str | None = None
) -> RecordedLeg:
    """Leg of a run, and the plant that it ran on.

    Args:
        recording: the run; its controller need not be there.
        edits: entries of its experiment that are replaced; paths in them are absolute.
        plant: another kind of plant, with its usual settings.

    Raises:
        FormatError: the run describes no leg.
        ConfigError: an edit makes no sense, or the plant is one that this version lacks.
    """
    chosen = dict(edits or {}) | ({} if plant is None else {"plant.kind": plant})
    return _read(RecordedLeg, recording, chosen)


def recorded_controller(recording: Recording, edits: Edits | None = None) -> RecordedController:
    """Controller of a run; one from a file is that of the copy in the run folder.

    Args:
        recording: the run; its plant need not be there.
        edits: entries of its experiment that are replaced; paths in them are absolute.

    Raises:
        FormatError: the run describes no leg.
        ConfigError: an edit makes no sense, or the controller is one that this version lacks.
    """
    return _read(RecordedController, recording, edits or {})


def _read(kind: type[Read], recording: Recording, edits: Edits) -> Read:
    """Read those tables of a run's experiment that a class has fields for."""
    names = {entry.name for entry in fields(kind)}
    whole = dict(recording.description.experiment)
    if recording.manifest.get("format") == 1:
        whole = _said(upgraded(whole))
    tables = {name: whole[name] for name in names if name in whole}
    for key, value in edits.items():
        if key.partition(".")[0] in names:
            tables = overlaid(tables, key, value, recording.path)
        else:
            raise ConfigError(f"--set {key}: this replay has {', '.join(sorted(names))}")
    for what in names & REGISTRIES.keys():
        tables = _with_own_copy(tables, recording, what)
        _check_known(tables, recording, what)
    return read_tables(kind, tables, recording.path, json=True)


def _said(tables: Mapping[str, Any]) -> dict[str, Any]:
    """Tables without what format 1 wrote as null, meaning that it is not there."""
    return {
        key: _said(value) if isinstance(value, Mapping) else value
        for key, value in tables.items()
        if value is not None
    }


def _with_own_copy(tables: dict[str, Any], recording: Recording, what: str) -> dict[str, Any]:
    """Tables in which a guest from an installed module is the copy that the run folder has."""
    table = tables.get(what)
    provenance = recording.manifest.get("provenance")
    copies = provenance.get("guests") if isinstance(provenance, Mapping) else None
    entry = copies.get(what) if isinstance(copies, Mapping) else None
    file = entry.get("file") if isinstance(entry, Mapping) else None
    kind = table.get("kind") if isinstance(table, Mapping) else None
    whole = recording.description.experiment.get(what)
    if not isinstance(kind, str) or not isinstance(file, str) or not isinstance(table, Mapping):
        return tables
    edited = not isinstance(whole, Mapping) or kind != whole.get("kind")
    if edited or Path(file).name != file or not (recording.path / file).is_file():
        return tables
    copy = f"{file}:{kind.rpartition(':')[2]}"
    try:
        REGISTRIES[what].find(placed(copy, recording.path))
    except GuestError:  # A part of a package does not import alone: the installed one has to do.
        return tables
    return tables | {what: {**table, "kind": copy}}


def _check_known(tables: Mapping[str, Any], recording: Recording, what: str) -> None:
    """Refuse a controller or plant that this version lacks; raises ConfigError."""
    table = tables.get(what)
    kind = table.get("kind") if isinstance(table, Mapping) else None
    if kind is None and what == "plant":
        return
    if not isinstance(kind, str):
        raise ConfigError(f"{recording.path} does not tell its {what}: there is none to replay")
    try:
        REGISTRIES[what].find(placed(kind, recording.path))
    except ConfigError as error:
        raise ConfigError(
            f"{recording.path} needs {what} '{kind}', which is not to be had here: {error}"
        ) from error


def paths_from_here(edits: Sequence[tuple[str, Any]]) -> dict[str, Any]:
    """Edits by key, in which files that were named on the command line are absolute.

    Args:
        edits: dotted keys and values, as `parse_setting` returns them.
    """
    return {key: _absolute(value) for key, value in edits}


def _absolute(value: Any) -> Any:
    if not isinstance(value, str):
        return value
    place, colon, name = value.rpartition(":")
    if colon and place.endswith(".py"):
        return f"{Path(place).absolute()}:{name}"
    return str(locate(Path(value)).absolute()) if value.endswith((".toml", ".py")) else value
