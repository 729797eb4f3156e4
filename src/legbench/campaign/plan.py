"""The plan of a campaign: its experiments by hash, and the cells that are left out, with reasons.

Everything that can be found out without a step of a simulation is found out here.
"""

import difflib
import hashlib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from itertools import product
from typing import Any, Final

from legbench.campaign.data import Block, Campaign, Settings
from legbench.campaign.feasible import Infeasible, why_infeasible
from legbench.errors import CampaignError, ConfigError
from legbench.experiment.canonical import experiment_hash
from legbench.experiment.data import LARGEST_SEED, Experiment
from legbench.experiment.overrides import overlaid
from legbench.experiment.tables import read_tables, write_tables
from legbench.experiment.writing import flat

LARGE: Final = 10_000
"""Experiments beyond which it is asked whether that was meant [-]; the paper has 280."""
TOLD: Final = 4
"""Number of mistakes, or of cells that the leg cannot do, that a message tells one by one."""
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
class Plan:
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


def plan_campaign(campaign: Campaign, *, large: bool = False) -> Plan:
    """Make the experiments of a campaign and check each of them.

    Args:
        campaign: what its file describes.
        large: whether more than `LARGE` experiments are meant.

    Raises:
        CampaignError: it is that large and that is not said, nothing is left of it, or a cell is
            infeasible and the file does not say that those are skipped.
        ConfigError: settings that no experiment has, all of them told.
    """
    found = _Found(campaign)
    if campaign.size > LARGE and not large:
        raise CampaignError(_size(campaign, found.first()))
    for block in campaign.blocks:
        found.take(block)
    found.check()
    plan = found.plan()
    if plan.infeasible and campaign.infeasible == "refuse":
        told = "; ".join(str(each) for each in plan.infeasible[:TOLD])
        rest = len(plan.infeasible) - TOLD
        raise CampaignError(
            f"{len(plan.infeasible)} cells cannot be done: {told}"
            f"{f'; and {rest} more' if rest > 0 else ''}; change them, exclude them, or say "
            'infeasible = "skip" in the file'
        )
    if not plan.planned:
        raise CampaignError("nothing is left to run: every cell is excluded or infeasible")
    return plan


def _size(campaign: Campaign, first: Experiment | None) -> str:
    """Question whether a campaign of this size was meant."""
    count = campaign.size
    about = ""
    if first is not None:
        hours = count * cost_of(first) / 3600.0
        about = f", some {hours:.3g} h on one processor"
    return (
        f"the campaign has {count} experiments{about}; up to {LARGE} are run without asking: take "
        "fewer values or trials, or say --large"
    )


def cells_of(block: Block) -> Iterator[Settings]:
    """Settings of each cell of a block, exclusions not yet taken out."""
    for entry in block.entries:
        for point in product(*block.grid.values()):
            yield {**block.settings, **entry, **dict(zip(block.grid, point, strict=True))}


def tables_of(campaign: Campaign, settings: Settings) -> dict[str, Any]:
    """Tables of the experiment that a cell is; raises ConfigError where a key leads nowhere."""
    tables = dict(campaign.base)
    # A kind replaces its whole table, so that it comes before the settings of that kind.
    for key in sorted(settings, key=lambda name: "." in name and not name.endswith(".kind")):
        tables = overlaid(tables, key, settings[key], campaign.folder)
    return tables


class _Found:
    """What has been found of a campaign, cell by cell."""

    def __init__(self, campaign: Campaign) -> None:
        self._campaign = campaign
        self._planned: dict[str, Planned] = {}
        self._settings: dict[str, Settings] = {}
        self._excluded: list[Settings] = []
        self._matched = [False] * len(campaign.excluded)
        self._known: set[str] = set()
        self._infeasible: list[Infeasible] = []
        self._problems: dict[str, None] = {}
        self._cells = self._repeated = 0

    def first(self) -> Experiment | None:
        """Experiment of the first cell; none where it is not one."""
        for block in self._campaign.blocks:
            for settings in cells_of(block):
                try:
                    return self._experiment(settings)
                except ConfigError:
                    return None
        return None

    def take(self, block: Block) -> None:
        """Make the experiments of a block."""
        for settings in cells_of(block):
            try:
                tables = tables_of(self._campaign, settings)
                if self._is_excluded(flat(tables)):
                    self._excluded.append(settings)
                    continue
                experiment = self._experiment(settings)
            except ConfigError as error:
                self._problems[f"{block.name}: {error}"] = None
                continue
            self._take_cell(block, settings, experiment)

    def check(self) -> None:
        """Tell every mistake; raises ConfigError."""
        for number, entry in enumerate(self._campaign.excluded):
            for key in entry:
                if key not in self._known:
                    near = difflib.get_close_matches(key, sorted(self._known), n=1, cutoff=0.5)
                    hint = f"; did you mean '{near[0]}'?" if near else ""
                    self._problems[f"exclude.{number}.{key}: no cell has this key{hint}"] = None
            if not self._matched[number] and all(key in self._known for key in entry):
                self._problems[f"exclude.{number}: matches no cell; correct it or leave it out"] = (
                    None
                )
        if self._problems:
            told, rest = list(self._problems)[:TOLD], len(self._problems) - TOLD
            raise ConfigError("; ".join(told) + (f"; and {rest} more" if rest > 0 else ""))

    def plan(self) -> Plan:
        """Return the plan of all blocks that were taken."""
        return Plan(
            campaign=self._campaign,
            planned=tuple(self._planned.values()),
            settings=self._settings,
            axes=_axes(self._settings),
            cells=self._cells,
            excluded=tuple(self._excluded),
            infeasible=tuple(self._infeasible),
            repeated=self._repeated,
        )

    def _experiment(self, settings: Settings) -> Experiment:
        tables = tables_of(self._campaign, settings)
        return read_tables(Experiment, tables, self._campaign.folder)

    def _is_excluded(self, told: Settings) -> bool:
        self._known |= told.keys()
        for number, entry in enumerate(self._campaign.excluded):
            if all(key in told and told[key] == value for key, value in entry.items()):
                self._matched[number] = True
                return True
        return False

    def _take_cell(self, block: Block, settings: Settings, experiment: Experiment) -> None:
        told = len(self._infeasible) < 10 * TOLD
        varied = [*block.grid, *{key for entry in block.entries for key in entry}]
        reason = why_infeasible(
            experiment, settings, varied if told else (), self._experiment, block.name
        )
        if reason is not None:
            self._infeasible.append(reason)
            return
        for trial in range(block.trials):
            seed = experiment.seed + trial
            if seed > LARGEST_SEED:
                self._problems[f"{block.name}: seed {seed} of trial {trial} is too large"] = None
                return
            one = replace(experiment, seed=seed)
            name = experiment_hash(one)
            if name in self._planned:
                self._repeated += 1
                continue
            self._planned[name] = Planned(
                experiment=one, hash=name, block=block.name, cell=self._cells, trial=trial
            )
            self._settings[name] = flat(write_tables(one, where=False))
        self._cells += 1


def _axes(settings: Mapping[str, Settings]) -> tuple[str, ...]:
    """Dotted keys whose values are not the same everywhere, in alphabetical order.

    A setting of one kind of controller or plant is held against those of its kind alone.
    """
    keys = sorted({key for each in settings.values() for key in each})
    found = []
    for key in keys:
        own = ".settings." in key
        values = [each.get(key) for each in settings.values() if not own or key in each]
        if any(value != values[0] or type(value) is not type(values[0]) for value in values):
            found.append(key)
    return tuple(found)
