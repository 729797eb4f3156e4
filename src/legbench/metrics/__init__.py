"""What is measured from recordings alone, whatever plant made them."""

from legbench.metrics.analysis import Analysis, analysed
from legbench.metrics.budget import EnergyBudget, energy_budget
from legbench.metrics.compare import Comparison, Differences, compare, differences
from legbench.metrics.energy import Flows, energy_flows, energy_residual, loop_gap_max
from legbench.metrics.jump import JumpFigures, jump_figures
from legbench.metrics.modal import Trajectory, trajectory
from legbench.metrics.periods import Periods, find_periods
from legbench.metrics.phases import Gait, Intervals, Jumps, find_gait
from legbench.metrics.rating import alignment, deflection, rate, rate_phases
from legbench.metrics.run_ratings import RatingLists, RunRatings
from legbench.metrics.source import Recorded, Reference
from legbench.metrics.summary import Summary, summarise

__all__ = [
    "Analysis",
    "Comparison",
    "Differences",
    "EnergyBudget",
    "Flows",
    "Gait",
    "Intervals",
    "JumpFigures",
    "Jumps",
    "Periods",
    "RatingLists",
    "Recorded",
    "Reference",
    "RunRatings",
    "Summary",
    "Trajectory",
    "alignment",
    "analysed",
    "compare",
    "deflection",
    "differences",
    "energy_budget",
    "energy_flows",
    "energy_residual",
    "find_gait",
    "find_periods",
    "jump_figures",
    "loop_gap_max",
    "rate",
    "rate_phases",
    "summarise",
    "trajectory",
]
