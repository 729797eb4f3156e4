"""What a picture must know of a run besides its rows."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from legbench.design.leg import LegDesign
from legbench.design.setup import SetupKind
from legbench.kinematics import modal_to_joint
from legbench.metrics.source import Terms, terms_of
from legbench.metrics.summary import Summary
from legbench.viz.entries import number_of


@dataclass(frozen=True, slots=True, kw_only=True)
class Facts:
    """What a run's manifest says to a picture."""

    run_id: str
    terms: Terms
    manifest: Mapping[str, Any]
    crank_length: float | None = None
    """Of the parallel bars [m]; none: the linkage has no bars."""

    @property
    def design(self) -> LegDesign:
        """The leg."""
        return self.terms.design

    @property
    def jumps(self) -> bool:
        """Whether stance and flight tell the run apart, rather than periods."""
        return self.terms.setup is SetupKind.JUMP

    @property
    def controller(self) -> Mapping[str, Any]:
        """The controller's table; empty when the manifest has none."""
        return self.manifest.get("controller", {})

    @property
    def rest(self) -> tuple[float, float] | None:
        """Joint angles of the posture z = (0, z2) that the controller starts from [rad]."""
        if (z2 := self.controller.get("z2")) is None:
            return None
        q1, q2 = modal_to_joint(np.array([0.0, float(z2)]), self.terms.convention)
        return (float(q1), float(q2))

    @property
    def headline(self) -> str:
        """Design, setup and controller in one line."""
        settings = [
            f"{key} = {_shown(self.controller[key])}"
            for key in ("z2", "dz2")
            if key in self.controller
        ]
        setup, controller = self.terms.setup.value, self.terms.controller
        words = [self.design.name, setup, controller if controller != setup else ""]
        return " · ".join(filter(None, [*words, ", ".join(settings)]))


def facts_of(manifest: Mapping[str, Any], folder: Path) -> Facts:
    """Read what pictures need from a run's manifest and folder.

    Raises:
        FormatError: a manifest without a leg, or with an unknown setup or convention.
    """
    bars = manifest.get("linkage", {}).get("kind") == "bars"
    return Facts(
        run_id=str(manifest.get("id", folder.name)),
        terms=terms_of(manifest),
        manifest=manifest,
        crank_length=number_of(manifest, "linkage", "crank_length", 0.02) if bars else None,
    )


def _shown(value: object) -> str:
    return f"{value:g}" if isinstance(value, float) else str(value)


def as_markdown(facts: Facts, summary: Summary | None = None, against: Sequence[str] = ()) -> str:
    """The run's facts as a document: what ran, on what, what came of it, what it is shown with."""
    manifest = facts.manifest
    lines = [f"**{facts.headline}**", "", f"run `{facts.run_id}`", ""]
    lines += [
        f"- {key}: {_shown(manifest[key])}"
        for key in ("created", "status", "cause", "rows", "duration")
        if manifest.get(key) is not None
    ]
    if against:
        lines += ["", "**drawn over it**", "", *(f"- {name}" for name in against)]
    if summary is not None:
        lines += _section("what came of it", _results(summary))
    for name in ("controller", "setup", "linkage", "ground", "servo"):
        table = manifest.get(name)
        if isinstance(table, Mapping):
            lines += _section(name, table)
    return "\n".join([*lines, *_section("design", _design_rows(facts.design))]) + "\n"


def _section(name: str, entries: Mapping[str, Any]) -> list[str]:
    rows = [
        f"- {key}: {_shown(value)}"
        for key, value in entries.items()
        if value is not None and not isinstance(value, Mapping)
    ]
    return ["", f"**{name}**", "", *rows] if rows else []


def _results(summary: Summary) -> dict[str, str]:
    """Ratings and figures that the run shows."""
    ratings = {
        "P^r stance": summary.rating_stance,
        "P^r flight": summary.rating_flight,
        "P^r periods": summary.rating_periods,
    }
    figures = {
        "trunk excursion": (1e3 * summary.trunk_excursion, "mm"),
        "foot clearance": (1e3 * summary.foot_clearance, "mm"),
        "drift, 3 jumps": (1e3 * summary.drift, "mm"),
        "hopping": (summary.hop_freq, "Hz"),
        "polar angle, max": (summary.polar_max, "rad"),
    }
    return {
        name: f"{min(values):.4f} lowest, {values[-1]:.4f} last of {len(values)}"
        for name, values in ratings.items()
        if values
    } | {
        name: f"{value:.3g} {unit}"
        for name, (value, unit) in figures.items()
        if math.isfinite(value)
    }


def _design_rows(design: LegDesign) -> dict[str, str]:
    return {
        "segments": " + ".join(f"{1e3 * length:g}" for length in design.lengths) + " mm",
        "total mass": f"{design.total_mass:g} kg",
        "stiffness": " / ".join(f"{value:g}" for value in design.stiffness) + " N m/rad",
        "damping": " / ".join(f"{value:g}" for value in design.damping) + " N m s/rad",
    }
