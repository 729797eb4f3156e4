"""Every plant that the contract suite runs on, and the legs that stand in them.

A new plant joins by one entry in `PLANTS`.
"""

from collections.abc import Callable
from dataclasses import dataclass, fields, is_dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from legbench.control import Jump, JumpConfig, LegTargets
from legbench.design import LegDesign, load_design
from legbench.design.setup import Setup, SetupKind
from legbench.drives.emulated.behaviour import Behaviour
from legbench.drives.emulated.build import emulate
from legbench.drives.emulated.bus import LockstepBus
from legbench.drives.master.session import Session
from legbench.drives.setup.bus_file import load_bus
from legbench.limits.safety import SafetyLimits
from legbench.mjcf import BuildOptions, Linkage, LinkageKind
from legbench.plant.abstract import AbstractPlant
from legbench.plant.analytic import AnalyticPlant
from legbench.plant.batch import BatchPlant
from legbench.plant.can import CanPlant
from legbench.plant.emulated_leg import EmulatedLeg
from legbench.plant.limited import LimitedPlant
from legbench.plant.sim import SimPlant
from legbench.plant.start import Start
from legbench.servo import ServoConfig
from legbench.signals import Command, Floats, Observation

MODELS = Path(__file__).parents[2] / "models"
PROTOTYPE = load_design(MODELS / "prototype.toml")
OPTIMAL = load_design(MODELS / "optimal.toml")
JUMP = Setup(kind=SetupKind.JUMP)
Z2 = 0.9


def built(setup: Setup = JUMP, linkage: LinkageKind = LinkageKind.BARS) -> BuildOptions:
    return BuildOptions(setup=setup, linkage=Linkage(kind=linkage))


def standing(designs: LegDesign | list[LegDesign], setup: Setup = JUMP, z2: float = Z2) -> Start:
    """At rest under gravity, at the set point z2 [rad]."""
    targets = LegTargets(designs=designs, support=setup.support)
    motor_pos = targets.motor_at(z2, "z2")
    return Start(joint_pos=targets.link_at_rest(motor_pos), motor_pos=motor_pos)


def family(count: int, design: LegDesign = PROTOTYPE) -> list[LegDesign]:
    """Legs that all differ: in springs, damping, masses and lengths."""
    rng = np.random.default_rng(20)
    legs = []
    for index in range(count):
        one, two, three, four, five = rng.uniform(0.93, 1.07, 5)
        thigh = replace(design.thigh, length=design.thigh.length * one)
        foot = replace(design.foot, mass=design.foot.mass * two)
        shank = replace(design.shank, length=thigh.length + foot.length)
        legs.append(
            replace(
                design,
                name=f"leg {index}",
                thigh=thigh,
                shank=shank,
                foot=foot,
                trunk_mass=design.trunk_mass * three,
                stiffness=(design.stiffness[0] * four, design.stiffness[1] * four),
                damping=(design.damping[0] * five, design.damping[1]),
            )
        )
    return legs


@dataclass(frozen=True, kw_only=True)
class Case:
    """A plant to build, and what the suite has to know of it."""

    make: Callable[[ServoConfig], AbstractPlant]
    stiffness: Floats
    """Of its springs (..., 2) [N m/rad]."""
    computed: bool = True
    """Whether nothing happens between calls, so that a reset repeats a run bit by bit and the
    servo is a setting; drives go on by themselves, and the servo is theirs."""
    delay: int = 0
    """Cycles of its own between a command and the motors' first reaction."""
    resolution: float = 0.0
    """Angle that a count of its encoders stands for [rad]; 0: they resolve everything."""


def sim(setup: Setup, linkage: LinkageKind, design: LegDesign = PROTOTYPE) -> Case:
    def make(servo: ServoConfig) -> AbstractPlant:
        return SimPlant(design, built(setup, linkage), standing(design, setup), servo)

    return Case(make=make, stiffness=np.array(design.stiffness))


def rows(setup: Setup, linkage: LinkageKind, count: int) -> Case:
    designs = family(count)

    def make(servo: ServoConfig) -> AbstractPlant:
        start = standing(designs, setup)
        return BatchPlant(designs, built(setup, linkage), start, servo, threads=2)

    return Case(make=make, stiffness=np.array([design.stiffness for design in designs]))


