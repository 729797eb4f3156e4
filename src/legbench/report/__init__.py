"""Reports: a campaign beside the paper, on one page and in single figures.

Names are loaded when they are asked for.
"""

from typing import TYPE_CHECKING

from legbench.lazily import lazy_names

if TYPE_CHECKING:
    from legbench.report.trends import Trend, judge_trends

__all__ = ["Trend", "judge_trends"]
__getattr__ = lazy_names(
    __name__,
    {
        "Trend": "legbench.report.trends",
        "judge_trends": "legbench.report.trends",
    },
)
