"""Plants by name: built in, installed beside legbench, or in a file."""

from typing import TYPE_CHECKING, Final

from legbench.guests import Registry
from legbench.lazily import lazy_names
from legbench.plant.design_limits import joint_ranges
from legbench.plant.opening import Leg, OpenPlant, PlantSettings, open_plant
from legbench.plant.sim_choice import SimChoice

if TYPE_CHECKING:
    from legbench.plant.analytic_choice import AnalyticChoice
    from legbench.plant.can_choice import BUS_LOG, EMULATED, LIMITS_NAME, CanChoice
    from legbench.plant.limits_file import limits_for

PLANTS: Final = Registry(
    what="plant",
    builtin={
        "sim": "legbench.plant.sim_choice:SimChoice",
        "analytic": "legbench.plant.analytic_choice:AnalyticChoice",
        "can": "legbench.plant.can_choice:CanChoice",
    },
    group="legbench.plants",
    members={"open": "open(leg) -> AbstractPlant"},
)
"""Registry of every plant."""

__all__ = [
    "BUS_LOG",
    "EMULATED",
    "LIMITS_NAME",
    "PLANTS",
    "AnalyticChoice",
    "CanChoice",
    "Leg",
    "OpenPlant",
    "PlantSettings",
    "SimChoice",
    "joint_ranges",
    "limits_for",
    "open_plant",
]
_CAN = "legbench.plant.can_choice"
__getattr__ = lazy_names(
    __name__,
    {
        "BUS_LOG": _CAN,
        "EMULATED": _CAN,
        "LIMITS_NAME": _CAN,
        "AnalyticChoice": "legbench.plant.analytic_choice",
        "CanChoice": _CAN,
        "limits_for": "legbench.plant.limits_file",
    },
)
