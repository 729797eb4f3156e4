"""Making of a campaign's plan: every cell becomes an experiment, and is checked, before one runs.

Everything that can be found out without a step of a simulation is found out here.
"""

import difflib
from collections.abc import Iterator, Mapping
from dataclasses import replace
from itertools import product
from typing import Any, Final, final

from legbench.campaign.data import Campaign, CellBlock, Settings
from legbench.campaign.feasible import Infeasible, why_infeasible
from legbench.campaign.plan import CampaignPlan, Planned, cost_of
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
SEARCHED: Final = 40
"""Number of infeasible cells for which the nearest feasible value is looked for: each takes some
0.1 s, and nobody reads more."""


def plan_campaign(campaign: Campaign, *, large: bool = False) -> CampaignPlan:
    """Make the experiments of a campaign and check each of them.

    Args:
        campaign: what its file describes.
        large: whether more than `LARGE` experiments are meant.

    Raises:
        CampaignError: it is that large and that is not said, nothing is left of it, or a cell is
            infeasible and the file does not say that those are skipped.
        ConfigError: settings that no experiment has, all of them told.
    """
    planner = _Planner(campaign)
    if campaign.size > LARGE and not large:
        raise CampaignError(_size(campaign, planner.first()))
    for block in campaign.blocks:
        planner.take(block)
    planner.check()
    plan = planner.plan()
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


def cells_of(block: CellBlock) -> Iterator[Settings]:
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


@final
class _Planner:
    """Takes a campaign cell by cell and collects what becomes of it, mistakes included."""

    def __init__(self, campaign: Campaign) -> None:
        self._campaign = campaign
        self._planned: dict[str, Planned] = {}
        self._settings: dict[str, Settings] = {}
        self._excluded: list[Settings] = []
        self._matched = [False] * len(campaign.excluded)
        self._known: set[str] = set()
        self._infeasible: list[Infeasible] = []
        self._problems: list[str] = []
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

    def take(self, block: CellBlock) -> None:
        """Make the experiments of a block."""
        for settings in cells_of(block):
            try:
                tables = tables_of(self._campaign, settings)
                if self._is_excluded(tables):
                    self._excluded.append(settings)
                    continue
                experiment = self._read(tables)
            except ConfigError as error:
                self._refuse(f"{block.name}: {error}")
                continue
            self._take_cell(block, settings, experiment)

    def check(self) -> None:
        """Tell every mistake; raises ConfigError."""
        for number, entry in enumerate(self._campaign.excluded):
            unknown = [key for key in entry if key not in self._known]
            for key in unknown:
                near = difflib.get_close_matches(key, sorted(self._known), n=1, cutoff=0.5)
                hint = f"; did you mean '{near[0]}'?" if near else ""
                self._refuse(f"exclude.{number}.{key}: no cell has this key{hint}")
            if not (unknown or self._matched[number]):
                self._refuse(f"exclude.{number}: matches no cell; correct it or leave it out")
        if self._problems:
            rest = len(self._problems) - TOLD
            more = f"; and {rest} more" if rest > 0 else ""
            raise ConfigError("; ".join(self._problems[:TOLD]) + more)

    def plan(self) -> CampaignPlan:
        """Return the plan of all blocks that were taken."""
        return CampaignPlan(
            campaign=self._campaign,
            planned=tuple(self._planned.values()),
            settings=self._settings,
            axes=_axes(self._settings),
            cells=self._cells,
            excluded=tuple(self._excluded),
            infeasible=tuple(self._infeasible),
            repeated=self._repeated,
        )

    def _refuse(self, problem: str) -> None:
        """Add a mistake; most cells of a block make the same one."""
        if problem not in self._problems:
            self._problems.append(problem)

    def _experiment(self, settings: Settings) -> Experiment:
        return self._read(tables_of(self._campaign, settings))

    def _read(self, tables: Mapping[str, Any]) -> Experiment:
        return read_tables(Experiment, tables, self._campaign.folder)

    def _is_excluded(self, tables: Mapping[str, Any]) -> bool:
        if not self._campaign.excluded:
            return False
        told = flat(tables)
        self._known |= told.keys()
        for number, entry in enumerate(self._campaign.excluded):
            if all(key in told and told[key] == value for key, value in entry.items()):
                self._matched[number] = True
                return True
        return False

    def _take_cell(self, block: CellBlock, settings: Settings, experiment: Experiment) -> None:
        varied = [*block.grid, *{key for entry in block.entries for key in entry}]
        searched = varied if len(self._infeasible) < SEARCHED else ()
        reason = why_infeasible(experiment, settings, searched, self._experiment, block.name)
        if reason is not None:
            self._infeasible.append(reason)
            return
        if experiment.seed + block.trials - 1 > LARGEST_SEED:
            self._refuse(f"{block.name}: seed {experiment.seed} leaves no seeds for its trials")
            return
        told = flat(write_tables(experiment, where=False))
        for trial in range(block.trials):
            one = replace(experiment, seed=experiment.seed + trial)
            name = experiment_hash(one)
            if name in self._planned:
                self._repeated += 1
                continue
            self._planned[name] = Planned(
                experiment=one, hash=name, block=block.name, cell=self._cells, trial=trial
            )
            self._settings[name] = {**told, "seed": one.seed}
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
