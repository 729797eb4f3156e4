"""Campaigns: many experiments from one file, run anywhere, and the one table that they leave.

Names are loaded when they are asked for.
"""

from typing import TYPE_CHECKING

from legbench.lazily import lazy_names

if TYPE_CHECKING:
    from legbench.campaign.plan import CampaignPlan
    from legbench.campaign.planning import plan_campaign
    from legbench.campaign.reading import load_campaign
    from legbench.campaign.rows import measured_rows
    from legbench.campaign.running import run_campaign
    from legbench.campaign.shards import shards_of
    from legbench.campaign.table import measured_table, read_table, whole_table

__all__ = [
    "CampaignPlan",
    "load_campaign",
    "measured_rows",
    "measured_table",
    "plan_campaign",
    "read_table",
    "run_campaign",
    "shards_of",
    "whole_table",
]
__getattr__ = lazy_names(
    __name__,
    {
        "CampaignPlan": "legbench.campaign.plan",
        "load_campaign": "legbench.campaign.reading",
        "measured_rows": "legbench.campaign.rows",
        "measured_table": "legbench.campaign.table",
        "plan_campaign": "legbench.campaign.planning",
        "read_table": "legbench.campaign.table",
        "run_campaign": "legbench.campaign.running",
        "shards_of": "legbench.campaign.shards",
        "whole_table": "legbench.campaign.table",
    },
)
