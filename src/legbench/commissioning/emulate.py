"""Server of the emulated leg for other processes."""

import time
from collections.abc import Callable, Sequence

from legbench.drives.emulated.behaviour import Behaviour
from legbench.drives.emulated.body import Body, stiff_body
from legbench.drives.emulated.build import emulate, emulate_channels, on_bench
from legbench.drives.emulated.bus_server import BusServer
from legbench.drives.emulated.drive import EmulatedDrive
from legbench.drives.emulated.network import Network
from legbench.drives.emulated.slcan_server import SlcanServer
from legbench.drives.emulated.unix_server import ChannelsServer, UnixServer
from legbench.drives.protocol.cia402 import DriveState
from legbench.drives.setup.config import BusConfig
from legbench.drives.transport.realtime import PRIORITY, ask
from legbench.onlooker import Onlooker

Server = UnixServer | ChannelsServer | SlcanServer | BusServer
"""Server through which the drives are reached."""
BODY_PERIOD_NS = 1_000_000
"""Period of the leg on the shafts, whatever that of the cycle is [ns]."""
Report = Callable[[float, str, str], None]
"""Function that is called with the time since the start [s], a node and its new state."""


def serve(
    config: BusConfig,
    serve_at: Callable[[Sequence[Network]], Server],
    *,
    start_pos: tuple[float, ...],
    body: Body = stiff_body,
    patience: int = 5,
    report: Report,
    ready: Callable[[Server], None],
    stop: Callable[[], bool],
) -> None:
    """Serve emulated drives until told to stop.

    The drives reply without delay, since the way through two processes takes time enough.

    Args:
        config: the bus.
        serve_at: makes the server of one network, or of those of several channels.
        start_pos: motor positions at power-on [rad].
        body: mechanical load on the motor shafts.
        patience: periods without SYNC or target after which an enabled drive faults.
        report: told every change of a drive's state, until it fails.
        ready: called when the bus can be used.
        stop: called repeatedly; the server ends when it returns true.

    Raises:
        BusError: the bus cannot be opened, or has failed.
        PlantFault: the leg has come apart.
    """
    # A master on the same processor goes first, as it would on one of its own.
    ask(priority=PRIORITY - 1)
    networks, drives = _emulated(config, _behaviours(config, start_pos, patience), body)
    # A terminal that is closed must not take the drives from a master that leads them.
    reporting = Onlooker("report", report)
    shown: dict[str, DriveState] = {}
    began = time.monotonic()
    with serve_at(networks) as server:
        ready(server)
        while not stop():
            server.poll()
            for name, drive in drives:
                state = drive.axis.power.state
                if shown.get(name) is not state:
                    shown[name] = state
                    reporting(time.monotonic() - began, name, state.value)


def _emulated(
    config: BusConfig, behaviours: Sequence[Behaviour], body: Body
) -> tuple[tuple[Network, ...], list[tuple[str, EmulatedDrive]]]:
    """Networks of a bus file, one a channel, and their drives by name."""
    if len(config.channels) > 1:
        nodes = [node for channel in config.channels for node in config.nodes_on(channel)]
        networks = emulate_channels(config, behaviours, body=body, body_period_ns=BODY_PERIOD_NS)
    else:
        nodes = config.nodes
        networks = (emulate(config, behaviours, body=body, body_period_ns=BODY_PERIOD_NS),)
    drives = [drive for network in networks for drive in network.drives]
    return networks, [(node.name, drive) for node, drive in zip(nodes, drives, strict=True)]


def _behaviours(config: BusConfig, start_pos: tuple[float, ...], patience: int) -> list[Behaviour]:
    """Behaviours of drives that reply at once and start at some motor positions [rad]."""
    return [
        on_bench(
            node,
            pos,
            reply_delay_us=(0, 0),
            missing_limit=patience,
            sync_loss_periods=patience,
        )
        for node, pos in zip(config.nodes, start_pos, strict=True)
    ]
