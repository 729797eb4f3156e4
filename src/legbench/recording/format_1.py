"""Run folders of format 1, which name a controller and its settings but do not describe it.

The kinds of controllers that existed then are known here and nowhere else: a run of format 1 can
only be of one of them.
"""

import math
from collections.abc import Mapping
from typing import Any, Final

from legbench.errors import ConfigError, FormatError
from legbench.phases import ControllerDescription, Counting, PhaseInfo, Role
from legbench.recording.controller_table import controller_table
from legbench.recording.tables import ManifestTable

TABLES: Final = (
    "design",
    "setup",
    "linkage",
    "ground",
    "numerics",
    "servo",
    "controller",
    "conventions",
    "seed",
)
"""Entries that format 2 holds in its table `experiment`."""

OF_PLANT: Final = ("accuracy", "limits", "bus", "realtime")
"""Entries that format 2 holds in its table `plant`."""

OF_PROVENANCE: Final = ("versions", "mjcf_sha256")
"""Entries that format 2 holds in its table `provenance`."""

AT_REST: Final = PhaseInfo(code=0, name="rest", role=Role.REST)
"""Phase of every controller."""

PHASES: Final = {
    "position-jump": (PhaseInfo(code=1, name="stepped", role=Role.ACTING),),
    "bang-bang": (
        PhaseInfo(code=2, name="middle", role=Role.ACTING),
        PhaseInfo(code=3, name="folded", role=Role.ACTING),
        PhaseInfo(code=4, name="stretched", role=Role.ACTING),
    ),
}
"""Further phases by the kind of their controller, but those of the jump."""

SMALLEST: Final = 0.1
"""Share of dz2 that an oscillation after a position jump must exceed to count [-] (Fig. 5)."""

BANG_BANG_PERIODS: Final = 20
"""Number of periods of a bang-bang run that count (Fig. 5)."""


def built_in(kind: str, settings: Mapping[str, Any]) -> ControllerDescription:
    """Description of a controller that format 1 knew, from its kind and its settings.

    Any other kind gets the phases of all of them, since they shared one numbering.

    Raises:
        FormatError: a setting that decides how a run is measured is no number.
    """
    table = ManifestTable(entries=settings, path="controller")
    jump = _jump_phases(table.number("touchdown_time") or 0.0)
    families = {**PHASES, "jump": jump}
    chosen = [families[kind]] if kind in families else families.values()
    phases = (AT_REST, *(phase for family in chosen for phase in family))
    counting = Counting()
    if kind == "bang-bang":
        counting = Counting(most=BANG_BANG_PERIODS)
    elif kind == "position-jump":
        dz2 = table.number("dz2")
        if dz2 is not None and math.isfinite(dz2):
            counting = Counting(smallest=SMALLEST * abs(dz2))
    return ControllerDescription(phases=phases, counting=counting)


def _jump_phases(touchdown_time: float) -> tuple[PhaseInfo, ...]:
    """Phases of the jump; a load is called ground once it has lasted for `touchdown_time` [s]."""
    return (
        PhaseInfo(code=5, name="flight", role=Role.FLIGHT),
        PhaseInfo(code=6, name="compress", role=Role.STANCE, late=touchdown_time),
        PhaseInfo(code=7, name="push", role=Role.STANCE),
        PhaseInfo(code=8, name="release", role=Role.FLIGHT),
    )


def upgraded(manifest: Mapping[str, Any]) -> dict[str, Any]:
    """Manifest of format 1 as format 2 would have written it, as far as it tells.

    The duration that was wished for is not known: format 1 wrote the reached one over it.

    Raises:
        FormatError: a setting of the controller is no number.
    """
    moved = {*TABLES, *OF_PLANT, *OF_PROVENANCE, "plant"}
    kept = {key: value for key, value in manifest.items() if key not in moved}
    experiment = _some(manifest, TABLES)
    if isinstance(manifest.get("plant"), str):
        experiment["plant"] = {"kind": manifest["plant"]}
    table = ManifestTable(entries=manifest).table("controller")
    kind = table.text("kind") or ""
    settings = {key: value for key, value in table.entries.items() if key != "kind"}
    if "controller" in manifest:
        experiment["controller"] = {"kind": kind, "settings": settings}
    return {
        **kept,
        "experiment": experiment,
        "controller": controller_table(kind, _known(kind, settings)),
        "provenance": _some(manifest, OF_PROVENANCE),
        "plant": _some(manifest, OF_PLANT),
    }


def _known(kind: str, settings: Mapping[str, Any]) -> ControllerDescription:
    try:
        return built_in(kind, settings)
    except ConfigError as error:
        raise FormatError(f"manifest controller: {error}") from None


def _some(manifest: Mapping[str, Any], keys: tuple[str, ...]) -> dict[str, Any]:
    return {key: manifest[key] for key in keys if key in manifest}
