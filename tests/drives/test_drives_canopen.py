"""The `canopen` package as the master of the emulated drives, in virtual time, one thread."""

import io
import math
from collections.abc import Iterator
from typing import Any

import can
import pytest
from drives_rig import MS, START, config

from legbench.drives.emulated.behaviour import Behaviour
from legbench.drives.emulated.build import emulate
from legbench.drives.emulated.bus import LockstepBus
from legbench.drives.protocol.cia402 import DriveState
from legbench.drives.setup.eds import dcf_text, eds_text

canopen = pytest.importorskip("canopen")
p402 = pytest.importorskip("canopen.profiles.p402")
PATIENCE = 60.0
"""Longest that anything may take on a busy machine [s]."""
PER_RAD = (1 << 20) / (2.0 * math.pi)


class Pump:
    """Lets the bus answer whatever `canopen` has just sent, instead of its thread."""

    def __init__(self) -> None:
        behaviours = [Behaviour(start_pos=pos, interpolate=False) for pos in START]
        self.emulated = emulate(config(), behaviours)
        self.bus = LockstepBus("canopen", network=self.emulated)
        self.network: Any = canopen.Network(self.bus)
        self.network.send_message = self.send
        self.pass_time(10 * MS)

    def send(self, can_id: int, data: bytes, remote: bool = False) -> None:
        message = can.Message(
            arbitration_id=can_id, data=data, is_extended_id=False, is_remote_frame=remote
        )
        self.bus.send(message)
        self.pass_time(600_000)

    def pass_time(self, span_ns: int) -> None:
        until_ns = self.emulated.now_ns + span_ns
        while self.emulated.now_ns < until_ns:
            message = self.bus.recv(1e-9 * (until_ns - self.emulated.now_ns))
            if message is not None:
                self.network.notify(
                    message.arbitration_id, bytearray(message.data), message.timestamp
                )

    def cycle(self, node: Any) -> None:
        """What `canopen` leaves to its user: SYNC, and RPDOs when they are synchronous."""
        self.send(0x080, b"")
        for rpdo in node.rpdo.values():
            if rpdo.enabled:
                rpdo.transmit()
        self.pass_time(MS - self.emulated.now_ns % MS)


def node_of(pump: Pump, text: str, name: str) -> Any:
    class Node(p402.BaseNode402):
        # These times are the machine's, not the bus's: they must outlast one that stands still.
        TIMEOUT_RESET_FAULT = TIMEOUT_SWITCH_OP_MODE = PATIENCE
        TIMEOUT_SWITCH_STATE_FINAL = TIMEOUT_SWITCH_STATE_SINGLE = PATIENCE

        def check_statusword(self, timeout: float | None = None) -> int:
            pump.cycle(self)
            return self.statusword

    file = io.StringIO(text)
    file.name = name
    node = Node(1, canopen.objectdictionary.import_od(file, node_id=1))
    pump.network.add_node(node)
    return node


@pytest.fixture(params=["eds", "dcf"])
def rig(request: pytest.FixtureRequest) -> Iterator[tuple[Pump, Any]]:
    pump = Pump()
    usual = config()
    text = eds_text() if request.param == "eds" else dcf_text(usual, usual.nodes[0])
    yield pump, node_of(pump, text, f"hip.{request.param}")
    pump.bus.shutdown()


def remap(node: Any) -> None:
    """Its own way of mapping: everything through 1600h, 1A00h and their like."""
    node.nmt.state = "PRE-OPERATIONAL"
    node.tpdo.read()
    node.rpdo.read()
    node.tpdo[1].clear()
    for index in (0x6041, 0x6064):
        node.tpdo[1].add_variable(index)
    node.rpdo[1].clear()
    for index in (0x6040, 0x607A):
        node.rpdo[1].add_variable(index)
    for pdo in (node.tpdo[1], node.rpdo[1]):
        pdo.trans_type = 1
        pdo.enabled = True
        pdo.save()


def test_sdo_and_identity(rig: tuple[Pump, Any]) -> None:
    _, node = rig
    identity = [node.sdo[0x1018][sub].raw for sub in range(1, 5)]
    assert identity == [0x1234, 7, 0, 100]
    assert node.sdo[0x1008].raw == "legbench-drive"
    node.sdo[0x6085].raw = 123456
    assert node.sdo[0x6085].raw == 123456
    with pytest.raises(canopen.SdoAbortedError, match="0x06010002"):
        node.sdo[0x6064].raw = 1
    with pytest.raises(canopen.SdoAbortedError, match="0x06020000"):
        node.sdo.upload(0x5000, 0)


def test_scan_and_nmt(rig: tuple[Pump, Any]) -> None:
    pump, node = rig
    pump.network.scanner.search(limit=5)
    assert pump.network.scanner.nodes == [1, 2]
    node.sdo[0x1017].raw = 10
    pump.pass_time(25 * MS)
    assert node.nmt.state == "PRE-OPERATIONAL"
    node.nmt.state = "OPERATIONAL"
    pump.pass_time(25 * MS)
    assert node.nmt.state == "OPERATIONAL"


def test_emergencies_are_understood(rig: tuple[Pump, Any]) -> None:
    pump, node = rig
    drive = pump.emulated.drives[0]
    drive.trip(0x3220, pump.emulated.now_ns)
    pump.pass_time(2 * MS)
    assert [error.code for error in node.emcy.active] == [0x3220]
    assert node.sdo[0x603F].raw == 0x3220


def test_remap_bring_up_and_motion(rig: tuple[Pump, Any]) -> None:
    pump, node = rig
    remap(node)
    node.setup_402_state_machine()
    node.nmt.state = "OPERATIONAL"
    node.op_mode = "CYCLIC SYNCHRONOUS POSITION"
    pump.cycle(node)
    assert node.op_mode == "CYCLIC SYNCHRONOUS POSITION"
    node.rpdo[1][0x607A].raw = node.tpdo[1][0x6064].raw
    for state in ("READY TO SWITCH ON", "SWITCHED ON", "OPERATION ENABLED"):
        node.state = state
        assert node.state == state
    drive = pump.emulated.drives[0]
    assert drive.axis.power.state is DriveState.OPERATION_ENABLED
    assert drive.axis.motion.angle == pytest.approx(START[0], abs=1e-5)
    start = node.tpdo[1][0x6064].raw
    for step in range(1, 101):
        node.rpdo[1][0x607A].raw = start + round(1e-3 * step * PER_RAD)
        pump.cycle(node)
    pump.cycle(node)
    assert drive.axis.motion.angle == pytest.approx(START[0] + 0.1, abs=1e-5)
    pump.cycle(node)
    assert node.tpdo[1][0x6064].raw == start + round(0.1 * PER_RAD)
    node.state = "SWITCH ON DISABLED"
    assert drive.axis.power.state is DriveState.SWITCH_ON_DISABLED
