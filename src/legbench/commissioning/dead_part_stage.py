"""Stages on which motors and encoders of a leg die: simulations behind limits, emulated drives."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from enum import StrEnum
from pathlib import Path

import numpy as np

from legbench.commissioning.broken_plant import BrokenPlant, Part
from legbench.control import AbstractController, BangBangConfig, JumpConfig, PositionJumpConfig
from legbench.design import LegDesign
from legbench.design.setup import Setup
from legbench.drives.emulated.behaviour import Behaviour
from legbench.drives.emulated.build import emulate
from legbench.drives.emulated.bus import LockstepBus
from legbench.drives.emulated.faults import NodeFault, NodeFaultKind
from legbench.drives.emulated.network import Network
from legbench.drives.master.session import Session
from legbench.drives.setup.bus_file import load_bus
from legbench.drives.setup.config import BusConfig
from legbench.experiment import (
    ControllerSettings,
    Experiment,
    make_controller,
    start_of,
    targets_of,
)
from legbench.limits.safety import SafetyLimits
from legbench.limits.upper_ends import LIMIT_ENDS
from legbench.plant.abstract import AbstractPlant
from legbench.plant.analytic import AnalyticPlant
from legbench.plant.can import CanPlant
from legbench.plant.can_open import LEG_PERIOD_NS
from legbench.plant.design_limits import open_limited
from legbench.plant.emulated_leg import EmulatedLeg
from legbench.plant.leg_momentum import momentum_on
from legbench.plant.opening import Leg
from legbench.plant.sim import SimPlant
from legbench.plant.start import Start
from legbench.plants import LIMITS_NAME, limits_for
from legbench.servo import PERFECT, ServoConfig

WIDEST_SWAY = LIMIT_ENDS["sway"][0]
"""Limit of the sway of a leg that leans as it starts: the widest that a limits file may give [rad].
"""
CONTROLLERS: dict[str, ControllerSettings] = {
    "jump": JumpConfig(),
    "bang-bang": BangBangConfig(),
    "position-jump": PositionJumpConfig(),
}


class Emulation(StrEnum):
    """Plant that takes the place of the leg."""

    CAN = "can"
    """Emulated drives on an emulated bus, with the simulated leg on their shafts."""
    SIM = "sim"
    """MuJoCo behind the limits."""
    ANALYTIC = "analytic"
    """The paper's equations behind the limits."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Bench:
    """Emulated bench on which trials are made."""

    design: LegDesign
    bus_file: Path
    lean: float = 0.0
    """Angle of q1 and q2 by which the leg leans as it starts, so that it sways at once as others
    do after minutes of hopping [rad]."""

    @property
    def limits(self) -> SafetyLimits:
        """Limits beside the bus file, completed by the design's; a leg that leans may sway."""
        limits = limits_for(self.bus_file.parent / LIMITS_NAME, self.design)
        return replace(limits, sway=WIDEST_SWAY) if self.lean else limits

    def start(self, chosen: Experiment) -> Start:
        """Start posture of an experiment on this bench."""
        start = start_of(chosen)
        return Start(joint_pos=start.joint_pos + self.lean, motor_pos=start.motor_pos + self.lean)


