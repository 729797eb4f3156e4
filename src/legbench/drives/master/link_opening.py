"""The opening of a link: the channel is taken, the drives are checked and configured."""

from typing import final

from legbench.drives.master.link_parts import LinkParts
from legbench.drives.master.link_state import LinkState
from legbench.drives.master.port import Listener
from legbench.drives.master.preparation import (
    check_homed,
    prepare_to_move,
    read_temperatures,
    refuse_led,
)
from legbench.drives.master.read_only import may_pace, may_read
from legbench.drives.setup.master_watch import check_master_watch
from legbench.drives.setup.taken import Outcomes, tells_heartbeat, unprotected

LISTEN_NS = 100_000_000
"""Time that a read-only link listens for another master's SYNC and for heartbeats [ns]."""


@final
class LinkOpening:
    """Opening of a link: its work before process data begins and before anything moves."""

    def __init__(self, parts: LinkParts) -> None:
        """Prepare to open a link with these parts; nothing is sent."""
        self._parts = parts
        self._waiting: Listener | None = None

    def show_frames_to(self, listener: Listener) -> None:
        """Show every frame to a listener from now on, or from when the drives are configured.

        A log that holds their configuration would, played back, bring parked drives back to life.
        """
        self._waiting = listener
        if self._parts.status.state is not LinkState.NEW:
            self._parts.port.listener = listener

    def run(self) -> None:
        """Take the channel, check who is there, write and read back the configuration.

        In read-only nothing is written, and the channel is taken only if SYNC has to come from
        here. A link that is open already is left as it is.

        Raises:
            ConfigError: a drive would go on for too long without its master.
            BusError: the channel has a master, or the interface does not work.
            DriveError: a drive is missing, is another one, refuses what is required of it, or would
                not be protected; or, in read-only, is not configured.
            PlantFault: in read-only, somebody else is about to lead the drives.
        """
        parts = self._parts
        if parts.status.state is not LinkState.NEW:
            return
        try:
            if parts.read_only:
                self._prepare_to_look()
            else:
                check_master_watch(parts.config, speed=parts.limits.command_speed)
                parts.channel.take()
                speed = parts.limits.command_speed
                self._took(prepare_to_move(parts.bring_up, parts.config, speed=speed))
            read_temperatures(parts.bring_up, parts.cycle, parts.config)
        except BaseException:
            parts.channel.release()
            raise
        parts.status.state = LinkState.CONFIGURED
        if self._waiting is not None:
            parts.port.listener = self._waiting

    def _took(self, outcomes: Outcomes) -> None:
        """Keep what drives lack, and watch for no heartbeat that a drive does not produce."""
        parts = self._parts
        parts.status.unprotected = unprotected(outcomes)
        for node, watch in zip(parts.config.nodes, parts.cycle.watches, strict=True):
            watch.expects_heartbeat = tells_heartbeat(outcomes[node.name])

    def _prepare_to_look(self) -> None:
        """Prepare a read-only link: listen to another master's SYNC, or send SYNC if there is none.

        Raises:
            BusError: a master of this computer holds the channel, and sends no SYNC yet.
            DriveError: a drive is not configured, or somebody leads it without SYNC.
            PlantFault: somebody else is about to lead them.
        """
        parts, port = self._parts, self._parts.port
        port.may_send = may_read
        listening = parts.cycle.hears_sync(port.timebase.now_ns() + LISTEN_NS)
        parts.status.listening = parts.start_up.listening = listening
        if listening:
            parts.bring_up.detector.disarm()
        else:
            parts.channel.take()
            parts.bring_up.listen()
        parts.bring_up.identify()
        check_homed(parts.bring_up, parts.config.nodes)
        self._took(parts.bring_up.refuse_differences())
        if listening:
            return
        refuse_led(parts.bring_up, parts.cycle, parts.config)
        parts.supervisor.check_no_other_master()
        port.may_send = may_pace(parts.config.master_id)
