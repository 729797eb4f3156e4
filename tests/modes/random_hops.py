"""Random disturbed hops of random legs, told by the compiled leg."""

import math
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path

import numpy as np
from dense_hop import Story

from legbench.analytic import LegModel, Regime
from legbench.analytic.course import Course
from legbench.analytic.taylor import TaylorLeg, Watched
from legbench.control import JumpConfig
from legbench.design import LegDesign, Limits, Segment, load_design
from legbench.errors import LegbenchError, PlantFault
from legbench.modes.drive import JumpLaw
from legbench.modes.hop import CALLS, FALLEN, HORIZON, Apex, return_map
from legbench.signals import Floats

MODELS = Path(__file__).parents[2] / "models"
NAMES = ("prototype", "optimal", "table2")
WILD = (0.0, 1.0, 1.0, 3.0, 6.0)
"""Factors on lean, speed and rates of a start; each is as likely [-]."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Case:
    """A leg, its controller, and where it starts."""

    design: LegDesign
    config: JumpConfig
    start: Apex

    @property
    def vector(self) -> Floats:
        """The start as an array (6,)."""
        return self.start.vector()


@cache
def _model_leg(name: str) -> LegDesign:
    return load_design(MODELS / f"{name}.toml")


def random_leg(random: np.random.Generator) -> LegDesign:
    """A leg with other lengths, masses, springs, dampers and limits than a model, or the model."""
    base = _model_leg(NAMES[random.integers(len(NAMES))])
    if random.uniform() < 0.1:
        return base
    reach = float(random.uniform(0.85, 1.2)) * base.shank.length
    thigh = float(random.uniform(0.35, 0.65)) * reach

    def scaled(segment: Segment, length: float) -> Segment:
        mass, inertia = (float(x) for x in random.uniform(0.7, 1.4, 2))
        com = min(float(random.uniform(0.5, 2.0)) * segment.com / segment.length, 0.7)
        return Segment(
            mass=mass * segment.mass,
            length=length,
            com=com * length,
            inertia=mass * inertia * segment.inertia * (length / segment.length) ** 2,
        )

    k1, k2, d1, d2 = (float(x) for x in random.uniform(0.8, 1.25, 4))
    more = float(random.uniform(0.0, 2.0))
    low, high, back, front = (float(x) for x in random.uniform(0.0, 1.0, 4))
    return replace(
        base,
        trunk_mass=float(random.uniform(0.8, 1.25)) * base.trunk_mass,
        thigh=scaled(base.thigh, thigh),
        shank=scaled(base.shank, reach),
        foot=scaled(base.foot, reach - thigh),
        stiffness=(k1 * base.stiffness[0], k2 * base.stiffness[1]),
        damping=(d1 * more * base.damping[0], d2 * more * base.damping[1]),
        limits=Limits(hip=(-1.3 - back, 0.2 + front), knee=(0.15 + 0.3 * low, 2.4 + 0.5 * high)),
    )


def random_jump(random: np.random.Generator) -> JumpConfig:
    """Settings of the jump controller, its thresholds and times included."""
    dz2 = float(random.uniform(0.06, 0.2))
    return JumpConfig(
        z2=float(random.uniform(0.3, 0.8)) + dz2,
        dz2=dz2,
        touchdown_load=float(random.uniform(0.5, 0.9)),
        release_load=float(random.uniform(0.05, 0.4)),
        apex_turn=float(random.uniform(0.003, 0.03)),
        release_time=float(random.uniform(0.01, 0.06)),
        touchdown_time=float(random.uniform(0.02, 0.06)),
    )


def random_case(random: np.random.Generator) -> Case:
    """A random leg with random settings, thrown into the air."""
    design, config = random_leg(random), random_jump(random)
    resting = Apex(height=0.0, speed=0.0, z1=0.0, z2=0.0, dz1=0.0, dz2=0.0)
    return thrown(Case(design=design, config=config, start=resting), random)


def thrown(case: Case, random: np.random.Generator) -> Case:
    """A leg and its controller thrown into the air anew, every other time wildly."""
    config, wild = case.config, float(random.choice(WILD))
    z2 = config.z2 + config.dz2 + float(random.normal(0.0, 0.1))
    q = (-z2 * math.sqrt(0.5), z2 * math.sqrt(0.5))
    model = LegModel.of(case.design)
    standing = model.mass_centre_from_hip(q)[1] - model.foot_from_hip(q)[1]
    speed, z1, dz1, dz2_rate = (wild * float(x) for x in random.normal(0.0, (0.15, 0.08, 1.0, 1.5)))
    drop = 0.01 + float(random.exponential(0.06))
    start = Apex(height=standing + drop, speed=speed, z1=z1, z2=z2, dz1=dz1, dz2=dz2_rate)
    return replace(case, start=start)


def told_by_compiled(leg: TaylorLeg, law: JumpLaw, start: Apex) -> Story:
    """The hop's events in order, and the state at its end, from the compiled leg."""
    story, course = Story(), leg.course
    law.restart()
    course.fly(*start.angles(), (0.0, start.height), (start.speed, 0.0), 2.0 * FALLEN)
    try:
        while len(story.events) <= CALLS and not story.ending:
            _tell_next(story, course, law)
    except PlantFault:
        story.ending = ""
    (_, height), (speed, _) = course.centre() if course.compiled.flies else ((0.0, 0.0),) * 2
    story.apex = tuple(Apex.at(height, speed, course.q, course.v).vector().tolist())
    story.ending = story.ending or "fault"
    return story