@dataclass(frozen=True, slots=True, kw_only=True)
class Death:
    """Death of a part in mid-run."""

    part: Part
    drive: int
    """0 or 1."""
    onset: float
    """Time since the beginning of the run [s]."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Stage:
    """Leg that is ready to run, and whose part may die."""

    plant: AbstractPlant
    controller: AbstractController
    kill: Callable[[], None] = lambda: None
    """Function that lets the part die."""
    contradiction: Callable[[], float] = lambda: 0.0
    """Function that returns how far the dead part is from what a healthy one would show [rad]."""


@contextmanager
def staged(
    bench: Bench, emulation: Emulation, controller: str, servo: ServoConfig, death: Death | None
) -> Iterator[Stage]:
    """Open the stage of a trial; none dies of a healthy leg."""
    config = CONTROLLERS[controller]
    chosen = Experiment(
        design=bench.design, controller=config, setup=Setup(kind=config.usual_setup)
    )
    stage = (_on_bus if emulation is Emulation.CAN else _alone)(
        bench, emulation, chosen, servo, death
    )
    with stage.plant:
        yield stage


def _alone(
    bench: Bench,
    emulation: Emulation,
    chosen: Experiment,
    servo: ServoConfig,
    death: Death | None,
) -> Stage:
    start = bench.start(chosen)
    if emulation is Emulation.SIM:
        plant: AbstractPlant = SimPlant(bench.design, chosen.options, start, servo)
    else:
        plant = AnalyticPlant(bench.design, chosen.setup, start, servo)
    broken = None
    if death is not None:
        stiffness = np.asarray(bench.design.stiffness)
        plant = broken = BrokenPlant(plant, stiffness, death.part, death.drive)
    leg = Leg(design=bench.design, options=chosen.options, start=start, servo=servo)
    limited = open_limited(plant, bench.limits, leg).plant
    controller = make_controller(chosen.controller, targets_of(chosen))
    if broken is None:
        return Stage(plant=limited, controller=controller)
    return Stage(
        plant=limited,
        controller=controller,
        kill=broken.break_part,
        contradiction=lambda: broken.contradiction,
    )


class _WatchedLeg:
    """Simulated leg on the shafts, which remembers where its links truly are."""

    def __init__(self, leg: EmulatedLeg) -> None:
        self._leg = leg
        self.links: Sequence[float] = (0.0, 0.0)

    def __call__(
        self, motor_positions: tuple[float, ...]
    ) -> tuple[Sequence[float], Sequence[float]]:
        self.links, torques = self._leg(motor_positions)
        return self.links, torques


def _on_bus(
    bench: Bench,
    emulation: Emulation,
    chosen: Experiment,
    servo: ServoConfig,
    death: Death | None,
) -> Stage:
    config, start = _with_encoders(load_bus(bench.bus_file), servo), bench.start(chosen)
    watched = _WatchedLeg(EmulatedLeg(bench.design, chosen.options, start))
    behaviours = [
        Behaviour(start_pos=float(value), bandwidth=servo.bandwidth) for value in start.motor_pos
    ]
    network = emulate(config, behaviours, body=watched, body_period_ns=LEG_PERIOD_NS)
    session = Session(LockstepBus("leg", network=network), config)
    link = session.link(
        bench.limits,
        bench.design.stiffness,
        momentum=momentum_on(config, bench.design, chosen.setup, PERFECT),
    )
    plant = CanPlant(session, link, start)
    controller = make_controller(chosen.controller, targets_of(chosen))

    def kill() -> None:
        if death is not None:
            network.inject(_fault(config, network, death))

    def contradiction() -> float:
        sample = plant.sample
        if death is None or sample is None:
            return 0.0
        motion = network.drives[death.drive].axis.motion
        if death.part is Part.JAMMED:
            scale = abs(config.nodes[death.drive].motor.counts_per_rad)
            return abs(motion.demand - motion.actual) / scale
        return max(
            abs(sample.motor_pos[death.drive] - motion.angle),
            abs(sample.link_pos[death.drive] - watched.links[death.drive]),
        )

    return Stage(plant=plant, controller=controller, kill=kill, contradiction=contradiction)


def _fault(config: BusConfig, network: Network, death: Death) -> NodeFault:
    return NodeFault(
        kind=NodeFaultKind[death.part.name],
        node_id=config.nodes[death.drive].node_id,
        start_ns=network.now_ns,
        size=death.part.size,
    )


def _with_encoders(config: BusConfig, servo: ServoConfig) -> BusConfig:
    """Give both encoders of every drive the counts of a servo, if it has any.

    The bench's motor encoders sit before the gear; the counts of a servo are those of the axis.
    """
    counts = servo.encoder_counts
    if counts is None:
        return config
    nodes = tuple(
        replace(
            node,
            motor=replace(node.motor, counts_per_rev=counts, gear=1.0),
            link=node.link and replace(node.link, counts_per_rev=min(counts, 1 << 16)),
            parameters=(),
        )
        for node in config.nodes
    )
    return replace(config, nodes=nodes)
