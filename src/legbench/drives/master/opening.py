"""The opening of a link: the channel is taken, the drives are checked and configured."""

from legbench.drives.master.ending import Ending
from legbench.drives.master.link_state import LinkState
from legbench.drives.master.port import Listener, Port
from legbench.drives.master.preparation import prepare_to_move, read_temperatures, refuse_led
from legbench.drives.master.read_only import may_pace, may_read
from legbench.drives.master.start_up import StartUp
from legbench.drives.master.supervisor import Supervisor
from legbench.drives.setup.config import BusConfig
from legbench.drives.setup.master_watch import check_master_watch
from legbench.drives.setup.taken import Outcomes, tells_heartbeat, unprotected
from legbench.drives.transport.lock import ChannelLock
from legbench.limits.safety import SafetyLimits

LISTEN_NS = 100_000_000
"""Time that a read-only link listens for another master's SYNC and for heartbeats [ns]."""


class Opening(Ending):
    """Base class of a link: what it does before process data begins and before anything moves.

    Attributes:
        unprotected: what the drives lack or hold otherwise, a line each, once it is open.
    """

    def __init__(
        self,
        port: Port,
        config: BusConfig,
        limits: SafetyLimits,
        lock: ChannelLock,
        *,
        read_only: bool,
    ) -> None:
        """Wire the parts; nothing is sent.

        Args:
            port: port of the bus.
            config: drives on the bus.
            limits: limits that the link enforces.
            lock: lock that `open` takes.
            read_only: observe; change nothing in a drive, see `master.read_only`.
        """
        super().__init__(port, config, lock, read_only=read_only)
        self._limits = limits
        self._supervisor = Supervisor(self.cycle, config, limits, port.timebase)
        self._start_up = StartUp(port, self.cycle, config, read_only=read_only)
        self._told: Listener | None = None
        self.unprotected: tuple[str, ...] = ()

    def tell(self, listener: Listener) -> None:
        """Show every frame to a listener from now on, or from when the drives are configured.

        A log that holds their configuration would, played back, bring parked drives back to life.
        """
        self._told = listener
        if self.state is not LinkState.NEW:
            self._port.listener = listener

    @property
    def listener_error(self) -> str | None:
        """Error that a listener raised, in one line; the listener is not called again."""
        return self._port.listener_error

    def open(self) -> None:
        """Take the channel, check who is there, write and read back the configuration.

        In read-only nothing is written, and the channel is taken only if SYNC has to come from
        here.

        Raises:
            ConfigError: a drive would go on for too long without its master.
            BusError: the channel has a master, or the interface does not work.
            DriveError: a drive is missing, is another one, refuses what is required of it, or would
                not be protected; or, in read-only, is not configured.
            PlantFault: in read-only, somebody else is about to lead the drives.
        """
        if self.state is not LinkState.NEW:
            return
        try:
            if self._read_only:
                self._prepare_to_look()
            else:
                check_master_watch(self._config, speed=self._limits.command_speed)
                self._hold()
                speed = self._limits.command_speed
                self._took(prepare_to_move(self.bring_up, self._config, speed=speed))
            read_temperatures(self.bring_up, self.cycle, self._config)
        except BaseException:
            self._let_go()
            raise
        self.state = LinkState.CONFIGURED
        if self._told is not None:
            self._port.listener = self._told

    def _took(self, outcomes: Outcomes) -> None:
        """Keep what drives lack, and watch for no heartbeat that a drive does not produce."""
        self.unprotected = unprotected(outcomes)
        for node, watch in zip(self._config.nodes, self.cycle.watches, strict=True):
            watch.expects_heartbeat = tells_heartbeat(outcomes[node.name])

    def _prepare_to_look(self) -> None:
        """Prepare a read-only link: listen to another master's SYNC, or send SYNC if there is none.

        Raises:
            BusError: a master of this computer holds the channel, and sends no SYNC yet.
            DriveError: a drive is not configured, or somebody leads it without SYNC.
            PlantFault: somebody else is about to lead them.
        """
        self._port.may_send = may_read
        now_ns = self._port.timebase.now_ns()
        self.listening = self.cycle.hears_sync(now_ns + LISTEN_NS)
        self._start_up.listening = self.listening
        if self.listening:
            self.bring_up.lookout.rest()
        else:
            self._hold()
            self.bring_up.listen()
        self.bring_up.identify()
        self._took(self.bring_up.refuse_differences())
        if self.listening:
            return
        refuse_led(self.bring_up, self.cycle, self._config)
        self._supervisor.alone()
        self._port.may_send = may_pace(self._config.master_id)
