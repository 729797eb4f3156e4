"""The knee, q2 - q1, is a limit of commands and of links."""

import math
from dataclasses import replace
from pathlib import Path

import pytest
from can_rig import LIMITS, experiment
from hypothesis import given, settings
from hypothesis import strategies as st

from legbench.control import JumpConfig
from legbench.errors import ConfigError, PlantFault
from legbench.limits.guard import Guard
from legbench.limits.knee import knee_of, project
from legbench.limits.safety import SafetyLimits
from legbench.plant.design_limits import knee_ranges
from legbench.plants import limits_for

PERIOD = 1e-3
BOXES = ((-1.1, 0.8), (-0.8, 1.1))
KNEE = (0.2, 2.0)
KNEED = SafetyLimits(
    motor_range=BOXES, motor_knee_range=KNEE, joint_knee_range=(0.1, 2.1), command_speed=40.0
)
ANGLES = st.tuples(st.floats(-1.5, 1.5), st.floats(-1.5, 1.5))


@settings(derandomize=True, max_examples=100)
@given(st.lists(ANGLES, max_size=20))
def test_whatever_is_wished_the_knee_the_ranges_and_the_speed_are_kept(
    wishes: list[tuple[float, float]],
) -> None:
    guard = Guard(KNEED, PERIOD)
    guard.start_at((-0.5, 0.5))
    for wish in wishes:
        before = guard.applied
        for _ in range(3):
            applied = guard.command(wish)
            assert KNEE[0] - 1e-12 <= knee_of(applied) <= KNEE[1] + 1e-12
            for new, old, (low, high) in zip(applied, before, BOXES, strict=True):
                assert low <= new <= high
                assert abs(new - old) <= 0.04 + 1e-12
            before = applied


EXACT = st.tuples(st.integers(-15_000, 15_000), st.integers(-15_000, 15_000))


@settings(derandomize=True, max_examples=100)
@given(last=EXACT, wish=EXACT, step=st.integers(1, 8000))
def test_a_slewed_command_has_a_knee_between_the_last_and_the_wanted_one(
    last: tuple[int, int], wish: tuple[int, int], step: int
) -> None:
    """In multiples of 2^-13 rad nothing is rounded: it is exactly so, and so within the range."""
    unit, period = 2.0**-13, 2.0**-10
    limits = SafetyLimits(
        motor_range=((-1.125, 0.75), (-0.75, 1.125)),
        motor_knee_range=(0.25, 2.0),
        command_speed=step * unit / period,
        waive=("command_speed",),
    )
    slewed, free = Guard(limits, period), Guard(replace(limits, command_speed=math.inf), period)
    for guard in (slewed, free):
        guard.start_at([unit * count for count in last])
    applied, wanted = (guard.command([unit * count for count in wish]) for guard in (slewed, free))
    knees = (unit * knee_of(last), knee_of(wanted))
    assert min(knees) <= knee_of(applied) <= max(knees)
    moved = [abs(new - unit * old) for new, old in zip(applied, last, strict=True)]
    assert max(moved) <= step * unit


@settings(derandomize=True, max_examples=100)
@given(st.tuples(st.floats(*BOXES[0]), st.floats(*BOXES[1])))
def test_a_projection_is_the_nearest_posture_that_the_knee_allows(
    wanted: tuple[float, float],
) -> None:
    first, second = project(wanted, KNEE, BOXES)
    assert KNEE[0] - 1e-12 <= second - first <= KNEE[1] + 1e-12
    reached = math.hypot(first - wanted[0], second - wanted[1])
    # Against a search along the edge of what is allowed.
    knee = min(max(wanted[1] - wanted[0], KNEE[0]), KNEE[1])
    places = [BOXES[0][0] + 0.001 * step for step in range(1901)]
    inside = [(a, a + knee) for a in places if BOXES[1][0] <= a + knee <= BOXES[1][1]]
    nearest = min(math.hypot(a - wanted[0], b - wanted[1]) for a, b in inside)
    assert reached <= nearest + 1e-12
    if KNEE[0] <= wanted[1] - wanted[0] <= KNEE[1]:
        assert (first, second) == wanted


def test_motors_led_into_the_knee_stop_both_give_way() -> None:
    guard = Guard(KNEED, PERIOD)
    guard.start_at((-0.3, 0.3))
    for _ in range(200):
        guard.command((0.79, -0.79))
    assert guard.applied == pytest.approx((-0.1, 0.1), abs=1e-12)
    assert guard.reachable((0.79, -0.79)) == pytest.approx((-0.1, 0.1))


def test_from_beyond_the_knee_the_way_leads_back_and_no_farther() -> None:
    guard = Guard(KNEED, PERIOD)
    guard.start_at((0.0, 0.0))
    assert guard.command((0.1, -0.1)) == pytest.approx((0.0, 0.0))
    knees = [knee_of(guard.command((-0.3, 0.3))) for _ in range(20)]
    assert knees == sorted(knees)
    assert knees[-1] == pytest.approx(0.6)
    with pytest.raises(PlantFault, match=r"q2 - q1 at 0\.000 rad, .* move them back by hand"):
        guard.check_start((0.0, 0.0))
    guard.check_start((-0.1, 0.0995))


@pytest.mark.parametrize("links", [(0.0, 0.09), (-1.1, 1.1)])
def test_a_knee_beyond_its_range_ends_the_run(links: tuple[float, float]) -> None:
    guard = Guard(KNEED, PERIOD)
    torques = (0.0, 0.0)
    guard.check(joint_pos=(0.0, 0.11), spring_torque=torques)
    with pytest.raises(PlantFault, match=r"q2 - q1 is at .* the limits are \[0\.1, 2\.1\] rad"):
        guard.check(joint_pos=links, spring_torque=torques)


@pytest.mark.parametrize(
    ("knee", "said"),
    [
        ((0.5, 0.5), r"motor_knee_range is \[0\.5, 0\.5\] rad; low must be below high"),
        ((2.5, 3.0), r"allow q2 - q1 from -1\.6 to 2\.2 rad only"),
    ],
)
def test_a_knee_range_that_leaves_no_room_is_refused(knee: tuple[float, float], said: str) -> None:
    with pytest.raises(ConfigError, match=said):
        replace(KNEED, motor_knee_range=knee)


def test_the_knee_is_the_designs_unless_the_file_is_tighter(tmp_path: Path) -> None:
    design = experiment(JumpConfig()).design
    motors, links = knee_ranges(design)
    path = tmp_path / "limits.toml"
    path.write_text("# no limit\n")
    limits = limits_for(path, design)
    assert (limits.motor_knee_range, limits.joint_knee_range) == (motors, links)
    assert motors == pytest.approx((0.2, 3.0))
    path.write_text("motor_knee_range = [0.5, 2.5]\njoint_knee_range = [0.2, 2.9]\n")
    assert limits_for(path, design).motor_knee_range == (0.5, 2.5)
    for name in ("motor_knee_range", "joint_knee_range"):
        path.write_text(f"{name} = [0.0, 2.5]\n")
        with pytest.raises(ConfigError, match=rf"{name} is \[0, 2\.5\] rad, looser than the"):
            limits_for(path, design)


def test_the_shipped_limits_fit_the_design() -> None:
    limits_for(LIMITS, experiment(JumpConfig()).design)
