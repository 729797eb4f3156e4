"""Parameters of a leg from its recordings, with honest intervals and a verdict.

Names are loaded when they are asked for, since a fit needs the compiled leg.
"""

from typing import TYPE_CHECKING

from legbench.lazily import lazy_names

if TYPE_CHECKING:
    from legbench.identify.asking import read_runs, task_of
    from legbench.identify.back_to_design import design_text, written_back
    from legbench.identify.gate import UnidentifiableError
    from legbench.identify.outcome import Estimate, Identification
    from legbench.identify.parameters import Freedom, parse_free
    from legbench.identify.repeated import Repeated, repeat
    from legbench.identify.staged import IdentificationTask, identify

__all__ = [
    "Estimate",
    "Freedom",
    "Identification",
    "IdentificationTask",
    "Repeated",
    "UnidentifiableError",
    "design_text",
    "identify",
    "parse_free",
    "read_runs",
    "repeat",
    "task_of",
    "written_back",
]
__getattr__ = lazy_names(
    __name__,
    {
        "Estimate": "legbench.identify.outcome",
        "Freedom": "legbench.identify.parameters",
        "Identification": "legbench.identify.outcome",
        "IdentificationTask": "legbench.identify.staged",
        "Repeated": "legbench.identify.repeated",
        "UnidentifiableError": "legbench.identify.gate",
        "design_text": "legbench.identify.back_to_design",
        "identify": "legbench.identify.staged",
        "parse_free": "legbench.identify.parameters",
        "read_runs": "legbench.identify.asking",
        "repeat": "legbench.identify.repeated",
        "task_of": "legbench.identify.asking",
        "written_back": "legbench.identify.back_to_design",
    },
)
