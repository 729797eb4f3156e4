"""What a measurement needs to know of a run: its rows, and the terms its manifest sets."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import Any, Protocol, TypeVar

from numpy.typing import NDArray

from legbench.design.leg import LegDesign
from legbench.design.setup import SetupKind
from legbench.design.toml import design_from_mapping
from legbench.errors import DesignError, FormatError
from legbench.kinematics import ModalConvention
from legbench.signals import Floats

Choice = TypeVar("Choice", bound=StrEnum)


class Recorded(Protocol):
    """The part of a recording that is measured; `legbench.recording` fulfils it."""

    @property
    def path(self) -> Path:
        """The run folder."""
        ...

    @property
    def manifest(self) -> Mapping[str, Any]:
        """What the run was made of, as JSON."""
        ...

    @property
    def time(self) -> Floats:
        """Plant time of every row (n,) [s]."""
        ...

    @property
    def has_truth(self) -> bool:
        """Whether a simulation filled the truth signals."""
        ...

    def __getitem__(self, name: str, /) -> NDArray[Any]:
        """Rows of the signal `name`, (n,) or (n, 2)."""
        ...


class Reference(StrEnum):
    """What `q_d` of eq. (14) is."""

    MOTOR = "motor"
    """The measured motor position, as printed; gravity's sag counts as deflection."""
    EQUILIBRIUM = "equilibrium"
    """The posture at which the springs carry the leg for that motor position."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Terms:
    """The entries of a manifest that decide how its rows are measured."""

    design: LegDesign
    setup: SetupKind
    convention: ModalConvention
    reference: Reference
    controller: str
    """Kind of controller; empty when the manifest names none."""
    deflection: float
    """dz2 of the controller in the run's own modal convention [rad]; NaN when it has none."""


def _choice(kinds: type[Choice], value: object, entry: str) -> Choice:
    try:
        return kinds(value)
    except ValueError:
        known = ", ".join(kind.value for kind in kinds)
        raise FormatError(f"manifest {entry} is {value!r}; known are {known}") from None


def terms_of(manifest: Mapping[str, Any]) -> Terms:
    """Read the terms of measurement from a run's manifest.

    Raises:
        FormatError: the manifest describes no leg, or names a setup, a modal convention or a
            rating reference that does not exist; the message lists those that do.
    """
    try:
        design = design_from_mapping(manifest.get("design", {}))
    except DesignError as error:
        raise FormatError(f"manifest design: {error}") from None
    conventions = manifest.get("conventions", {})
    controller = manifest.get("controller", {})
    deflection = controller.get("dz2")
    try:
        deflection = math.nan if deflection is None else abs(float(deflection))
    except (TypeError, ValueError, OverflowError):
        raise FormatError(
            f"manifest controller.dz2 is {deflection!r:.60}; it must be a number [rad]"
        ) from None
    return Terms(
        design=design,
        setup=_choice(SetupKind, manifest.get("setup", {}).get("kind"), "setup.kind"),
        convention=_choice(
            ModalConvention,
            conventions.get("modal", ModalConvention.ORTHONORMAL),
            "conventions.modal",
        ),
        reference=_choice(
            Reference,
            conventions.get("rating_reference", Reference.MOTOR),
            "conventions.rating_reference",
        ),
        controller=str(controller.get("kind", "")),
        deflection=deflection,
    )
