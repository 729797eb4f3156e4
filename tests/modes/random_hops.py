"""Random disturbed hops of random legs, told by the compiled leg and by DOP853."""

import math
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from dense_hop import DenseHop, Story
from dense_rules import Rules

from legbench.analytic import LegModel, Regime
from legbench.analytic.taylor import TaylorLeg, Watched
from legbench.control import JumpConfig
from legbench.design import LegDesign, Segment, load_design
from legbench.errors import LegbenchError
from legbench.modes.drive import JumpLaw
from legbench.modes.fixed_point import UNITS
from legbench.modes.hop import FALLEN, HORIZON, Apex, return_map

MODELS = Path(__file__).parents[2] / "models"
NAMES = ("prototype", "optimal", "table2")
NEIGHBOUR = 1e-7
"""Size of the disturbances that tell a hop that grazes, in the map's units [-]."""
STEEP = 1e3
"""Growth of such a disturbance in one hop beyond which a condition has been grazed [-]."""
LOOKS_APART = (4e-3, 4e-4)
"""Longest steps of DOP853: what it tells on the first is told on the second if it differs [s]."""
SAME_TIME = 1e-6
"""Largest difference between two times of one event [s]."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Case:
    """A leg, its controller, and where it starts."""

    design: LegDesign
    config: JumpConfig
    start: Apex


@dataclass(frozen=True, slots=True, kw_only=True)
class Verdict:
    """How two stories of a hop compare."""

    same: bool
    """Whether the same happened in the same order at the same times, with the same ending."""
    error: float
    """Largest difference of the apexes, in the map's units; 0 if none was reached [-]."""
    grazes: bool
    """Whether DOP853 tells hops beside this one in another way, or far apart."""
    why: str
    """The two stories, where they differ."""


def random_case(random: np.random.Generator) -> Case:
    """A leg with other masses, springs, dampers and set points, thrown into the air."""
    base = load_design(MODELS / f"{NAMES[random.integers(len(NAMES))]}.toml")

    def scaled(segment: Segment) -> Segment:
        mass, inertia = (float(random.uniform(0.8, 1.25)) for _ in range(2))
        return replace(segment, mass=mass * segment.mass, inertia=mass * inertia * segment.inertia)

    k1, k2, d1, d2 = (float(x) for x in random.uniform(0.8, 1.25, 4))
    more = float(random.uniform(0.0, 2.0))
    design = replace(
        base,
        trunk_mass=float(random.uniform(0.8, 1.25)) * base.trunk_mass,
        thigh=scaled(base.thigh),
        shank=scaled(base.shank),
        foot=scaled(base.foot),
        stiffness=(k1 * base.stiffness[0], k2 * base.stiffness[1]),
        damping=(d1 * more * base.damping[0], d2 * more * base.damping[1]),
    )
    dz2 = float(random.uniform(0.06, 0.2))
    config = JumpConfig(z2=float(random.uniform(0.3, 0.8)) + dz2, dz2=dz2)
    z2 = config.z2 + config.dz2 + float(random.normal(0.0, 0.1))
    q = (-z2 * math.sqrt(0.5), z2 * math.sqrt(0.5))
    model = LegModel.of(design)
    standing = model.mass_centre_from_hip(q)[1] - model.foot_from_hip(q)[1]
    speed, z1, dz1, dz2_rate = (float(x) for x in random.normal(0.0, (0.15, 0.08, 1.0, 1.5)))
    drop = 0.01 + float(random.exponential(0.06))
    start = Apex(height=standing + drop, speed=speed, z1=z1, z2=z2, dz1=dz1, dz2=dz2_rate)
    return Case(design=design, config=config, start=start)


