"""An emulated bus from a bus configuration."""

from collections.abc import Sequence

from legbench.drives.emulated.behaviour import Behaviour
from legbench.drives.emulated.drive import EmulatedDrive
from legbench.drives.emulated.faults import Fault
from legbench.drives.emulated.network import Body, Network, Stuffing, stiff_body
from legbench.drives.setup.config import BusConfig
from legbench.drives.setup.configuration import configuration
from legbench.errors import ConfigError


def emulate(
    bus: BusConfig,
    behaviours: Sequence[Behaviour] | None = None,
    *,
    body: Body = stiff_body,
    body_period_ns: int | None = None,
    stuffing: Stuffing = Stuffing.WORST,
    faults: Sequence[Fault] = (),
    keep_log: bool = False,
    configured: bool = False,
) -> Network:
    """Drives as a bus file describes them, on a wire of its bitrate.

    Args:
        bus: the bus.
        behaviours: one a drive; by default ordinary drives at position 0.
        body: moves one body period.
        body_period_ns: by default the bus's period [ns].
        stuffing: how long frames are.
        faults: to inject.
        keep_log: remember every frame in `Network.log`.
        configured: the drives have kept, over their last power-off, what the bus file says.

    Raises:
        ConfigError: not one behaviour a drive.
    """
    chosen = [Behaviour() for _ in bus.nodes] if behaviours is None else list(behaviours)
    if len(chosen) != len(bus.nodes):
        raise ConfigError(f"{len(chosen)} behaviours for {len(bus.nodes)} drives")
    drives = [
        EmulatedDrive(node, how, tuple(configuration(bus, node)) if configured else ())
        for node, how in zip(bus.nodes, chosen, strict=True)
    ]
    return Network(
        drives,
        body=body,
        bitrate=bus.bitrate,
        body_period_ns=body_period_ns or bus.period_ns,
        stuffing=stuffing,
        faults=faults,
        keep_log=keep_log,
    )
