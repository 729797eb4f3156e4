"""No event of a hop is lost, doubled or invented, and no stop pulls."""

import math
from pathlib import Path

import numpy as np
import pytest

from legbench.analytic import LegModel
from legbench.control import JumpConfig
from legbench.design import LegDesign, load_design

pytest.importorskip("heyoka")

from brute_basins import differing, random_task
from random_hops import random_case, thrown, told, tools_of
from reference.verdicts import judge

from legbench.analytic.course import Course
from legbench.analytic.parameters import PUSHES, Event
from legbench.analytic.taylor import MAP_TOLERANCE, Levels, TaylorLeg, Watched
from legbench.modes.drive import JumpLaw, Passive
from legbench.modes.hop import FALLEN, Apex, Ending, return_map, settle

MODELS = Path(__file__).parents[2] / "models"
PROBE = (-math.sqrt(0.5), math.sqrt(0.5))


def design_of(name: str) -> LegDesign:
    return load_design(MODELS / f"{name}.toml")


@pytest.mark.parametrize(
    ("name", "z2", "dz2", "apex"),
    [
        ("optimal", 0.65, 0.1, 0.30088),
        ("optimal", 0.8, 0.2, 0.43182),
        ("table2", 0.55, 0.1, 0.29171),
        ("table2", 0.8, 0.2, 0.43138),
    ],
)
@pytest.mark.parametrize("tolerance", [1e-15, MAP_TOLERANCE])
def test_legs_settle_that_cross_a_level_up_and_down_in_one_step(
    name: str, z2: float, dz2: float, apex: float, tolerance: float
) -> None:
    design = design_of(name)
    law = JumpLaw(JumpConfig(z2=z2, dz2=dz2), design)
    leg = TaylorLeg(LegModel.of(design), probe=law.probe, tolerance=tolerance)
    half = (z2 + dz2) * math.sqrt(0.5)
    q = (-half, half)
    standing = leg.model.mass_centre_from_hip(q)[1] - leg.model.foot_from_hip(q)[1]
    start = Apex(height=standing + 0.03, speed=0.0, z1=0.0, z2=z2 + dz2, dz1=0.0, dz2=0.0)
    apexes = settle(leg, law, start, 80)
    assert len(apexes) == 81
    assert abs(apexes[-1].height - apex) < 1e-5


def test_random_hops_are_told_as_the_reference_tells_them() -> None:
    cases = [random_case(np.random.default_rng(seed)) for seed in range(50)]
    stories = [told(tools_of(case, MAP_TOLERANCE), case) for case in cases]
    begun = [(case, story) for case, story in zip(cases, stories, strict=True) if story]
    assert len(begun) > 45
    verdicts = judge(*zip(*begun, strict=True))
    for verdict in verdicts:
        assert verdict.grazes or (not verdict.fault and verdict.error < 1e-5), verdict
    assert np.median([verdict.error for verdict in verdicts]) < 1e-7


@pytest.mark.parametrize("tolerance", [1e-15, MAP_TOLERANCE])
def test_a_foot_that_lands_at_micrometres_a_second_lands_at_height_zero(tolerance: float) -> None:
    # It lifts off at 0.48848 s and lands 0.6 ms later at 1.7 um/s: 0.1 pm of height are 60 ns.
    case = thrown(random_case(np.random.default_rng(220)), np.random.default_rng((1, 220)))
    story = told(tools_of(case, tolerance), case)
    assert story
    (verdict,) = judge([case], [story])
    assert not verdict.fault
    assert verdict.error < 1e-6


def swinging() -> Course:
    """A leg that is thrown against its knee stop and comes back, time and again."""
    course = Course(LegModel.of(design_of("prototype"), undamped=True), probe=PROBE)
    course.fly((-0.4, 0.4), (9.0, -7.0), (0.0, 3.0), (0.0, 0.0))
    course.hold((-0.36, 0.36))
    return course


@pytest.mark.parametrize("tolerance", [1e-15, MAP_TOLERANCE])
def test_a_stop_never_pulls(tolerance: float) -> None:
    random, pushed = np.random.default_rng(41), 0
    model = LegModel.of(design_of("prototype"))
    for _ in range(40):
        course = Course(model, tolerance=tolerance)
        half = float(random.uniform(0.18, 0.5))
        v1, v2 = (float(x) for x in random.uniform(-15.0, 15.0, 2))
        course.fly((-half, half), (v1, v2), (0.0, 5.0), (0.0, 0.0))
        motor = float(random.uniform(0.05, 0.4))
        course.hold((-motor, motor))
        for tick in range(1, 401):
            course.go(5e-4 * tick)
            for joint in (0, 1):
                if course.compiled.pars[PUSHES + 2 * joint] == 0.0:
                    continue
                pushed += 1
                torque = model.torque(course.motor, course.q, course.v)
                turns, _ = course.stop_switches.turns(
                    model.ops, model.falling, torque, course.q, course.v
                )
                assert turns[joint] > -1e-9
    assert pushed > 100


