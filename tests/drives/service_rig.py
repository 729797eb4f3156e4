"""Emulated drives as reset, store, node-id and scan find them."""

import dataclasses
from collections.abc import Sequence
from typing import Any

from can_rig import BUS

from legbench.drives.emulated.behaviour import Behaviour
from legbench.drives.emulated.build import emulate, on_bench
from legbench.drives.emulated.bus import LockstepBus
from legbench.drives.emulated.drive import EmulatedDrive
from legbench.drives.emulated.network import Network
from legbench.drives.master.session import Session
from legbench.drives.protocol.cia402 import DriveState
from legbench.drives.protocol.datatypes import DataType
from legbench.drives.protocol.frame import Frame
from legbench.drives.protocol.pdo import Mapped
from legbench.drives.setup.bus_file import load_bus
from legbench.drives.setup.config import BusConfig, NodeConfig
from legbench.drives.setup.homed import HomedCondition

MS = 1_000_000
FAULT, SOD = DriveState.FAULT, DriveState.SWITCH_ON_DISABLED
HOMED = HomedCondition(object=Mapped(0x6041, 0, DataType.UNSIGNED16), mask=0x8000)
BENCH = load_bus(BUS)


def serial(node: NodeConfig, number: int, **changes: Any) -> NodeConfig:
    identity = dataclasses.replace(node.identity, serial=number)
    return dataclasses.replace(node, identity=identity, **changes)


def on(network: Network, config: BusConfig = BENCH) -> Session:
    network.advance(20 * MS)
    return Session(LockstepBus("leg", network=network), config)


def opened(config: BusConfig = BENCH) -> tuple[Session, Network]:
    network = emulate(config, [on_bench(node, 0.0) for node in config.nodes], keep_log=True)
    return on(network, config), network


def alone(*nodes: NodeConfig, keep: Sequence[int | None] = ()) -> tuple[Session, Network]:
    """Drives on a bus of the bench's file, whatever their node ids; None is a drive without one."""
    drives = [EmulatedDrive(node, Behaviour(seed=place)) for place, node in enumerate(nodes)]
    network = Network(drives, keep_log=True, body=lambda motors: (motors, [0.0] * len(motors)))
    for drive, kept in zip(drives, keep, strict=False):
        if kept is None:
            network.advance(network.now_ns + 20 * MS)
            for data in ((0x04, 1), (0x11, 255), (0x17,)):
                drive.receive(Frame(0x7E5, bytes(data).ljust(8, b"\0")), network.now_ns)
            drive.take()
            drive.reset(network.now_ns)
    return on(network), network


def written(network: Network) -> list[Frame]:
    """SDO downloads, NMT orders and LSS configurations that were on the wire."""
    frames = [frame for _, frame in network.log or []]
    return [
        frame
        for frame in frames
        if frame.cob_id == 0
        or (0x600 < frame.cob_id < 0x680 and frame.data[0] >> 5 == 1)
        or (frame.cob_id == 0x7E5 and frame.data[0] in (0x11, 0x17))
    ]


def controlwords(network: Network, node: int) -> list[int]:
    return [
        int.from_bytes(frame.data[4:6], "little")
        for frame in written(network)
        if frame.cob_id == 0x600 + node and frame.data[1:4] == b"\x40\x60\x00"
    ]


def states(network: Network) -> list[DriveState]:
    return [drive.axis.power.state for drive in network.drives]
