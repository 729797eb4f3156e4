"""The emulated leg for other processes."""

import time
from collections.abc import Callable

from legbench.drives.emulated.behaviour import Behaviour
from legbench.drives.emulated.body import Body, stiff_body
from legbench.drives.emulated.build import emulate, on_bench
from legbench.drives.emulated.bus_server import BusServer
from legbench.drives.emulated.network import Network
from legbench.drives.emulated.slcan_server import SlcanServer
from legbench.drives.emulated.unix_server import UnixServer
from legbench.drives.protocol.cia402 import DriveState
from legbench.drives.setup.config import BusConfig
from legbench.drives.transport.realtime import PRIORITY, ask
from legbench.onlooker import Onlooker

Server = UnixServer | SlcanServer | BusServer
"""Server through which the drives are reached."""
BODY_PERIOD_NS = 1_000_000
"""Period of the leg on the shafts, whatever that of the cycle is [ns]."""
Report = Callable[[float, str, str], None]
"""Called with time since the start [s], node and its new state."""


def serve(
    config: BusConfig,
    serve_at: Callable[[Network], Server],
    *,
    start_pos: tuple[float, ...],
    body: Body = stiff_body,
    patience: int = 5,
    report: Report,
    ready: Callable[[Server], None],
    stop: Callable[[], bool],
) -> None:
    """Serve emulated drives until told to stop.

    The drives reply at once: the way through two processes takes long enough.

    Args:
        config: the bus.
        serve_at: makes the server of a network.
        start_pos: motor positions at power-on [rad].
        body: what hangs on the shafts.
        patience: periods without SYNC or target after which an enabled drive faults.
        report: told every change of a drive's state, until it fails.
        ready: called when the bus can be used.
        stop: asked all the time.

    Raises:
        BusError: the bus cannot be opened, or has failed.
        PlantFault: the leg has come apart.
    """
    behaviours = _behaviours(config, start_pos, patience)
    # A master on the same processor goes first, as it would on one of its own.
    ask(priority=PRIORITY - 1)
    network = emulate(config, behaviours, body=body, body_period_ns=BODY_PERIOD_NS)
    # A terminal that is closed must not take the drives from a master that leads them.
    reporting = Onlooker("report", report)
    shown: dict[str, DriveState] = {}
    began = time.monotonic()
    with serve_at(network) as server:
        ready(server)
        while not stop():
            server.poll()
            for node, drive in zip(config.nodes, network.drives, strict=True):
                state = drive.axis.power.state
                if shown.get(node.name) is not state:
                    shown[node.name] = state
                    reporting(time.monotonic() - began, node.name, state.value)


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
