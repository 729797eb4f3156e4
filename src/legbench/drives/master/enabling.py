"""The enabling of all drives of a link, from configured to under command."""

from legbench.drives.errors import DriveError
from legbench.drives.master.limited_motion import LimitedMotion
from legbench.drives.master.link_parts import LinkParts
from legbench.drives.master.link_state import LinkState
from legbench.drives.master.ticks import Ticks
from legbench.drives.protocol.cia402 import Goal
from legbench.limits.guard import Guard


def enable(
    parts: LinkParts, ticks: Ticks, motion: LimitedMotion, guard: Guard, *, clear_faults: bool
) -> None:
    """Enable all drives where they stand; from here on this link alone may stop them.

    Args:
        parts: parts of the link, whose process data is regular.
        ticks: ticks of the link.
        motion: measurements and commands of the drives.
        guard: limits that the leg has to keep where it stands.
        clear_faults: reset a drive in fault, once.

    Raises:
        DriveError: a drive is in fault, or does not become enabled.
        PlantFault: a check of a cycle, or the leg stands beyond its limits.
    """
    up = parts.start_up
    parts.status.leads = True
    if clear_faults:
        words = "leave its fault, whose cause still stands"
        up.seek(Goal.FAULT_RESET, up.faulted(), ticks.watched, words)
    for axis in up.faulted():
        text = parts.bring_up.error_text(axis.node)
        raise DriveError(
            f"drive '{axis.node.name}' (node {axis.node.node_id}) is in fault: {text}; remove "
            f"the cause, then run `legbench drives reset --node {axis.node.name}`"
        )
    sample = motion.sample(ticks.last)
    motion.check(sample)
    guard.check_start(motion.led_pos)
    up.enable(ticks.watched)
    motion.begin()
    parts.status.state = LinkState.RUNNING
