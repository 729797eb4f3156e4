"""Every homing method of CiA 402-2 finds the place that the standard draws, wherever it starts.

The places are written down here from the standard's figures, as an edge of a switch and the side on
which the index pulse lies, and not taken from the moves of the emulated drive.
"""

import math

import pytest

from legbench.drives.emulated.behaviour import Behaviour
from legbench.drives.emulated.homing import START, Homing, HomingState
from legbench.drives.emulated.homing_methods import METHODS
from legbench.drives.emulated.motion import Motion
from legbench.drives.emulated.switches import LIMIT_SWITCH, Switches
from legbench.drives.protocol.objects import Key
from legbench.drives.setup.units import AxisUnits

STEP_NS = 1_000_000
FAST, SLOW = 5000, 500
UNITS = AxisUnits(counts_per_rev=1000, offset_counts=130)
PER_RAD = UNITS.counts_per_rad
STOPS, CAM = (-9.0, 8.0), (1.0, 2.5)
LOW, HIGH = (STOPS[0] + LIMIT_SWITCH, STOPS[1] - LIMIT_SWITCH)
TO_LOW, TO_HIGH = (-math.inf, CAM[1]), (CAM[0], math.inf)
"""Home switches that stay active to the end of the way, as methods 3 to 6 need them."""

# Method -> (home switch, edge [rad], side of the index pulse).
EDGES = {
    1: (CAM, LOW, 1),
    2: (CAM, HIGH, -1),
    3: (TO_HIGH, CAM[0], -1),
    4: (TO_HIGH, CAM[0], 1),
    5: (TO_LOW, CAM[1], 1),
    6: (TO_LOW, CAM[1], -1),
    7: (CAM, CAM[0], -1),
    8: (CAM, CAM[0], 1),
    9: (CAM, CAM[1], -1),
    10: (CAM, CAM[1], 1),
    11: (CAM, CAM[1], 1),
    12: (CAM, CAM[1], -1),
    13: (CAM, CAM[0], 1),
    14: (CAM, CAM[0], -1),
}


def at_index(edge: float, side: int) -> float:
    """Place of the index pulse next to an edge: counts 0, 1000, 2000, ... [rad]."""
    counts = 130 + edge * PER_RAD
    turns = math.ceil(counts / 1000) if side > 0 else math.floor(counts / 1000)
    return (1000 * turns - 130) / PER_RAD


def run(
    method: int, start: float, home: tuple[float, float], **speeds: int
) -> tuple[Homing, Motion]:
    """Home until the drive says how it has ended, a minute at most."""
    behaviour = Behaviour(start_pos=start, hard_stop=STOPS, home_switch=home)
    values: dict[Key, int] = {
        (0x6098, 0): method,
        (0x607C, 0): 4321,
        (0x6099, 1): speeds.get("fast", FAST),
        (0x6099, 2): speeds.get("slow", SLOW),
        (0x6080, 0): 0,
        (0x607E, 0): speeds.get("polarity", 0),
    }
    motion = Motion(UNITS, behaviour, values)
    homing = Homing(values, Switches(UNITS, behaviour))
    homing.command(START)
    for _ in range(60_000):
        if homing.state is not HomingState.SEARCHING:
            break
        homing.step(motion, STEP_NS)
        motion.drive(STEP_NS)
    return homing, motion


@pytest.mark.parametrize("start", [-8.97, -4.0, 1.0, 1.7, 2.5, 5.0, 7.97])
@pytest.mark.parametrize("method", [*EDGES, *(method + 16 for method in EDGES)])
def test_a_search_ends_at_the_place_of_the_standard(method: int, start: float) -> None:
    home, edge, side = EDGES[method if method <= 14 else method - 16]
    homing, motion = run(method, start, home)
    assert homing.state is HomingState.ATTAINED
    assert homing.done
    assert motion.actual == 4321
    if method <= 14:
        # The edge is seen a cycle late, at 0.5 counts a cycle; the index pulse is exact.
        assert motion.angle == pytest.approx(at_index(edge, side), abs=1e-5)
    else:
        assert motion.angle == pytest.approx(edge, abs=2 * SLOW * 1e-3 / PER_RAD)


MIRROR = {1: 2, 3: 5, 4: 6, 7: 11, 8: 12, 9: 13, 10: 14}
MIRROR |= {other: method for method, other in MIRROR.items()}


@pytest.mark.parametrize("method", EDGES)
def test_the_polarity_turns_a_search_round(method: int) -> None:
    home, edge, side = EDGES[MIRROR[method]]
    homing, motion = run(method, 0.5, home, polarity=0x80)
    assert homing.state is HomingState.ATTAINED
    assert motion.actual == -4321
    assert motion.angle == pytest.approx(at_index(edge, side), abs=1e-5)


