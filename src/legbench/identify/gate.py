"""Identifiability of what is free, from the Jacobian of these very runs.

Columns are scaled to one length, and small singular values of the scaled Jacobian are directions
in which parameters may move together without changing what is measured.
"""

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from legbench.design.setup import SetupKind
from legbench.errors import ConfigError
from legbench.identify.parameters import GROUPS, NINE
from legbench.identify.problem import Misfit
from legbench.signals import Floats

SINGULAR: Final = 1e6
"""Condition of the scaled Jacobian from which a direction counts as invisible [-]. Slopes are
exact to 1e-10; runs that see nine parameters well have 20, runs that miss a direction 1e9."""
WEAK: Final = 50.0
"""Condition from which two parameters are hard to tell apart [-]."""
PART: Final = 0.02
"""Smallest part of a direction that is named, against its largest [-]."""


class UnidentifiableError(ConfigError):
    """Parameters that these runs cannot show."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Gate:
    """How well runs show what is free."""

    condition: float
    """Condition number of the scaled Jacobian [-]."""
    direction: dict[str, float]
    """Hardest direction to see: parts of the parameters, the largest 1 [-]."""
    blind: tuple[str, ...]
    """Parameters that leave no trace at all."""

    @property
    def open(self) -> bool:
        """Whether every direction is seen."""
        return not self.blind and self.condition < SINGULAR

    @property
    def weak(self) -> bool:
        """Whether a direction is seen, but badly."""
        return self.open and self.condition >= WEAK


def look(misfit: Misfit, names: Sequence[str]) -> Gate:
    """Decompose the Jacobian of some runs; `names` are those of its columns."""
    whole = np.concatenate([each.reshape(-1, len(names)) for each in misfit.jacobians])
    sizes = np.linalg.norm(whole, axis=0)
    seen = sizes > sizes.max() * 1e-9
    blind = tuple(name for name, visible in zip(names, seen, strict=True) if not visible)
    scaled = whole[:, seen] / sizes[seen]
    _, singular, right = np.linalg.svd(np.linalg.qr(scaled, mode="r"))
    hardest = right[-1] / sizes[seen]
    parts = hardest / hardest[np.argmax(np.abs(hardest))]
    direction = dict(zip(np.array(names)[seen].tolist(), parts.tolist(), strict=True))
    return Gate(
        condition=float(singular[0] / max(singular[-1], 1e-300)),
        direction=direction,
        blind=blind,
    )


def check_gate(gate: Gate, setups: Collection[SetupKind]) -> None:
    """Refuse runs that cannot show what is free.

    Raises:
        UnidentifiableError: a parameter leaves no trace, or some can change together unseen; says
            which, and what to add.
    """
    faults = []
    if gate.blind:
        faults.append(
            f"{', '.join(gate.blind)} leave no trace in these runs: {_for_blind(gate.blind)}"
        )
    if gate.condition >= SINGULAR:
        faults.append(
            f"{in_words(gate.direction)} (condition {gate.condition:.1g}): "
            f"{_remedy(gate.direction, setups)}"
        )
    if faults:
        raise UnidentifiableError("; ".join(faults))


def in_words(direction: dict[str, float]) -> str:
    """Say what changes together in a direction that cannot be seen."""
    named = {name: part for name, part in direction.items() if abs(part) >= PART}
    nine = {each.name for each in NINE}
    own = {name: part for name, part in named.items() if " of " not in name}
    alike = max(own.values()) - min(own.values()) < PART if own else False
    if alike and set(own) == nine:
        return "all nine scale together, and nothing that is measured changes"
    if alike and set(own) == nine - {"s1", "s2"}:
        return (
            "all nine scale together (those that leave a trace: "
            f"{', '.join(own)}), and nothing that is measured changes"
        )
    if alike and set(own) == nine | {"mass"}:
        return "all nine and the mass scale together, and nothing that is measured changes"
    if alike:
        return f"{', '.join(own)} scale together, and nothing that is measured changes"
    parts = ", ".join(f"{name} {part:+.2g}" for name, part in (own or named).items())
    return f"these change together, and nothing that is measured does: {parts}"


def _for_blind(blind: Sequence[str]) -> str:
    if set(blind) & {"s1", "s2", "mass"}:
        return "add a run with gravity (vfts or ffs), or do not free them"
    return "add a run that excites them, or do not free them"


def _remedy(direction: dict[str, float], setups: Collection[SetupKind]) -> str:
    """What to add to the runs so that a direction is seen."""
    if abs(direction.get("mass", 0.0)) >= PART:
        return "weigh the leg, give --mass and do not free the mass"
    named = {name for name, part in direction.items() if abs(part) >= PART}
    if not named & set(GROUPS["inertia"]):
        return "free fewer of them"
    if SetupKind.FFS not in setups:
        return "add a fixed-foot run (ffs) and the mass (--mass), or do not free one of them"
    if setups == {SetupKind.FFS}:
        return "add a run with the trunk fixed (hfts or vfts), or do not free one of them"
    return "add a run in another setup, or do not free one of them"


def pairs_alike(correlation: Floats, names: Sequence[str], limit: float) -> list[str]:
    """Pairs of parameters whose errors are correlated beyond a limit, with the correlation."""
    found = []
    rows, columns = np.triu_indices(len(names), 1)
    for row, column in zip(rows.tolist(), columns.tolist(), strict=True):
        value = float(correlation[row, column])
        if abs(value) >= limit:
            found.append(f"{names[row]} and {names[column]} (correlation {value:+.3f})")
    return found
