"""A bus that is opened once and closed once, with a log that may begin later."""

from collections.abc import Sequence
from types import TracebackType
from typing import final

import can

from legbench.closing import Closing
from legbench.drives.master.bring_up import BringUp
from legbench.drives.master.bus_log import BusLog
from legbench.drives.master.link import Link
from legbench.drives.master.port import Port
from legbench.drives.master.stop_report import DriveLeader, StopReport, add_trouble
from legbench.drives.setup.config import BusConfig
from legbench.drives.transport.lock import ChannelLock
from legbench.drives.transport.open_bus import timebase_of
from legbench.drives.transport.realtime import Granted, ask
from legbench.drives.transport.timebase import SystemTime, Timebase
from legbench.drives.transport.virtual_bus import VirtualBus
from legbench.interrupts import shielded
from legbench.limits.momentum import LegMomentum
from legbench.limits.safety import SafetyLimits
from legbench.recording.abstract_disk import AbstractLog


@final
class Session(Closing):
    """Owns a bus; links, ports and logs on it end with it.

    Attributes:
        bus: the interface.
        config: drives on the bus.
        log: raw frames since `log_to`.
    """

    def __init__(
        self,
        bus: can.BusABC,
        config: BusConfig,
        timebase: Timebase | None = None,
        *,
        lock: ChannelLock | None = None,
    ) -> None:
        """Own a bus.

        Args:
            bus: interface to shut down at the end.
            config: drives on the bus.
            timebase: time base of the session; by default the bus's.
            lock: lock of the bus's channel, which this session releases if it is held already.
        """
        self.bus, self.config = bus, config
        self.timebase = timebase or timebase_of(bus)
        self.log: BusLog | None = None
        self._links: list[Link] = []
        self._leaders: list[DriveLeader] = []
        self._lock = lock or self._lock_of_bus()
        self._closed = False

    @property
    def virtual(self) -> bool:
        """Whether time passes only while somebody waits for it."""
        return isinstance(self.bus, VirtualBus)

    @property
    def channel(self) -> str:
        """Name of the bus in logs."""
        return str(getattr(self.bus, "channel", "can"))

    def request_realtime(self, cpu: int | None = None) -> Granted | None:
        """Ask the system for real-time scheduling; returns none in virtual time.

        Links that are made afterwards spend the last part of every wait awake, if it was granted.
        """
        if self.virtual:
            return None
        granted = ask(cpu)
        self.timebase = SystemTime(1000 * granted.spin_us)
        return granted

    def log_to(self, log: AbstractLog) -> None:
        """Write every frame of all links from now on, or from when their drives are configured.

        Args:
            log: of the run, closed with this session.
        """
        self.log = BusLog(log, self.channel)
        for link in self._links:
            link.show_frames_to(self.log)

    def _lock_of_bus(self) -> ChannelLock:
        """Lock of the bus's channel; a private one for an emulated bus of this process."""
        name = str(self.bus.channel_info)
        return ChannelLock.private(name) if self.virtual else ChannelLock(name)

    def hold(self) -> None:
        """Take the channel for this session; raises BusError if it has a master."""
        if not self._lock.held:
            self._lock.acquire()

    def port(self) -> Port:
        """Port of the bus, for frames in and out."""
        return Port(self.bus, self.timebase, self.log)

    def bring_up(self) -> BringUp:
        """SDO access to all nodes of the bus file."""
        return BringUp(self.port(), self.config, lambda _message: None)

    def link(
        self,
        limits: SafetyLimits,
        stiffness: Sequence[float],
        *,
        read_only: bool = False,
        momentum: LegMomentum | None = None,
    ) -> Link:
        """Make a cyclic link, as `Link` with this bus; nothing is sent yet."""
        link = Link(
            self.bus,
            self.config,
            limits,
            stiffness=stiffness,
            timebase=self.timebase,
            read_only=read_only,
            lock=self._lock,
            momentum=momentum,
        )
        if self.log is not None:
            link.show_frames_to(self.log)
        self._links.append(link)
        self.register(link)
        return link

    def register(self, leader: DriveLeader) -> None:
        """Register whoever leads drives, to be closed before the bus is shut down."""
        self._leaders.append(leader)

    @property
    def stopped(self) -> tuple[StopReport, ...]:
        """Reports of the stops of those who have led drives with this session."""
        return tuple(leader.stopped for leader in self._leaders if leader.stopped is not None)

    def close(self) -> None:
        """Stop all drives, shut the bus down, close the log; may be called twice, raises no error.

        No signal gets in between: a ^C that comes meanwhile is raised at the end. The log comes
        last: drives and channel wait for no disk, and a ^C ends the wait for it.
        """
        if self._closed:
            return
        try:
            self._let_go()
        finally:
            if self.log is not None:
                self.log.close()

    def _let_go(self) -> None:
        """Stop all drives, shut the bus down, release the channel."""
        with shielded() as shield:
            for leader in self._leaders:
                try:
                    leader.close()
                except BaseException as error:  # The others have to be stopped, too.
                    shield.hold(error)
            self._closed = True
            try:
                self.bus.shutdown()
            except BaseException as error:
                # The drives have been told to stop; no error of the interface may end the closing:
                # a serial adapter raises a ValueError for a garbled line.
                shield.hold(error)
            self._lock.release()

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Close; an exception on its way gets a note of every drive that keeps its power."""
        try:
            self.close()
        finally:
            if error is not None:
                for report in self.stopped:
                    add_trouble(error, report)
