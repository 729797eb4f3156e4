"""Campaigns: many experiments from one file, run anywhere, and the one table that they leave.

Names are loaded when they are asked for.
"""

from typing import TYPE_CHECKING

from legbench.lazily import lazy_names

if TYPE_CHECKING:
    from legbench.campaign.rows import measured_rows
    from legbench.campaign.table import measured_table, read_table, whole_table

__all__ = ["measured_rows", "measured_table", "read_table", "whole_table"]
__getattr__ = lazy_names(
    __name__,
    {
        "measured_rows": "legbench.campaign.rows",
        "measured_table": "legbench.campaign.table",
        "read_table": "legbench.campaign.table",
        "whole_table": "legbench.campaign.table",
    },
)
