"""Trials of dead motors and encoders: how soon the limits find them, and that healthy ones pass."""

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
from legbench.errors import PlantFault
from legbench.experiment import (
    ControllerSettings,
    Experiment,
    make_controller,
    start_of,
    targets_of,
)
from legbench.limits.safety import SafetyLimits
from legbench.plant.abstract import AbstractPlant
from legbench.plant.analytic import AnalyticPlant
from legbench.plant.can import CanPlant
from legbench.plant.emulated_leg import EmulatedLeg
from legbench.plant.limited import LimitedPlant
from legbench.plant.sim import SimPlant
from legbench.plants import LIMITS_NAME, limits_for
from legbench.servo import ServoConfig

EXCITATION = 0.03
"""Smallest difference from a healthy part at which a dead one counts as contradicted [rad]."""
BOUND, DRIFT_BOUND = 0.05, 0.15
"""Longest times from the contradiction to the end of the run, and for a drift [s]."""
PATIENCE = 1.5
"""Time after which a dead part that has not been found counts as missed [s]."""
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

    @property
    def limits(self) -> SafetyLimits:
        """Limits beside the bus file, completed by the design's."""
        return limits_for(self.bus_file.parent / LIMITS_NAME, self.design)


@dataclass(frozen=True, slots=True, kw_only=True)
class Death:
    """Death of a part in mid-run."""

    part: Part
    drive: int
    """0 or 1."""
    onset: float
    """Time since the beginning of the run [s]."""


@dataclass(frozen=True, slots=True, kw_only=True)
class TrialOutcome:
    """What came of a run."""

    cause: str | None
    """Cause of the end of the run; None if nothing ended it."""
    time: float | None
    """Time from the contradiction to the end of the run, 0 if the end came before; None if nothing
    ended it [s]. Steps and drifts contradict a healthy leg from the moment on in which they
    begin, other parts once they differ from healthy ones by `EXCITATION`."""
    since_death: float | None
    """Time since the part died [s]."""
    excited: bool
    """Whether the dead part ever contradicted a healthy one."""

    def within(self, part: Part) -> bool:
        """Whether the part was found in time; one that shows nothing wrong need not be found."""
        if self.time is None:
            return not self.excited
        return self.time <= (DRIFT_BOUND if part.drifts else BOUND)


@dataclass(slots=True)
class _Stage:
    plant: AbstractPlant
    controller: AbstractController
    kill: Callable[[], None]
    contradiction: Callable[[], float]


def try_dead_part(
    bench: Bench, emulation: Emulation, controller: str, death: Death, servo: ServoConfig
) -> TrialOutcome:
    """Run a controller, let a part die, and measure when the limits end the run.

    Raises:
        PlantFault: the run ended before the part died.
    """
    with _staged(bench, emulation, controller, servo, death) as stage:
        observation = stage.plant.reset()
        stage.controller.reset(observation)
        onset = round(death.onset / stage.plant.period)
        contradicted = onset if death.part.shows_at_once else None
        for cycle in range(onset + round(PATIENCE / stage.plant.period)):
            if cycle == onset:
                stage.kill()
            try:
                observation = stage.plant.step(stage.controller.step(observation))
            except PlantFault as error:
                if cycle < onset:
                    raise
                cycles = 0 if contradicted is None else cycle - contradicted
                return TrialOutcome(
                    cause=error.cause,
                    time=cycles * stage.plant.period,
                    since_death=(cycle - onset) * stage.plant.period,
                    excited=contradicted is not None,
                )
            if contradicted is None and cycle >= onset and stage.contradiction() > EXCITATION:
                contradicted = cycle
    return TrialOutcome(cause=None, time=None, since_death=None, excited=contradicted is not None)


def watch_healthy(
    bench: Bench, emulation: Emulation, controller: str, servo: ServoConfig, seconds: float
) -> str | None:
    """Run a controller on a healthy leg; return what ended the run early, or None."""
    with _staged(bench, emulation, controller, servo, None) as stage:
        observation = stage.plant.reset()
        stage.controller.reset(observation)
        for _ in range(round(seconds / stage.plant.period)):
            try:
                observation = stage.plant.step(stage.controller.step(observation))
            except PlantFault as error:
                return f"{error.cause} at {observation.time:.3f} s: {error}"
    return None


@contextmanager
def _staged(
    bench: Bench, emulation: Emulation, controller: str, servo: ServoConfig, death: Death | None
) -> Iterator[_Stage]:
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
) -> _Stage:
    start = start_of(chosen)
    if emulation is Emulation.SIM:
        plant: AbstractPlant = SimPlant(bench.design, chosen.options, start, servo)
    else:
        plant = AnalyticPlant(bench.design, chosen.setup, start, servo)
    controller = make_controller(chosen.controller, targets_of(chosen))
    delay = servo.delay_cycles
    if death is None:
        limited = LimitedPlant(plant, bench.limits, delay_cycles=delay)
        return _Stage(limited, controller, lambda: None, lambda: 0.0)
    broken = BrokenPlant(plant, np.asarray(bench.design.stiffness), death.part, death.drive)
    limited = LimitedPlant(broken, bench.limits, delay_cycles=delay)
    return _Stage(limited, controller, broken.break_part, lambda: broken.contradiction)


class _RunObserver:
    """The leg on the shafts, which remembers where its links truly are."""

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
) -> _Stage:
    config, start = _with_encoders(load_bus(bench.bus_file), servo), start_of(chosen)
    witness = _RunObserver(EmulatedLeg(bench.design, chosen.options, start))
    behaviours = [
        Behaviour(start_pos=float(value), bandwidth=servo.bandwidth) for value in start.motor_pos
    ]
    network = emulate(config, behaviours, body=witness)
    session = Session(LockstepBus("leg", network=network), config)
    plant = CanPlant(session, session.link(bench.limits, bench.design.stiffness), start)
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
            abs(sample.link_pos[death.drive] - witness.links[death.drive]),
        )

    return _Stage(plant, controller, kill, contradiction)


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
