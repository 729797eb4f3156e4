"""Ticks of a link, each with the checks that belong to it."""

from collections.abc import Callable
from typing import final

from legbench.drives.master.link_parts import LinkParts
from legbench.drives.master.tick import Tick
from legbench.errors import PlantFault


@final
class Ticks:
    """Ticks of a link, its own or those of the master that it listens to.

    Attributes:
        last: latest tick.
        skipped_total: ticks without SYNC since the start.
    """

    def __init__(self, parts: LinkParts, meanwhile: Callable[[], None]) -> None:
        """Prepare to tick; nothing is sent.

        Args:
            parts: parts of the link.
            meanwhile: work of a watched tick that needs none of its answers: it is called while
                the drives answer.
        """
        self._meanwhile = meanwhile
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
        if self._status.listening:
            tick = self._next()
        else:
            self._cycle.sync()
            try:
                self._meanwhile()
            except PlantFault as fault:  # The first cause, whatever else is raised now.
                self._status.fault = self._status.fault or fault
                raise
            finally:  # What the drives answer must be no answer to the SYNC of a stop.
                self.last = tick = self._cycle.answers()
                self.skipped_total += tick.skipped
        self._supervisor.bus(tick)
        self._supervisor.drives()
        return tick

    def _next(self) -> Tick:
        return self._keep(self._cycle.follow() if self._status.listening else self._cycle.tick())

    def _keep(self, tick: Tick) -> Tick:
        self.last = tick
        self.skipped_total += tick.skipped
        return tick