def told_by_compiled(leg: TaylorLeg, law: JumpLaw, start: Apex) -> Story:
    """The hop's events in order, from the compiled leg."""
    story, course, left = Story(), leg.course, False
    law.restart()
    course.fly(*start.angles(), (0.0, start.height), (start.speed, 0.0), 2.0 * FALLEN)
    names = {Watched.RISE: "loaded", Watched.FALL: "unloaded"}
    while course.time < HORIZON:
        flies, phase = course.regime is Regime.FLIGHT, law.phase.name.lower()
        until, reach = min(HORIZON, law.alarm), math.inf
        if flies and left:
            reach = course.apex_time()
            until = min(until, reach) if reach >= course.time else until
        course.hold(law.motor)
        what = course.go(until, law.levels())
        value = law.probe[0] * course.q[0] + law.probe[1] * course.q[1]
        if what is Watched.CONTACT:
            story.events.append(("touchdown" if flies else "liftoff", course.time))
            course.switch()
            left = left or not flies
        elif what is Watched.FELL:
            story.ending = "fell"
            return story
        elif what is Watched.TURN:
            law.on_event(what, value, course.time)
        elif what is not None:
            told = names[what]
            if phase == "compress" or (phase == "push" and what is Watched.RISE):
                told = "turned"
            elif phase == "push":
                told = "released"
            story.events.append((told, course.time))
            law.on_event(what, value, course.time)
        elif course.time >= law.alarm:
            story.events.append(("touched" if phase == "flight" else "waited", course.time))
            law.on_alarm(value, course.time)
            if phase == "release" and law.alarm < math.inf:  # loaded already when it begins to fly
                story.events.append(("loaded", course.time))
        elif until == reach:
            story.ending = "apex" if law.settled else "fault"
            (_, height), (speed, _) = course.centre()
            story.apex = tuple(Apex.at(height, speed, course.q, course.v).vector().tolist())
            return story
    story.ending = "stands"
    return story


def compare(case: Case, tolerance: float) -> Verdict | None:
    """Both stories of a hop; None where the case cannot begin."""
    try:
        law = JumpLaw(case.config, case.design)
        leg = TaylorLeg(LegModel.of(case.design), probe=law.probe, tolerance=tolerance)
        done = return_map(leg, law, case.start)
    except LegbenchError:
        return None
    story = told_by_compiled(leg, law, case.start)
    doubtful, wrong, error, other = True, False, 0.0, Story()
    for longest in LOOKS_APART:  # coarse looks may miss a turn that comes and goes between them
        other = _dense(case, leg.model, case.start, longest)
        wrong = str(done.ending) != story.ending or not _same(story, other)
        error = _apart(story, other)
        doubtful = wrong or error > 1e-6
        if not doubtful:
            break
    return Verdict(
        same=not wrong,
        error=error,
        grazes=doubtful and _grazes(case, leg.model, other),
        why=f"{story}\n{other}" if doubtful else "",
    )


def _same(one: Story, other: Story) -> bool:
    if one.ending != other.ending or len(one.events) != len(other.events):
        return False
    return all(
        first == second and abs(at - then) < SAME_TIME
        for (first, at), (second, then) in zip(one.events, other.events, strict=True)
    )


def _apart(one: Story, other: Story) -> float:
    if one.ending != "apex" or other.ending != "apex":
        return 0.0
    return float(np.max(np.abs(np.subtract(one.apex, other.apex)) / UNITS))


def _grazes(case: Case, model: LegModel, story: Story) -> bool:
    """Whether DOP853 tells hops beside this one in another way, or far apart."""
    names = [name for name, _ in story.events]
    for row in np.vstack([np.eye(6), -np.eye(6)]):
        start = Apex.of(case.start.vector() + NEIGHBOUR * row * UNITS)
        beside = _dense(case, model, start)
        if [name for name, _ in beside.events] != names or beside.ending != story.ending:
            return True
        if _apart(story, beside) > STEEP * NEIGHBOUR:
            return True
        for (_, at), (_, then) in zip(story.events, beside.events, strict=True):
            if abs(at - then) > STEEP * NEIGHBOUR:
                return True
    return False


def _dense(case: Case, model: LegModel, start: Apex, longest: float = 4e-4) -> Story:
    rules = Rules(case.config, case.design)
    return DenseHop(model, rules, longest).run(start.height, start.speed, *start.angles())
