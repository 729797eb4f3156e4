"""An emulated bus from a bus configuration."""

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

from legbench.drives.emulated.behaviour import Behaviour
from legbench.drives.emulated.body import Body, stiff_body
from legbench.drives.emulated.dictionary import Dictionary, dictionary_of
from legbench.drives.emulated.drive import EmulatedDrive
from legbench.drives.emulated.faults import Fault
from legbench.drives.emulated.network import Network
from legbench.drives.emulated.shared_body import SharedBody
from legbench.drives.emulated.stuffing import Stuffing
from legbench.drives.setup.config import BusConfig, NodeConfig
from legbench.drives.setup.configuration import configuration
from legbench.drives.sheet.load import load_sheet
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

    A drive whose node names a data sheet wears that dictionary.

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
        ConfigError: not one behaviour a drive, or a data sheet that cannot be read.
        MissingExtraError: a drive has a data sheet, and canopen is not installed.
    """
    chosen = _checked(bus, behaviours)
    drives = [
        EmulatedDrive(node, how, tuple(configuration(bus, node)) if configured else (), objects)
        for node, how, objects in zip(bus.nodes, chosen, _dictionaries(bus), strict=True)
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


def _checked(bus: BusConfig, behaviours: Sequence[Behaviour] | None) -> list[Behaviour]:
    """Return one behaviour a drive, ordinary ones by default; raises ConfigError."""
    chosen = [Behaviour() for _ in bus.nodes] if behaviours is None else list(behaviours)
    if len(chosen) != len(bus.nodes):
        raise ConfigError(f"{len(chosen)} behaviours for {len(bus.nodes)} drives")
    return chosen


def _dictionaries(bus: BusConfig) -> list[Dictionary]:
    """Return the objects of every drive; a data sheet is read once."""
    paths = {node.eds for node in bus.nodes}
    sheets = {path: None if path is None else load_sheet(path) for path in paths}
    return [
        dictionary_of(
            node,
            sheets[node.eds],
            bus.period_us,
            {parameter.key: parameter.value for parameter in configuration(bus, node)},
        )
        for node in bus.nodes
    ]


def emulate_channels(
    bus: BusConfig,
    behaviours: Sequence[Behaviour] | None = None,
    *,
    body: Body = stiff_body,
    body_period_ns: int | None = None,
    faults: Sequence[Fault] = (),
    keep_log: bool = False,
    configured: bool = False,
) -> tuple[Network, ...]:
    """Build a network for every channel of a bus file; arguments as for `emulate`.

    All drives move one body, and their networks pass time together (`LockstepChannels`). A fault
    is injected into every channel that has its drive or its frame.

    Raises:
        ConfigError, MissingExtraError: as `emulate`.
    """
    chosen = _checked(bus, behaviours)
    groups = [bus.nodes_on(channel) for channel in bus.channels]
    order = [bus.nodes.index(node) for nodes in groups for node in nodes]

    def in_order(motor_pos: tuple[float, ...]) -> tuple[Sequence[float], Sequence[float]]:
        """Body as the drives see it in the order of their channels."""
        placed = dict(zip(order, motor_pos, strict=True))
        links, torques = body(tuple(placed[place] for place in range(len(order))))
        return [links[place] for place in order], [torques[place] for place in order]

    shared = SharedBody(in_order)
    networks = tuple(
        emulate(
            replace(bus, nodes=nodes),
            [chosen[bus.nodes.index(node)] for node in nodes],
            body=shared.part(place),
            body_period_ns=body_period_ns,
            faults=faults,
            keep_log=keep_log,
            configured=configured,
        )
        for place, nodes in enumerate(groups)
    )
    shared.join(networks)
    return networks
