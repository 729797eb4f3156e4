"""Whether a run that has lasted its time has been a run to its end, and its drives are at rest."""

from dataclasses import replace

from legbench.drives.link import Link
from legbench.drives.master.stop_report import CAUSE, StopReport
from legbench.drives.upper_ends import LIMIT_ENDS
from legbench.loop import Outcome


def answered(outcome: Outcome, link: Link | None) -> Outcome:
    """Return how a run ended, as a fault if a drive had not answered for long by then.

    A waived `lost_frames` may bridge seconds; a run that is shorter would end complete though its
    drives have been gone since its beginning.

    Args:
        outcome: what the loop says.
        link: of the run, before its drives are stopped; none for a plant without a bus.
    """
    if link is None or outcome.status == "fault":
        return outcome
    longest, _, _ = LIMIT_ENDS["lost_frames"]
    for axis, watch in zip(link.cycle.axes, link.cycle.watches, strict=True):
        if watch.missed > longest:
            text = (
                f"drive '{axis.node.name}' (node {axis.node.node_id}) had not answered for the "
                f"last {watch.missed} cycles when the run ended, the limit is {longest:g}; look at "
                "its supply and the wiring, and at lost_frames in the limits file"
            )
            return replace(outcome, status="fault", cause="process data lost", message=text)
    return outcome


def stopped_well(outcome: Outcome, stopped: StopReport | None) -> Outcome:
    """Return how a run ended, as a fault if its drives could not be shown to be without power.

    The first cause stays the cause; what the stop has to tell is added to the message.
    """
    trouble = None if stopped is None else stopped.trouble
    if trouble is None:
        return outcome
    message = trouble if outcome.message is None else f"{outcome.message}; {trouble}"
    return replace(outcome, status="fault", cause=outcome.cause or CAUSE, message=message)
