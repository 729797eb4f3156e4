"""The plan of a campaign as data: its experiments by hash, and the cells that are left out."""

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

from legbench.campaign.data import Campaign, Settings
from legbench.campaign.feasible import Infeasible
from legbench.experiment.data import Experiment

COST: Final = {"bars": 0.1, "reduced": 0.05, "analytic": 0.6, "can": 1.2}
"""Time that one processor takes for one second of one leg, about [s/s]: by linkage of a simulated
leg, by plant of any other."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Planned:
    """Experiment of a campaign, with the place of its cell."""

    experiment: Experiment
    hash: str
    block: str
    cell: int
    """Number of the cell, from 0, in the order of the file."""
    trial: int


@dataclass(frozen=True, slots=True, kw_only=True)
class CampaignPlan:
    """Plan of a campaign: everything that it will run, and what it will not."""

    campaign: Campaign
    planned: tuple[Planned, ...]
    """Experiments in the order of the file; one that occurs twice is there once."""
    settings: Mapping[str, Settings]
    """Hash of an experiment -> its settings by dotted key."""
    axes: tuple[str, ...]
    """Dotted keys that differ from experiment to experiment."""
    cells: int
    """Number of cells that are run."""
    excluded: tuple[Settings, ...]
    """Settings of the cells that the file leaves out."""
    infeasible: tuple[Infeasible, ...]
    """Cells that are left out because the leg cannot do them."""
    repeated: int
    """Number of experiments that occur once more in another cell."""

    @property
    def digest(self) -> str:
        """SHA-256 over the hashes of all experiments, which tells one campaign from another."""
        hashes = sorted(each.hash for each in self.planned)
        return hashlib.sha256("\n".join(hashes).encode()).hexdigest()

    @property
    def cost(self) -> float:
        """Time that one processor takes for all of it, about [s]."""
        return sum(cost_of(each.experiment) for each in self.planned)


def cost_of(experiment: Experiment) -> float:
    """Time that one processor takes for an experiment, about [s]."""
    kind = experiment.plant.kind
    which = str(experiment.linkage.kind) if kind == "sim" else kind
    return COST.get(which, 1.0) * experiment.duration
