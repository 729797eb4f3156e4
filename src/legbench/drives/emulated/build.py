"""An emulated bus from a bus configuration."""

import math
from collections.abc import Sequence
from typing import Any

from legbench.drives.emulated.behaviour import Behaviour
from legbench.drives.emulated.body import Body, stiff_body
from legbench.drives.emulated.drive import EmulatedDrive
from legbench.drives.emulated.faults import Fault
from legbench.drives.emulated.network import Network
from legbench.drives.emulated.stuffing import Stuffing
from legbench.drives.setup.config import BusConfig, NodeConfig
from legbench.drives.setup.configuration import configuration
from legbench.errors import ConfigError

STOP_BEHIND = 0.1
"""Distance of the mechanical stops behind the soft limits of a motor [rad]."""
FREE_RANGE = math.pi
"""Distance of the mechanical stops from zero where a bus file gives no soft limits [rad]."""
HOME_SWITCH = (-0.05, 0.05)
"""Range of a motor in which its home switch is active [rad]."""


def on_bench(node: NodeConfig, start_pos: float, **changes: Any) -> Behaviour:
    """Behaviour of a drive as it hangs on a bench: with mechanical stops and switches to home by.

    Args:
        node: the drive, whose soft limits lie within its stops.
        start_pos: motor position at power-on [rad].
        changes: other fields of `Behaviour`.
    """
    low, high = node.soft_limits or (STOP_BEHIND - FREE_RANGE, FREE_RANGE - STOP_BEHIND)
    stops = (min(low - STOP_BEHIND, start_pos), max(high + STOP_BEHIND, start_pos))
    return Behaviour(start_pos=start_pos, hard_stop=stops, home_switch=HOME_SWITCH, **changes)


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
    """Build the emulated bus that a bus file describes, at its bitrate.

    Args:
        bus: the bus.
        behaviours: one a drive; by default ordinary drives at position 0.
        body: function that moves the body for one period.
        body_period_ns: period of the body; by default the bus's [ns].
        stuffing: how stuff bits count in the length of a frame.
        faults: faults to inject.
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