def test_a_level_is_crossed_as_often_as_the_probe_crosses_it() -> None:
    course, level = swinging(), 0.5
    crossings, wanted = [], Levels(lower=level)
    while course.time < 0.5:
        what = course.go(0.5, wanted)
        if what is None:
            break
        crossings.append(what)
        wanted = Levels(lower=level) if what is Watched.RISE else Levels(upper=level)
    other, values = swinging(), []
    for tick in range(20_001):
        other.go(2.5e-5 * tick)
        values.append(PROBE[0] * other.q[0] + PROBE[1] * other.q[1] - level)
    signs = np.sign(values)
    assert len(crossings) == np.count_nonzero(signs[1:] != signs[:-1]) >= 10
    assert crossings[::2] == [crossings[0]] * len(crossings[::2])


def test_a_condition_that_holds_already_is_an_event_at_once() -> None:
    course = swinging()
    assert course.go(0.1, Levels(upper=0.2)) is Watched.RISE
    assert course.time == 0.0
    assert course.go(0.1, Levels(lower=0.9)) is Watched.FALL
    assert course.time == 0.0


def test_an_impact_that_turns_the_probe_is_a_turning_point() -> None:
    model, random = LegModel.of(design_of("optimal")), np.random.default_rng(5)
    course, turns, wanted = Course(model, probe=PROBE), [0, 0], Levels(turns=True)

    def rate() -> float:
        return PROBE[0] * course.v[0] + PROBE[1] * course.v[1]

    for _ in range(40):
        q = (-0.5, float(random.uniform(0.4, 0.6)))
        v1, v2 = (float(x) for x in random.normal(0.0, 4.0, 2))
        height = 0.004 - model.foot_from_hip(q)[1] + model.mass_centre_from_hip(q)[1]
        course.fly(q, (v1, v2), (0.0, height), (0.2, -0.8))
        course.hold((-0.5, 0.5))
        while course.go(0.2, wanted) is not Watched.CONTACT:
            pass
        touchdown, before = course.time, rate()
        course.switch()
        turned = before * rate() < 0.0
        turns[turned] += 1
        assert (course.go(0.2, wanted) is Watched.TURN and course.time == touchdown) == turned
    assert min(turns) >= 5


def test_a_load_counts_only_after_the_release_and_only_if_it_lasts() -> None:
    config = JumpConfig()
    law = JumpLaw(config, design_of("prototype"))
    level = law.levels.upper

    def released() -> float:
        law.restart()
        law.stands = True
        law.on_event(Watched.RISE, level, 0.1)
        assert law.phase.name == "FLIGHT"
        assert law.lapse == 0.1 + config.touchdown_time
        law.on_event(Watched.TURN, level + 0.1, law.lapse)
        assert law.phase.name == "COMPRESS"
        assert law.levels.lower == level + 0.1 - config.apex_turn
        law.on_event(Watched.FALL, law.levels.lower, 0.2)
        assert law.phase.name == "PUSH"
        law.on_event(Watched.FALL, law.levels.lower, 0.3)
        assert law.phase.name == "RELEASE"
        assert law.settled(10.0)
        return law.lapse

    over = released()
    assert over == 0.3 + config.release_time
    assert law.alarm == math.inf
    law.on_event(Watched.RISE, level, over - 1e-3)  # too early: asked again when it is over
    assert law.alarm == over
    assert law.levels.upper > level
    law.on_alarm(level + 0.01, over)
    assert law.phase.name == "FLIGHT"
    assert law.alarm == over + config.touchdown_time
    law.on_alarm(level + 0.02, law.alarm)
    assert law.phase.name == "COMPRESS"
    over = released()
    law.on_event(Watched.RISE, level, over + 1e-3)
    assert law.settled(over + 1e-3)
    assert not law.settled(law.lapse)
    early = law.lapse - 1e-3
    law.on_event(Watched.TURN, level + 0.1, early)  # the load may fall before it has lasted
    assert law.phase.name == "FLIGHT"
    assert law.alarm == early + 1e-3
    law.on_event(Watched.FALL, level, early + 5e-4)
    assert law.alarm == law.lapse == math.inf
    assert law.levels.upper == level


def test_a_leg_that_swings_over_between_two_events_has_fallen() -> None:
    design = design_of("optimal")
    held = Passive((-0.5, 0.5))
    leg = TaylorLeg(LegModel.of(design, stops=False, undamped=True), probe=held.probe)
    height = 3.0 - leg.model.foot_from_hip(held.motor)[1]
    start = Apex(height=height, speed=0.0, z1=0.0, z2=0.7, dz1=30.0, dz2=0.0)
    done = return_map(leg, held, start)
    assert done.ending is Ending.FELL
    course = leg.course
    assert abs(abs(course.q[0] + course.q[1]) - 2.0 * FALLEN) < 1e-12
    assert done.duration == course.time


def test_every_reading_has_its_place() -> None:
    assert [int(event) for event in Event] == list(range(len(Event)))


@pytest.mark.long
@pytest.mark.parametrize(("name", "seed"), [("prototype", 3), ("optimal", 4)])
def test_cells_of_a_basin_are_those_of_brute_force(name: str, seed: int) -> None:
    task = random_task(design_of(name), seed, 6)
    wrong, _ = differing(task, 3, seed)
    assert wrong == []
