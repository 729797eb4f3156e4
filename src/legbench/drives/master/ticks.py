"""Ticks of a link, each with the checks that belong to it."""

from typing import final

from legbench.drives.master.link_parts import LinkParts
from legbench.drives.master.tick import Tick


@final
class Ticks:
    """Ticks of a link, its own or those of the master that it listens to.

    Attributes:
        last: latest tick.
        skipped_total: ticks without SYNC since the start.
    """

    def __init__(self, parts: LinkParts) -> None:
        """Prepare to tick with these parts; nothing is sent."""
        self._cycle, self._supervisor, self._status = parts.cycle, parts.supervisor, parts.status
        self.last = Tick(0, 0, 0, 0, False)
        self.skipped_total = 0

    def settling(self) -> Tick:
        """Wait for the next tick; raises PlantFault if another master leads the drives."""
        tick = self._next()
        self._supervisor.check_no_other_master()
        return tick

    def watched(self) -> Tick:
        """Wait for the next tick; raises PlantFault if bus, grid or a drive is not in order."""
        tick = self._next()
        self._supervisor.bus(tick)
        self._supervisor.drives()
        return tick

    def _next(self) -> Tick:
        self.last = tick = self._cycle.follow() if self._status.listening else self._cycle.tick()
        self.skipped_total += tick.skipped
        return tick
