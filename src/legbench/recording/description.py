"""Description of a run: `run.json`, parsed once for everybody who measures or draws the run."""

from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum
from types import MappingProxyType
from typing import Any, Final

from legbench.design.leg import LegDesign
from legbench.design.setup import Setup, SetupKind
from legbench.design.toml import design_from_mapping
from legbench.errors import ConfigError, DesignError, FormatError
from legbench.imperfections import Imperfections
from legbench.kinematics import ModalConvention
from legbench.phases import Counting, PhaseInfo
from legbench.recording.columns import ONE_LEG, Layout
from legbench.recording.controller_table import declared_signals, parse_controller
from legbench.recording.format_1 import upgraded
from legbench.recording.imperfections_table import parse_imperfections
from legbench.recording.layout import COMPLETE, FORMAT
from legbench.recording.tables import ManifestTable

Angles = tuple[float, float]

BARS: Final = "bars"
"""Linkage that has cranks and bars to draw."""

CRANK_LENGTH: Final = 0.02
"""Length of the cranks of runs whose manifest does not tell it [m]."""

IDEAL_LINKAGE: Final = frozenset({"analytic"})
"""Plants whose equations are those of an ideal linkage, whatever linkage was asked for."""


class Reference(StrEnum):
    """Reference from which eq. (14) measures a deflection, `q_d`."""

    MOTOR = "motor"
    """The measured motor position, as printed; gravity's sag counts as deflection."""
    EQUILIBRIUM = "equilibrium"
    """The posture at which the springs carry the leg for that motor position."""


class ReferenceChoice(StrEnum):
    """Reference that an experiment asks for: one of the two, or the one that suits its setup."""

    SETUP = "setup"
    """The equilibrium in a fixed setup, where gravity's sag would hide all else; the motor in a
    jump."""
    MOTOR = "motor"
    EQUILIBRIUM = "equilibrium"


@dataclass(frozen=True, slots=True, kw_only=True)
class InitialState:
    """Posture that a run begins in, at rest."""

    joint_pos: Angles
    """Link angles q1, q2 [rad]."""
    motor_pos: Angles
    """Motor positions [rad]."""


@dataclass(frozen=True, slots=True, kw_only=True)
class RunDescription:
    """Description of a run: its parts, how it is to be measured, and how it ended."""

    id: str
    """Name of the run: that of its folder when it was written."""
    created: str | None
    """Time at which it began, ISO 8601."""
    design: LegDesign
    setup: Setup
    linkage: str | None
    """Kind of linkage; none: the plant has the ideal one of its equations."""
    crank_length: float | None
    """Length of hip crank and thigh extension [m]; none: a linkage without bars."""
    convention: ModalConvention
    """Reading of eq. (15) in which the run's modal coordinates are shown."""
    reference: Reference
    """Reference of the ratings that are shown first; the other's are shown besides."""
    controller: str
    """Kind of controller, as a title alone."""
    phases: tuple[PhaseInfo, ...]
    """Phases that the controller declared."""
    counting: Counting
    """Oscillation periods that count in a rating."""
    layout: Layout
    """Columns of the run's samples, the controller's own signals among them."""
    z2: float | None
    """Radial set point of the controller's settings [rad]; none: it has no such setting."""
    dz2: float | None
    """Amplitude about that set point [rad]; none: there is no such setting."""
    plant: str | None
    """Kind of plant, as a title alone."""
    status: str | None
    """How the run ended: complete, interrupted, fault, recovered, or running."""
    cause: str | None
    """Cause of an early end; none if the run came to its end."""
    rows: int | None
    """Number of rows that were recorded."""
    duration: float | None
    """Plant time from the first row to the last [s]."""
    planned_duration: float | None
    """Plant time that was asked for [s]."""
    period: float | None
    """Time from row to row [s]."""
    looks_only: bool
    """Whether the plant was only looked at, so that commands went nowhere."""
    initial_state: InitialState | None
    versions: Mapping[str, str]
    """Version by package."""
    model_hash: str | None
    """SHA-256 of the run's MJCF."""
    imperfections: Imperfections
    """What the leg had that its controller did not know of."""
    experiment: Mapping[str, Any]
    """Tables of the experiment as its file has them, for those who want to run it again."""

    @property
    def jumps(self) -> bool:
        """Whether the leg hops, so that stance and flight tell the run apart, not periods."""
        return self.setup.kind is SetupKind.JUMP

    @property
    def title(self) -> str:
        """Plant, linkage and design, as far as they are known."""
        return " / ".join(filter(None, [self.plant, self.linkage, self.design.name]))

    @property
    def complete(self) -> bool:
        """Whether the run came to its end."""
        return self.status == COMPLETE


