"""Experiments of a campaign made anew from its folder alone.

The folder tells one whole experiment of each kind of controller and plant; every other one follows
from it with the settings in the table, and its hash says whether it is the right one.
"""

import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

from legbench.campaign.plan import CampaignPlan
from legbench.campaign.table import MEASURED
from legbench.errors import CampaignError, ConfigError
from legbench.experiment.canonical import experiment_hash
from legbench.experiment.data import Experiment
from legbench.experiment.overrides import overlaid
from legbench.experiment.tables import read_tables, write_tables
from legbench.reading import LARGEST_JSON, UnreadableError, parse_json, read_file

CAMPAIGN: Final = "campaign.json"
EXAMPLES: Final = "examples"
"""Entry of `campaign.json` that has the whole experiments."""


def examples_of(plan: CampaignPlan) -> list[dict[str, Any]]:
    """Tables of the first experiment of each kind of controller and plant."""
    found: dict[tuple[str, str], Experiment] = {}
    for each in plan.planned:
        kinds = each.experiment.controller.kind, each.experiment.plant.kind
        found.setdefault(kinds, each.experiment)
    return [write_tables(experiment, where=False) for experiment in found.values()]


def experiment_of(folder: Path, row: Mapping[str, Any]) -> Experiment:
    """Make the experiment of a row of the table in `folder`.

    Raises:
        CampaignError: the folder tells too little, as that of a guest's controller, or what it
            tells gives another experiment.
    """
    name = row["experiment"]
    settings = {key: value for key, value in row.items() if key not in {*MEASURED.names, "trial"}}
    try:
        tables = _example(folder, settings)
        # A kind replaces its whole table, so that it comes before the settings of that kind.
        for key in sorted(settings, key=lambda key: not key.endswith(".kind")):
            tables = overlaid(tables, key, _value(settings[key]), folder)
        experiment = read_tables(Experiment, tables, folder, json=True)
        found = experiment_hash(experiment)
    except (FileNotFoundError, UnreadableError, ConfigError) as error:
        raise CampaignError(f"experiment {name[:12]} of {folder}: {error}") from error
    if found != name:
        raise CampaignError(
            f"experiment {name[:12]} of {folder} cannot be made anew: what the folder tells is "
            f"experiment {found[:12]}; keep its recordings with --records parquet"
        )
    return experiment


def _example(folder: Path, settings: Mapping[str, Any]) -> dict[str, Any]:
    """Whole experiment of the same kinds.

    Raises:
        ConfigError: there is none.
    """
    told = parse_json(read_file(folder / CAMPAIGN, LARGEST_JSON))
    examples = told.get(EXAMPLES, []) if isinstance(told, dict) else []
    for tables in examples if isinstance(examples, list) else []:
        kinds = (("controller", "controller.kind"), ("plant", "plant.kind"))
        if isinstance(tables, dict) and all(
            settings.get(key, tables.get(name, {}).get("kind")) == tables.get(name, {}).get("kind")
            for name, key in kinds
        ):
            return tables
    raise ConfigError(
        f"{CAMPAIGN} has no whole experiment with this controller; keep recordings with --records "
        "parquet, or run the campaign again"
    )


def _value(value: Any) -> Any:
    """Setting of a cell; the table has a list as its TOML text."""
    if isinstance(value, str) and value.startswith("["):
        return tomllib.loads(f"value = {value}")["value"]
    return value
