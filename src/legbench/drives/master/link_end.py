"""The end of a link: the stop of its drives, their parking, and the release of the channel."""

from types import TracebackType
from typing import final

from legbench.drives.master.link_parts import LinkParts
from legbench.drives.master.link_state import LinkState
from legbench.drives.master.parking import park
from legbench.drives.master.sdo_stop import leave_operational
from legbench.drives.master.stop import StopSequence
from legbench.errors import PlantFault
from legbench.interrupts import Shield, shielded


@final
class LinkEnd:
    """End of a link, however it comes about; nothing of it raises an error of its own."""

    def __init__(self, parts: LinkParts) -> None:
        """Prepare to end a link with these parts; nothing is sent."""
        self._parts, self._status = parts, parts.status
        self._closed = False

    def end(self, error: PlantFault) -> None:
        """Keep the first cause, stop all drives at once."""
        if self._status.fault is None:
            self._status.fault = error
        self.stop()

    def stop_after(self, error: BaseException) -> None:
        """Stop all drives at once after an error; a `PlantFault` becomes the fault of the link."""
        if isinstance(error, PlantFault):
            self.end(error)
        else:
            self.stop()

    def stop(self) -> None:
        """Stop all drives in this cycle, as `Link.stop` describes it."""
        with shielded() as shield:
            self._stop(shield)

    def _stop(self, shield: Shield) -> None:
        """Stop all drives; an interruption is raised when the shield of the caller ends."""
        parts, status = self._parts, self._status
        if status.state not in (LinkState.CYCLIC, LinkState.RUNNING, LinkState.STOPPING):
            return
        status.state = LinkState.STOPPING
        if parts.read_only or (not status.leads and self._led_by_another(shield)):
            status.state = LinkState.STOPPED
        else:
            status.note(StopSequence(parts.cycle, shield.hold, parts.config.cycles_in).run())

    def close(self) -> None:
        """Stop, park the drives, release the channel, as `Link.close` describes it."""
        parts, status = self._parts, self._status
        if status.state is LinkState.NEW or self._closed:
            return
        with shielded() as shield:
            looked = status.listening or status.state is LinkState.CONFIGURED
            self._stop(shield)
            led = self._led_by_another(shield)
            if not ((led and not status.leads) or (parts.read_only and looked)):
                order, nodes = parts.bring_up.pre_operational, parts.config.nodes
                report = leave_operational(order, parts.port, nodes, status.stopped, shield.hold)
                if report is not None:
                    status.note(report)
            if not (parts.read_only or led):
                self._park(shield)
            parts.channel.release()
            self._closed = True
            if status.state is not LinkState.STOPPING:
                status.state = LinkState.STOPPED

    def _park(self, shield: Shield) -> None:
        """Switch the drives' command frames off, so that no recorded log moves them."""
        parts, status = self._parts, self._status
        try:
            powered = () if status.stopped is None else status.stopped.powered
            status.not_parked = park(parts.port, parts.config, parts.cycle.other, powered)
        except BaseException as error:  # Whatever a driver raises, the channel is still released.
            status.not_parked = [f"the drives are not parked: {error!r}"]
            shield.hold(error)

    def _led_by_another(self, shield: Shield) -> bool:
        """Whether another master has been heard; where that cannot be told, by what is known."""
        cycle = self._parts.cycle
        try:
            return cycle.led_by_another()
        except BaseException as error:  # Whatever a driver raises, the stop goes on.
            shield.hold(error)
            return self._parts.read_only or cycle.stranger is not None


@final
class StopOnError:
    """A `with` block that stops the drives of a link if anything is raised in it.

    A `PlantFault` becomes the fault of the link.
    """

    __slots__ = ("_ending",)

    def __init__(self, ending: LinkEnd) -> None:
        """Prepare to stop by this end of a link."""
        self._ending = ending

    def __enter__(self) -> None:
        return None

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        if error is not None:
            self._ending.stop_after(error)