@pytest.mark.parametrize(("method", "side"), [(33, -1), (34, 1)])
def test_a_search_for_the_index_pulse_alone(method: int, side: int) -> None:
    homing, motion = run(method, 0.5, CAM)
    assert homing.state is HomingState.ATTAINED
    assert motion.angle == pytest.approx(at_index(0.5, side), abs=1e-5)


@pytest.mark.parametrize("method", sorted(set(METHODS) - {35, 37}))
def test_a_search_without_speed_fails_and_moves_nothing(method: int) -> None:
    homing, motion = run(method, 0.5, CAM, fast=0, slow=0)
    assert homing.state is HomingState.FAILED
    assert not homing.done
    assert motion.angle == pytest.approx(0.5)


@pytest.mark.parametrize("method", [3, 4, 7, 10, 11, 14, 19, 30])
def test_a_search_for_a_home_switch_that_is_nowhere_fails_at_a_limit_switch(method: int) -> None:
    homing, motion = run(method, 0.5, (math.inf, math.inf))
    assert homing.state is HomingState.FAILED
    ends = (LOW, HIGH)
    assert min(abs(motion.angle - end) for end in ends) < 2 * FAST * 1e-3 / PER_RAD


def test_methods_are_those_of_the_standard_and_four_of_the_maker() -> None:
    assert set(METHODS) == {*range(1, 15), *range(17, 31), 33, 34, 35, 37, -1, -2, -3, -4}


def test_inputs_show_the_switches_as_402_numbers_them() -> None:
    switches = Switches(UNITS, Behaviour(hard_stop=STOPS, home_switch=CAM))
    shown = [switches.inputs(angle * PER_RAD) for angle in (-8.97, 0.0, 1.7, 7.97)]
    assert shown == [0b001, 0b000, 0b100, 0b010]


def test_switches_are_active_at_their_very_edges() -> None:
    units = AxisUnits(counts_per_rev=1000)
    behaviour = Behaviour(hard_stop=(-2.0, 2.0), home_switch=(0.5, 1.0))
    switches = Switches(units, behaviour)
    per_rad = units.counts_per_rad
    low, high = -2.0 * per_rad + LIMIT_SWITCH * per_rad, 2.0 * per_rad - LIMIT_SWITCH * per_rad
    for edge, outwards, bit in ((low, -1, 1), (high, 1, 2), (0.5 * per_rad, 1, 4)):
        assert switches.inputs(edge) == bit
        assert switches.inputs(edge + 1e-6 * outwards) == bit
        assert switches.inputs(edge - 1e-6 * outwards) == 0
    assert switches.inputs(1.0 * per_rad) == 4


@pytest.mark.parametrize(
    ("state", "word"),
    [
        # CiA 402-2, homing mode: bits 13 (error), 12 (attained) and 10 (target reached).
        (HomingState.IDLE, 0x0400),
        (HomingState.SEARCHING, 0x0000),
        (HomingState.ATTAINED, 0x1400),
        (HomingState.FAILED, 0x2400),
    ],
)
def test_the_statusword_tells_each_state_of_homing(state: HomingState, word: int) -> None:
    homing = Homing({}, Switches(UNITS, Behaviour()))
    homing.state = state
    assert homing.status(halted=False, standing=True) == word


@pytest.mark.parametrize(("method", "direction"), [(34, 1), (33, -1)])
def test_an_index_pulse_is_passed_at_the_speed_of_the_search_and_not_before(
    method: int, direction: int
) -> None:
    """A count a cycle: from one and a half before the pulse it is half a count before it."""
    values = {(0x6098, 0): method, (0x607C, 0): 0, (0x607E, 0): 0, (0x6099, 2): 1000}
    for away, place in ((1.5, -0.5), (0.6, 0.0), (0.002, 0.0)):
        motion = Motion(UNITS, Behaviour(), values)
        motion.demand = motion.actual = 1000.0 - direction * away
        homing = Homing(values, Switches(UNITS, Behaviour()))
        homing.command(0x1F)
        homing.step(motion, 1_000_000)
        assert homing.state is HomingState.SEARCHING
        assert motion.demand == pytest.approx(1000.0 + direction * place, abs=1e-6)
    # A thousandth of a count is where the pulse is.
    motion = Motion(UNITS, Behaviour(), values)
    motion.demand = motion.actual = 1000.0 - direction * 0.0009
    homing = Homing(values, Switches(UNITS, Behaviour()))
    homing.command(0x1F)
    homing.step(motion, 1_000_000)
    assert homing.state is HomingState.ATTAINED
