"""Reports: a campaign beside the paper on one page, and the figures of single runs.

Names are loaded when they are asked for.
"""

from typing import TYPE_CHECKING

from legbench.lazily import lazy_names

if TYPE_CHECKING:
    from legbench.report.run_figures import figures
    from legbench.report.run_kpis import Kpi, kpis
    from legbench.report.sources import CampaignSource, read_source
    from legbench.report.trends import Trend, judge_trends
    from legbench.report.writing import WrittenReport, write_report

__all__ = [
    "CampaignSource",
    "Kpi",
    "Trend",
    "WrittenReport",
    "figures",
    "judge_trends",
    "kpis",
    "read_source",
    "write_report",
]
__getattr__ = lazy_names(
    __name__,
    {
        "CampaignSource": "legbench.report.sources",
        "Kpi": "legbench.report.run_kpis",
        "Trend": "legbench.report.trends",
        "WrittenReport": "legbench.report.writing",
        "figures": "legbench.report.run_figures",
        "judge_trends": "legbench.report.trends",
        "kpis": "legbench.report.run_kpis",
        "read_source": "legbench.report.sources",
        "write_report": "legbench.report.writing",
    },
)
