"""Print figures of one run by name."""

from legbench.metrics.analysis import analysed
from legbench.metrics.source import Recorded
from legbench.viz.print._matplotlib import Figure
from legbench.viz.print.figures import phase_figure
from legbench.viz.print.stills import stills_figure


def figures(run: Recorded) -> dict[str, Figure]:
    """Every figure that a run gives, as objects that a notebook shows and that can be saved.

    Returns:
        `phase`, its three planes as in Figs. 4 and 6, and, of a run with a complete jump whose hip
        is known, `stills` as in Fig. 7.

    Raises:
        FormatError: the run describes no leg.
        RecordingError: the run has no rows, or knows no link angles.
        MissingExtraError: matplotlib is not installed.
    """
    measured = analysed(run)
    stills = stills_figure(measured)
    found = {"phase": phase_figure(measured)}
    return found if stills is None else found | {"stills": stills}
