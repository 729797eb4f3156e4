"""Motions of a leg on emulated drives, recorded cycle by cycle, that a peer of a bus can replay.

A link that is brought up on the same emulated drives and then sees these answers, and sends these
commands, is in every cycle where it was when they were recorded: its watches and limits work as
they did then.
"""

import struct
from collections.abc import Callable
from contextlib import closing
from dataclasses import dataclass, replace
from enum import StrEnum
from pathlib import Path
from typing import final

import can

from legbench.control import JumpConfig
from legbench.design import load_design
from legbench.drives.emulated.behaviour import Behaviour
from legbench.drives.emulated.build import emulate
from legbench.drives.emulated.bus import LockstepBus
from legbench.drives.master.link import Link
from legbench.drives.master.session import Session
from legbench.drives.setup.bus_file import load_bus, load_limits
from legbench.drives.setup.config import BusConfig
from legbench.experiment import Experiment, make_controller, start_of, targets_of
from legbench.imperfections import Imperfections
from legbench.limits.safety import SafetyLimits
from legbench.plant.can import CanPlant
from legbench.plant.emulated_leg import EmulatedLeg
from legbench.plant.leg_momentum import momentum_on
from legbench.signals import Command, Observation

ROOT = Path(__file__).parents[1]
SYNC, ANSWERS = 0x080, (0x181, 0x182)
ANSWER = struct.Struct("<Hih")
"""Statusword, motor and link counts."""
EXPERIMENT = Experiment(
    design=load_design(ROOT / "models" / "optimal.toml"), controller=JumpConfig()
)
START = start_of(EXPERIMENT)
SWAYING = Imperfections(stiffness_error=(0.04, -0.04))
"""Springs that differ from the design by so much that a hop sways by 0.2 rad within a second."""


@final
class Kind(StrEnum):
    """What a leg does while it is recorded."""

    REST = "at rest"
    JUMP = "in a jump"
    SWAY = "in a jump that sways"


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class Motion:
    """What drives answered and were told, a row a cycle."""

    answers: tuple[tuple[bytes, ...], ...]
    """Process data of both drives."""
    commands: tuple[tuple[float, ...], ...]
    """Motor positions that were commanded before these answers [rad]."""


def bench_config() -> BusConfig:
    """The bus file of the project, for a time base that runs ahead of a peer's heartbeats."""
    config = load_bus(ROOT / "hardware" / "leg.toml")
    return replace(config, heartbeat_ms=1000, waive=("drive heartbeat",))


def bench_limits() -> SafetyLimits:
    """The limits of the project; a machine that is busy elsewhere is not the link's fault."""
    limits = load_limits(ROOT / "hardware" / "limits.toml")
    return replace(limits, lost_frames=1000, waive=("lost_frames",))


def emulated_bus(config: BusConfig, kind: Kind) -> LockstepBus:
    """A bus of emulated drives with the leg of the experiment on their shafts."""
    imperfections = SWAYING if kind is Kind.SWAY else EXPERIMENT.imperfections
    body = EmulatedLeg(EXPERIMENT.design, EXPERIMENT.options, START, imperfections)
    behaviours = [Behaviour(start_pos=float(pos)) for pos in START.motor_pos]
    return LockstepBus("bench", network=emulate(config, behaviours, body=body))


def open_link(session: Session) -> tuple[CanPlant, Link]:
    """The plant of a run with this session and its link, watched as in a run."""
    design, options = EXPERIMENT.design, EXPERIMENT.options
    momentum = momentum_on(session.config, design, options.setup, EXPERIMENT.imperfections)
    link = session.link(bench_limits(), design.stiffness, momentum=momentum)
    return CanPlant(session, link, START), link


def leader(kind: Kind, seen: Observation) -> Callable[[Observation], Command]:
    """What leads a leg that is seen in its start posture: the controller, or nothing at rest."""
    if kind is Kind.REST:
        rest = Command.holding(START.motor_pos)
        return lambda _seen: rest
    controller = make_controller(EXPERIMENT.controller, targets_of(EXPERIMENT))
    controller.reset(seen)
    return controller.step


def record_motion(config: BusConfig, cycles: int, kind: Kind) -> Motion:
    """Record so many cycles of what a leg does from its start posture on."""
    bus = emulated_bus(config, kind)
    shown: dict[int, bytes] = {}

    def listen(message: can.Message) -> None:
        if message.arbitration_id in ANSWERS:
            shown[message.arbitration_id] = bytes(message.data)

    answers: list[tuple[bytes, ...]] = []
    commands: list[tuple[float, ...]] = []
    plant, link = open_link(Session(bus, config, bus.timebase))
    with closing(plant):
        seen = plant.reset()
        step = leader(kind, seen)
        link.show_frames_to(listen)
        for _ in range(cycles):
            command = step(seen)
            seen = plant.step(command)
            commands.append(tuple(command.motor_pos.tolist()))
            answers.append(tuple(shown[cob_id] for cob_id in ANSWERS))
    return Motion(answers=tuple(answers), commands=tuple(commands))