def analytic(setup: Setup) -> Case:
    def make(servo: ServoConfig) -> AbstractPlant:
        return AnalyticPlant(PROTOTYPE, setup, standing(PROTOTYPE, setup), servo)

    return Case(make=make, stiffness=np.array(PROTOTYPE.stiffness))


def limited(inner: Case) -> Case:
    """Another plant behind limits that nothing reaches."""

    def make(servo: ServoConfig) -> AbstractPlant:
        limits = SafetyLimits()
        return LimitedPlant(inner.make(servo), limits, delay_cycles=servo.delay_cycles)

    return replace(inner, make=make)


def emulated(setup: Setup) -> Case:
    """The bench's bus, drives without limits of their own, motors that are where they are told."""
    bench = load_bus(MODELS.parent / "hardware" / "leg.toml")
    bus = replace(bench, nodes=tuple(replace(node, parameters=()) for node in bench.nodes))
    start = standing(PROTOTYPE, setup)

    def make(servo: ServoConfig) -> AbstractPlant:
        assert servo == ServoConfig(), "the servo is the drives' own"
        motors = [Behaviour.ideal(float(angle)) for angle in start.motor_pos]
        body = EmulatedLeg(PROTOTYPE, built(setup, LinkageKind.REDUCED), start)
        session = Session(LockstepBus("leg", network=emulate(bus, motors, body=body)), bus)
        return CanPlant(session, session.link(SafetyLimits(), PROTOTYPE.stiffness), start)

    return Case(
        make=make,
        stiffness=np.array(PROTOTYPE.stiffness),
        computed=False,
        delay=1,
        resolution=max(node.motor.resolution for node in bus.nodes),
    )


PLANTS: dict[str, Case] = {
    "sim jump bars": sim(JUMP, LinkageKind.BARS),
    "sim jump reduced": sim(JUMP, LinkageKind.REDUCED, OPTIMAL),
    "sim hfts": sim(Setup(kind=SetupKind.HFTS), LinkageKind.REDUCED),
    "sim vfts": sim(Setup(kind=SetupKind.VFTS), LinkageKind.BARS),
    "sim ffs": sim(Setup(kind=SetupKind.FFS), LinkageKind.BARS),
    "sim boom": sim(Setup(kind=SetupKind.FFS, boom_radius=1.0), LinkageKind.BARS),
    "batch jump bars": rows(JUMP, LinkageKind.BARS, 3),
    "batch hfts": rows(Setup(kind=SetupKind.HFTS), LinkageKind.REDUCED, 2),
    "analytic jump": analytic(JUMP),
    "analytic vfts": analytic(Setup(kind=SetupKind.VFTS)),
    "limited sim": limited(sim(JUMP, LinkageKind.BARS)),
    "limited analytic": limited(analytic(Setup(kind=SetupKind.FFS))),
    "emulated can": emulated(JUMP),
}


def hopping(designs: LegDesign | list[LegDesign], **settings: Any) -> tuple[Jump, Start]:
    """A jump controller that starts early, and where its legs stand."""
    targets = LegTargets(designs=designs, support=JUMP.support)
    controller = Jump(JumpConfig(delay=0.01, **settings), targets)
    motor_pos = controller.start_motor_pos
    return controller, Start(joint_pos=targets.link_at_rest(motor_pos), motor_pos=motor_pos)


def arrays(value: Any) -> dict[str, Any]:
    """Every leaf of an observation by its path; arrays are the observation's own."""
    found: dict[str, Any] = {}
    for field in fields(value):
        entry = getattr(value, field.name)
        if is_dataclass(entry):
            found |= {f"{field.name}.{name}": leaf for name, leaf in arrays(entry).items()}
        else:
            found[field.name] = entry
    return found


def copied(observation: Observation) -> dict[str, Any]:
    return {name: np.array(leaf) for name, leaf in arrays(observation).items()}


def same(first: dict[str, Any], second: dict[str, Any]) -> bool:
    """Whether two observations agree bit by bit."""
    return first.keys() == second.keys() and all(
        np.array_equal(first[name], second[name]) for name in first
    )


def wobble(rest: Floats, cycle: int) -> Command:
    """A command that never stays the same."""
    offset = 0.1 * np.sin(0.11 * cycle + np.arange(rest.size)).reshape(rest.shape)
    return Command.holding(rest + offset)
