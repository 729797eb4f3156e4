"""Facts of a run that pictures show besides its rows: description, model and results."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from legbench.design.leg import LegDesign
from legbench.kinematics import modal_to_joint
from legbench.metrics.rating_text import rated_lines, rating_text
from legbench.metrics.summary import Summary
from legbench.recording.description import RunDescription


@dataclass(frozen=True, slots=True, kw_only=True)
class Facts:
    """Facts of a run that pictures show: its description, and the model that it keeps."""

    run: RunDescription

    @property
    def rest(self) -> tuple[float, float] | None:
        """Joint angles of the posture z = (0, z2) about which the controller moves the leg [rad];
        none: its settings have no z2.
        """
        if self.run.z2 is None:
            return None
        q1, q2 = modal_to_joint(np.array([0.0, self.run.z2]), self.run.convention)
        return (float(q1), float(q2))

    @property
    def headline(self) -> str:
        """Design, setup and controller in one line."""
        run = self.run
        values = (("z2", run.z2), ("dz2", run.dz2))
        settings = [f"{name} = {value:g}" for name, value in values if value is not None]
        words = [run.design.name, run.setup.kind.value, run.controller, ", ".join(settings)]
        # A word that is both setup and controller, the jump, is named once.
        return " · ".join(filter(None, dict.fromkeys(words)))


def facts_of(run: RunDescription) -> Facts:
    """Return the facts of a run that pictures need."""
    return Facts(run=run)


def _shown(value: object) -> str:
    return f"{value:g}" if isinstance(value, float) else str(value)


def as_markdown(facts: Facts, summary: Summary | None = None, against: Sequence[str] = ()) -> str:
    """The run's facts as a document: what ran, on what, what came of it, what it is shown with."""
    run = facts.run
    lines = [f"**{facts.headline}**", "", f"run `{run.id}`", ""]
    ending = {
        "created": run.created,
        "status": run.status,
        "cause": run.cause,
        "rows": run.rows,
        "duration": run.duration,
    }
    lines += [f"- {key}: {_shown(value)}" for key, value in ending.items() if value is not None]
    if against:
        lines += ["", "**drawn over it**", "", *(f"- {name}" for name in against)]
    if summary is not None:
        lines += _section("what came of it", _results(summary))
        lines += _section("note", {str(n): text for n, text in enumerate(summary.warnings, 1)})
    for name, table in run.experiment.items():
        if isinstance(table, Mapping):
            lines += _section(name, _design_rows(run.design) if name == "design" else table)
    return "\n".join(lines) + "\n"


def _section(name: str, entries: Mapping[str, Any]) -> list[str]:
    rows = [f"- {key}: {_shown(value)}" for key, value in _flat(entries) if value is not None]
    return ["", f"**{name}**", "", *rows] if rows else []


def _flat(entries: Mapping[str, Any]) -> Iterator[tuple[str, object]]:
    """Entries of a table and of the tables in it, such as the settings of a controller."""
    for key, value in entries.items():
        if isinstance(value, Mapping):
            yield from _flat(value)
        else:
            yield key, value


def _results(summary: Summary) -> dict[str, str]:
    """Ratings and figures that the run shows."""
    figures = {
        "trunk excursion": (1e3 * summary.trunk_excursion, "mm"),
        "foot clearance": (1e3 * summary.foot_clearance, "mm"),
        "drift, 3 jumps": (1e3 * summary.drift, "mm"),
        "hopping": (summary.hop_freq, "Hz"),
        "polar angle, max": (summary.polar_max, "rad"),
    }
    return {
        f"P^r {line.kind}, about the {line.reference}": rating_text(line.values)
        for line in rated_lines(summary)
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