def _tell_next(story: Story, course: Course, law: JumpLaw) -> None:
    """Go on to what happens next, and add it to the story."""
    flies, phase = course.regime is Regime.FLIGHT, law.phase.name.lower()
    until, reach = min(HORIZON, law.alarm), math.inf
    if flies and any(name == "liftoff" for name, _ in story.events):
        reach = course.apex_time()
        until = min(until, reach) if reach >= course.time else until
    course.hold(law.motor)
    what = course.go(until, law.levels)
    value = law.probe[0] * course.q[0] + law.probe[1] * course.q[1]
    lapsed = ("waited" if phase == "release" else "touched", law.lapse)
    if course.time >= law.lapse and lapsed not in story.events:
        story.events.append(lapsed)  # the law passes over it in silence
    if what is Watched.CONTACT:
        story.events.append(("touchdown" if flies else "liftoff", course.time))
        course.switch()
        law.stands = flies
    elif what is Watched.FELL:
        story.ending = "fell"
    elif what is Watched.TURN:
        law.on_event(what, value, course.time)
    elif what is not None:
        told = {Watched.RISE: "loaded", Watched.FALL: "unloaded"}[what]
        if phase == "compress" or (phase == "push" and what is Watched.RISE):
            told = "turned"
        elif phase == "push":
            told = "released"
        law.on_event(what, value, course.time)
        if phase == "release" and law.phase.name == "RELEASE":
            return  # a load that comes too early
        story.events.append((told, course.time))
        if phase == "compress" and law.phase.name == "RELEASE":  # the push begins unloaded
            story.events.append(("released", course.time))
    elif course.time >= law.alarm:
        story.events.append(("touched" if phase == "flight" else "waited", course.time))
        law.on_alarm(value, course.time)
        if phase == "release" and law.alarm < math.inf:  # loaded already when it begins to fly
            story.events.append(("loaded", course.time))
    elif until == reach:
        story.ending = "apex" if law.settled(course.time) else "fault"
    elif course.time >= HORIZON:
        story.ending = "stands"


Tools = tuple[TaylorLeg, JumpLaw]
"""Compiled leg and its controller."""


def tools_of(case: Case, tolerance: float) -> Tools | None:
    """The compiled leg and its law; None where the controller refuses the leg."""
    try:
        law = JumpLaw(case.config, case.design)
    except LegbenchError:
        return None
    return TaylorLeg(LegModel.of(case.design), probe=law.probe, tolerance=tolerance), law


def told(tools: Tools | None, case: Case, *, mapped: bool = True) -> Story | None:
    """Story of the compiled leg; None if it cannot begin.

    If `mapped`, the return map has to end as the story does, to the bit.
    """
    if tools is None:
        return None
    leg, law = tools
    if case.start.height + leg.course.foot_height(case.start.angles()[0]) < 0.0:
        return None
    story = told_by_compiled(leg, law, case.start)
    if mapped:
        done = return_map(leg, law, case.start)
        after = story.apex if done.after is None else tuple(done.after.vector().tolist())
        if str(done.ending) != story.ending or after != story.apex:
            raise AssertionError(f"the map ends with {done}, its events with {story}")
    return story
