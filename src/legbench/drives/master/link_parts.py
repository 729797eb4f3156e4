"""The parts of a link that its opening, its cycle and its end have in common."""

from dataclasses import dataclass
from typing import Self, final

from legbench.drives.master.bring_up import BringUp
from legbench.drives.master.channel_hold import ChannelHold
from legbench.drives.master.cycle import Cycle
from legbench.drives.master.link_status import LinkStatus
from legbench.drives.master.port import Port
from legbench.drives.master.start_up import StartUp
from legbench.drives.master.supervisor import Supervisor
from legbench.drives.setup.config import BusConfig
from legbench.drives.transport.lock import ChannelLock
from legbench.limits.safety import SafetyLimits


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class LinkParts:
    """Parts of a link, wired to one port."""

    port: Port
    """Port of the bus."""
    config: BusConfig
    """Drives on the bus."""
    limits: SafetyLimits
    """Limits that the link enforces."""
    read_only: bool
    """Whether the link observes and changes nothing in a drive, see `master.read_only`."""
    cycle: Cycle
    """Cyclic exchange of process data."""
    bring_up: BringUp
    """SDO access to all drives."""
    supervisor: Supervisor
    """Checks of bus, grid and drives."""
    start_up: StartUp
    """Enabling of configured drives."""
    channel: ChannelHold
    """Hold on the lock of the channel."""
    status: LinkStatus
    """Present status of the link."""

    @classmethod
    def wired(
        cls,
        port: Port,
        config: BusConfig,
        limits: SafetyLimits,
        lock: ChannelLock,
        *,
        read_only: bool,
    ) -> Self:
        """Make the parts of a new link; nothing is sent.

        Args:
            port: port of the bus.
            config: drives on the bus.
            limits: limits that the link enforces.
            lock: lock of the channel, which is not taken yet.
            read_only: observe; change nothing in a drive.
        """
        cycle = Cycle(port, config)
        return cls(
            port=port,
            config=config,
            limits=limits,
            read_only=read_only,
            cycle=cycle,
            bring_up=BringUp(port, config, cycle.other),
            supervisor=Supervisor(cycle, config, limits, port.timebase),
            start_up=StartUp(port, cycle, config, read_only=read_only),
            channel=ChannelHold(lock),
            status=LinkStatus(),
        )
