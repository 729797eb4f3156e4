"""Drives that have not answered for longer than any run may bridge."""

from legbench.drives.master.link import Link
from legbench.limits.upper_ends import LIMIT_ENDS


def gone_drive(link: Link) -> str | None:
    """Reason why a run that has lasted its time is a fault; none if every drive was there.

    A waived `lost_frames` may bridge seconds; a run that is shorter would end complete though its
    drives have been gone since its beginning.
    """
    longest, _, _ = LIMIT_ENDS["lost_frames"]
    for axis, watch in zip(link.cycle.axes, link.cycle.watches, strict=True):
        if watch.missed > longest:
            return (
                f"drive '{axis.node.name}' (node {axis.node.node_id}) had not answered for the "
                f"last {watch.missed} cycles when the run ended, the limit is {longest:g}; look at "
                "its supply and the wiring, and at lost_frames in the limits file"
            )
    return None
