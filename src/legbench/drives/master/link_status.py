"""What has become of a link so far; its opening, its cycle and its end share one object."""

from dataclasses import dataclass, field
from typing import final

from legbench.drives.master.link_state import LinkState
from legbench.drives.master.stop_report import StopReport
from legbench.errors import PlantFault


@final
@dataclass(slots=True, kw_only=True)
class LinkStatus:
    """Status of a link, written by its parts and read through the link."""

    state: LinkState = LinkState.NEW
    """State of the link."""
    fault: PlantFault | None = None
    """First fault, which ended the link."""
    stopped: StopReport | None = None
    """Report of the stop of the drives, none before it."""
    not_parked: list[str] = field(default_factory=list[str])
    """Command frames that the end of the link failed to switch off, see `master.parking`."""
    listening: bool = False
    """Whether another master sends SYNC to a read-only link, which sends nothing then."""
    leads: bool = False
    """Whether this link has begun to give the drives power, so that no one else may stop them."""

    unprotected: tuple[str, ...] = ()
    """What the drives lack or hold otherwise, a line each, once the link is open."""

    def note(self, report: StopReport) -> None:
        """Keep the report of a stop, joined with what an earlier stop had to tell."""
        self.stopped = report.after(self.stopped)
        if report.verified:
            self.state = LinkState.STOPPED