def describe(manifest: Mapping[str, Any], fallback_id: str = "") -> RunDescription:
    """Parse a manifest of any format up to this one.

    Args:
        manifest: content of `run.json`.
        fallback_id: name of a run whose manifest does not tell it.

    Raises:
        FormatError: it describes no leg, controller or setup that can be, names a convention that
            does not exist, or has an entry of a wrong type.
    """
    head = ManifestTable(
        entries=upgraded(manifest) if manifest.get("format", FORMAT) == 1 else manifest
    )
    # Messages leave out "experiment": the entries have the same names in either format.
    experiment = ManifestTable(entries=head.table("experiment").entries)
    controller, provenance = experiment.table("controller"), head.table("provenance")
    settings, conventions = controller.table("settings"), experiment.table("conventions")
    kind = head.table("plant").text("kind") or experiment.table("plant").text("kind")
    said = parse_controller(head.table("controller"))
    design, setup = _design(experiment.table("design")), _setup(experiment.table("setup"))
    return RunDescription(
        id=head.text("id") or fallback_id,
        created=head.text("created"),
        design=design,
        setup=setup,
        linkage=None if kind in IDEAL_LINKAGE else experiment.table("linkage").text("kind"),
        crank_length=_crank_length(experiment.table("linkage")),
        convention=conventions.choice("modal", ModalConvention, ModalConvention.ORTHONORMAL),
        reference=_reference(conventions, setup.kind),
        controller=head.table("controller").text("kind") or controller.text("kind") or "",
        phases=said.phases,
        counting=said.counting,
        layout=layout_of(manifest),
        z2=_setting(settings, "z2"),
        dz2=_setting(settings, "dz2"),
        plant=kind,
        status=head.text("status"),
        cause=head.text("cause"),
        rows=head.whole("rows"),
        duration=head.number("duration"),
        planned_duration=experiment.number("duration"),
        period=head.number("period"),
        looks_only=head.table("plant").table("bus").entries.get("read_only") is True,
        initial_state=_initial_state(head.table("initial_state")),
        versions=_versions(provenance.table("versions")),
        model_hash=provenance.text("mjcf_sha256"),
        imperfections=parse_imperfections(experiment.table("imperfections").entries),
        experiment=MappingProxyType(dict(experiment.entries)),
    )


def _versions(table: ManifestTable) -> Mapping[str, str]:
    return MappingProxyType({str(name): str(text) for name, text in table.entries.items()})


def layout_of(manifest: Mapping[str, Any]) -> Layout:
    """Columns of the samples of a run with this manifest, of any format up to this one.

    Raises:
        FormatError: the manifest declares signals that no run can have.
    """
    if manifest.get("format", FORMAT) == 1:
        return ONE_LEG
    try:
        return Layout(own=declared_signals(manifest))
    except ConfigError as error:
        raise FormatError(f"manifest controller: {error}") from None


def _design(table: ManifestTable) -> LegDesign:
    try:
        return design_from_mapping(table.entries)
    except DesignError as error:
        raise FormatError(f"manifest design: {error}") from None


def _setup(table: ManifestTable) -> Setup:
    try:
        return Setup(kind=table.choice("kind", SetupKind), boom_radius=table.number("boom_radius"))
    except ConfigError as error:
        raise FormatError(f"manifest setup: {error}") from None


def _reference(conventions: ManifestTable, setup: SetupKind) -> Reference:
    """Reference by which a run is judged."""
    asked = conventions.choice("rating_reference", ReferenceChoice, ReferenceChoice.SETUP)
    if asked is ReferenceChoice.SETUP:
        return Reference.MOTOR if setup is SetupKind.JUMP else Reference.EQUILIBRIUM
    return Reference(asked.value)


def _crank_length(linkage: ManifestTable) -> float | None:
    if linkage.text("kind") != BARS:
        return None
    length = linkage.number("crank_length")
    return CRANK_LENGTH if length is None else length


def _setting(settings: ManifestTable, key: str) -> float | None:
    """Setting of a controller when it is a number; a guest may mean anything by the word."""
    found = settings.entries.get(key)
    number = isinstance(found, int | float) and not isinstance(found, bool)
    return settings.number(key) if number else None


def _initial_state(table: ManifestTable) -> InitialState | None:
    joint_pos, motor_pos = table.pair("joint_pos"), table.pair("motor_pos")
    if joint_pos is None or motor_pos is None:
        return None
    return InitialState(joint_pos=joint_pos, motor_pos=motor_pos)
