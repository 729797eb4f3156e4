"""Experiments of a campaign that move real drives, which is done one at a time and watched."""

from typing import Any

from legbench.campaign.plan import CampaignPlan
from legbench.drives.setup.bus_file import load_bus
from legbench.errors import CampaignError
from legbench.experiment.data import Experiment


def moves_drives(experiment: Experiment) -> bool:
    """Whether an experiment moves drives on a wire, as opposed to any model of them.

    Raises:
        ConfigError: its bus file is none.
    """
    if experiment.plant.kind != "can":
        return False
    choice: Any = experiment.plant
    return not choice.is_virtual(load_bus(choice.bus_file))


def refuse_drives(plan: CampaignPlan) -> None:
    """Refuse a plan that would move drives from several processes, or unwatched.

    Raises:
        CampaignError: an experiment of it moves drives.
        ConfigError: a bus file is none.
    """
    seen: set[object] = set()
    for each in plan.planned:
        plant = each.experiment.plant
        if plant.kind != "can" or plant in seen:
            continue
        seen.add(plant)
        if moves_drives(each.experiment):
            raise CampaignError(
                f"block {each.block} moves drives on a wire, which no executor does: say "
                "--plant can, which runs one experiment after another and stops at the first "
                "fault, or --interface legbench for an emulated leg"
            )
