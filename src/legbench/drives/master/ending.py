"""The end of a link: the stop of its drives, their parking, and the release of the channel."""

from legbench.drives.master.bring_up import BringUp
from legbench.drives.master.cycle import Cycle
from legbench.drives.master.link_state import LinkState
from legbench.drives.master.parking import park
from legbench.drives.master.port import Port
from legbench.drives.master.sdo_stop import leave_operational
from legbench.drives.master.stop import StopLadder
from legbench.drives.master.stop_report import Lead, StopReport
from legbench.drives.setup.config import BusConfig
from legbench.drives.transport.lock import ChannelLock
from legbench.errors import PlantFault
from legbench.interrupts import Shield, shielded


class Ending(Lead):
    """Base class of a link: the parts that its end needs, and that end.

    Attributes:
        state: state of the link.
        fault: first fault, which ended the link.
        stopped: report of the stop of the drives, none before it.
        not_parked: command frames that `close` failed to switch off, see `master.parking`.
        listening: read-only, and another master sends SYNC: this one sends nothing.
    """

    def __init__(
        self, port: Port, config: BusConfig, lock: ChannelLock, *, read_only: bool
    ) -> None:
        """Wire the parts; nothing is sent.

        Args:
            port: port of the bus.
            config: drives on the bus.
            lock: lock of the channel, which is not taken yet.
            read_only: observe; change nothing in a drive, see `master.read_only`.
        """
        self._port, self._config = port, config
        self._lock, self._read_only = lock, read_only
        self.cycle = Cycle(self._port, config)
        self.bring_up = BringUp(self._port, config, self.cycle.other)
        self.state = LinkState.NEW
        self.fault: PlantFault | None = None
        self.stopped: StopReport | None = None
        self.not_parked: list[str] = []
        self.listening = False
        self._holds = self._closed = self._leads = False

    def _end(self, error: PlantFault) -> None:
        """Keep the first cause, stop all drives at once."""
        if self.fault is None:
            self.fault = error
        self.stop()

    def stop(self) -> None:
        """Quick stop of all drives in this cycle, then no power, then a look whether it is gone.

        Raises no error; `stopped` tells how it has ended. No signal gets in between: a ^C that
        comes meanwhile is raised at the end. While the stop is not verified, calling it again
        repeats it. Drives that another master took before this one led them are left to it.
        """
        if self.state not in (LinkState.CYCLIC, LinkState.RUNNING, LinkState.STOPPING):
            return
        with shielded() as shield:
            self.state = LinkState.STOPPING
            if self._read_only or (not self._leads and self._led_by_another(shield)):
                self.state = LinkState.STOPPED
            else:
                self._note(StopLadder(self.cycle, shield.hold, self._config.cycles_in).run())

    def close(self) -> None:
        """Stop, leave the drives parked in pre-operational, release the channel; raises no error.

        A second call does nothing. A stop that is not verified is repeated, in the end over SDO. A
        link that only looks leaves the drives of another master alone.
        """
        if self.state is LinkState.NEW or self._closed:
            return
        with shielded() as shield:
            looked = self.listening or self.state is LinkState.CONFIGURED
            self.stop()
            led = self._led_by_another(shield)
            if not ((led and not self._leads) or (self._read_only and looked)):
                order, nodes = self.bring_up.pre_operational, self._config.nodes
                report = leave_operational(order, self._port, nodes, self.stopped, shield.hold)
                if report is not None:
                    self._note(report)
            if not (self._read_only or led):
                self._park(shield)
            self._let_go()
            self._closed = True
            if self.state is not LinkState.STOPPING:
                self.state = LinkState.STOPPED

    def _note(self, report: StopReport) -> None:
        """Remember how a stop has ended; one that repeats another keeps what that had to tell."""
        self.stopped = report.after(self.stopped)
        if report.verified:
            self.state = LinkState.STOPPED

    def _park(self, shield: Shield) -> None:
        """Switch the drives' command frames off, so that no recorded log moves them."""
        try:
            powered = () if self.stopped is None else self.stopped.powered
            self.not_parked = park(self._port, self._config, self.cycle.other, powered)
        except BaseException as error:  # Whatever a driver raises, the channel is still released.
            self.not_parked = [f"the drives are not parked: {error!r}"]
            shield.hold(error)

    def _led_by_another(self, shield: Shield) -> bool:
        """Whether another master has been heard; where that cannot be told, by what is known."""
        try:
            return self.cycle.led_by_another()
        except BaseException as error:  # Whatever a driver raises, the stop goes on.
            shield.hold(error)
            return self._read_only or self.cycle.stranger is not None

    def _hold(self) -> None:
        self._lock.acquire()
        self._holds = True

    def _let_go(self) -> None:
        if self._holds:
            self._holds = False
            self._lock.release()
