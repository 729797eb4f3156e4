"""Two emulated drives, a bus and a link in virtual time."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from legbench.drives.emulated.behaviour import Behaviour
from legbench.drives.emulated.body import Body, stiff_body
from legbench.drives.emulated.build import emulate
from legbench.drives.emulated.bus import LockstepBus
from legbench.drives.emulated.network import Network
from legbench.drives.master.link import Link
from legbench.drives.protocol.cia402 import DriveState, decode_state
from legbench.drives.setup.config import BusConfig, Identity, NodeConfig
from legbench.drives.setup.units import AxisUnits
from legbench.drives.transport.lock import ChannelLock
from legbench.limits.safety import SafetyLimits

START = (-0.5, 1.9)
"""Where the motors stand at power-on [rad]."""
STIFFNESS = (4.0, 5.0)
LIMITS = SafetyLimits(
    motor_range=((-2.0, 1.0), (0.0, 3.0)),
    command_speed=20.0,
    following_error=0.3,
    spring_torque=10.0,
)
MS = 1_000_000


def node(place: int) -> NodeConfig:
    """Hip or knee; the knee is mirrored, both have offsets."""
    return NodeConfig(
        name=("hip", "knee")[place],
        node_id=place + 1,
        identity=Identity(vendor=0x1234, product=7, serial=100 + place),
        motor=AxisUnits(counts_per_rev=1 << 20, offset_counts=777, sign=1 - 2 * place),
        link=AxisUnits(counts_per_rev=1 << 16, offset_counts=-55, bits=16),
    )


def config(**changes: Any) -> BusConfig:
    """The bus of the rig."""
    return replace(BusConfig(nodes=(node(0), node(1))), **changes)


@dataclass
class Rig:
    """What a test holds."""

    config: BusConfig
    network: Network
    bus: LockstepBus
    link: Link

    def run(self, cycles: int, targets: Sequence[float] = START) -> None:
        """Command the same posture for some cycles."""
        for _ in range(cycles):
            self.link.command(targets)
            self.link.exchange()

    @property
    def states(self) -> list[DriveState]:
        """Of the drives themselves."""
        return [drive.axis.power.state for drive in self.network.drives]

    @property
    def angles(self) -> list[float]:
        """True motor positions [rad]."""
        return [drive.axis.motion.angle for drive in self.network.drives]

    def words(self) -> list[tuple[int, int, int]]:
        """Time, node and controlword of every RPDO that was on the wire."""
        found = []
        for at_ns, frame in self.network.log or []:
            if 0x200 < frame.cob_id <= 0x27F:
                word = int.from_bytes(frame.data[:2], "little")
                found.append((at_ns, frame.cob_id - 0x200, word))
        return found


@contextmanager
def rig(
    folder: Path,
    *,
    bus_config: BusConfig | None = None,
    behaviours: Sequence[Behaviour] | None = None,
    limits: SafetyLimits = LIMITS,
    read_only: bool = False,
    configured: bool = False,
    body: Body = stiff_body,
    tx_queue: int = 64,
) -> Iterator[Rig]:
    """A rig whose link is not started yet."""
    chosen = bus_config or config()
    how = behaviours or [Behaviour(start_pos=pos, seed=3) for pos in START]
    network = emulate(chosen, how, body=body, keep_log=True, configured=configured)
    bus = LockstepBus("rig", network=network, tx_queue=tx_queue)
    link = Link(
        bus,
        chosen,
        limits,
        stiffness=STIFFNESS,
        read_only=read_only,
        lock=ChannelLock("rig", folder),
    )
    try:
        yield Rig(chosen, network, bus, link)
    finally:
        link.close()
        bus.shutdown()


def state_of(statusword: int) -> DriveState | None:
    """Short for tests."""
    return decode_state(statusword)
