"""An emulated leg behind CAN frames, as the tests of the whole plant want it."""

import itertools
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import final

from legbench.control import AbstractController
from legbench.design import LegDesign, load_design
from legbench.design.setup import Setup
from legbench.drives.emulated.behaviour import Behaviour
from legbench.drives.emulated.build import emulate
from legbench.drives.emulated.bus import LockstepBus
from legbench.drives.emulated.network import Network
from legbench.drives.emulated.network_time import NetworkTime
from legbench.drives.master.session import Session
from legbench.drives.protocol.datatypes import DataType
from legbench.drives.protocol.pdo import Mapped
from legbench.drives.setup.bus_file import load_bus, load_limits
from legbench.drives.setup.config import (
    LINK_POSITION,
    POSITION_ACTUAL,
    STATUSWORD,
    BusConfig,
    PdoConfig,
)
from legbench.drives.setup.units import AxisUnits
from legbench.experiment import (
    ControllerSettings,
    Experiment,
    make_controller,
    targets_of,
)
from legbench.limits.safety import SafetyLimits
from legbench.mjcf import Linkage, LinkageKind
from legbench.plant.can import CanPlant
from legbench.plant.emulated_leg import EmulatedLeg
from legbench.plant.start import Start

ROOT = Path(__file__).parents[2]
BUS, LIMITS = ROOT / "hardware" / "leg.toml", ROOT / "hardware" / "limits.toml"
MS = 1_000_000
FINE = AxisUnits(counts_per_rev=1 << 30)
"""An encoder that resolves everything: 6e-9 rad."""
MODE = Mapped(0x6061, 0, DataType.INTEGER8)


def fine_bus() -> BusConfig:
    """The bench's bus with encoders that resolve everything, and no drive's own limits."""
    pdos = (
        PdoConfig(number=1, objects=(STATUSWORD, POSITION_ACTUAL)),
        PdoConfig(number=2, objects=(LINK_POSITION,)),
    )
    bench = load_bus(BUS)
    nodes = tuple(
        replace(node, motor=FINE, link=FINE, link_object=LINK_POSITION, tpdos=pdos, parameters=())
        for node in bench.nodes
    )
    # Two answers a drive are in time where it answers soon: 55 + 100 + 65 + 2 (115 + 95) us.
    return replace(bench, nodes=nodes, reply_delay_us=100)


def experiment(controller: ControllerSettings, duration: float = 1.0) -> Experiment:
    """The optimal leg where its controller is at home.

    Its linkage is reduced: drives and bus cannot tell it from bars, which cost a fifth more.
    """
    return Experiment(
        design=load_design(ROOT / "models" / "optimal.toml"),
        controller=controller,
        setup=Setup(kind=controller.usual_setup),
        linkage=Linkage(kind=LinkageKind.REDUCED),
        duration=duration,
    )


@final
class LateTime:
    """Virtual time whose waits end late, by what `late_ns` says of one after the other."""

    def __init__(self, network: Network) -> None:
        self._time = NetworkTime(network)
        self.late_ns: Iterator[int] = itertools.repeat(0)

    def now_ns(self) -> int:
        return self._time.now_ns()

    def wait_until(self, at_ns: int) -> None:
        self._time.wait_until(at_ns + next(self.late_ns))


@dataclass(frozen=True, kw_only=True)
class Stage:
    """What a test holds."""

    plant: CanPlant
    network: Network
    body: EmulatedLeg
    controller: AbstractController
    design: LegDesign
    start: Start
    session: Session


def staged(chosen: Experiment) -> tuple[AbstractController, Start]:
    """Controller and start posture of an experiment."""
    targets = targets_of(chosen)
    controller = make_controller(chosen.controller, targets)
    motor = controller.start_motor_pos
    return controller, Start(joint_pos=targets.link_at_rest(motor), motor_pos=motor)


@contextmanager
def stage(
    chosen: Experiment,
    *,
    config: BusConfig | None = None,
    limits: SafetyLimits | None = None,
    behaviours: Sequence[Behaviour] | None = None,
    ideal: bool = False,
    lands: bool = True,
) -> Iterator[Stage]:
    """An emulated leg for an experiment, drives at its start posture.

    Without `lands` a run ends at its last row, which is quicker where its end is not the matter.
    """
    bus = config or load_bus(BUS)
    controller, start = staged(chosen)
    motors = [float(value) for value in start.motor_pos]
    usual = [Behaviour.ideal(motor) if ideal else Behaviour(start_pos=motor) for motor in motors]
    body = EmulatedLeg(chosen.design, chosen.options, start)
    network = emulate(bus, behaviours or usual, body=body, keep_log=True)
    session = Session(LockstepBus("leg", network=network), bus)
    link = session.link(limits or load_limits(LIMITS), chosen.design.stiffness)
    plant = CanPlant(session, link, start, lands=lands)
    with plant:
        yield Stage(
            plant=plant,
            network=network,
            body=body,
            controller=controller,
            design=chosen.design,
            start=start,
            session=session,
        )
