"""What the guard says to the readings of a cycle, at both sides of each limit, on either axis."""

import math
from typing import Any

import pytest
from guard_rig import REST, fault, pair, see_encoders, started

from legbench.limits.guard import ALL, Guard
from legbench.limits.safety import SafetyLimits

LIMITS = SafetyLimits(
    joint_range=((-1.0, 1.0), (-0.5, 1.5)),
    joint_knee_range=(0.125, 2.5),
    spring_torque=8.0,
    temperature=80.0,
)


def seen(guard: Guard, **changes: Any) -> str | None:
    return fault(guard.check, **{"joint_pos": REST, "spring_torque": (0.0, 0.0), **changes})


def judged(guard: Guard, **changes: Any) -> str | None:
    usual = {"commands": REST, "motor_pos": REST, "joint_pos": REST}
    return fault(see_encoders, guard, **{**usual, **changes})


def beyond(value: float) -> float:
    """The next number away from zero."""
    return math.nextafter(value, math.copysign(math.inf, value))


@pytest.mark.parametrize("axis", [0, 1])
def test_each_limit_is_allowed_itself_and_what_is_next_to_it_is_not(axis: int) -> None:
    guard = started(LIMITS)
    number = axis + 1
    for torque in (-8.0, 8.0):
        assert seen(guard, spring_torque=pair(axis, torque, 0.0)) is None
        told = seen(guard, spring_torque=pair(axis, beyond(torque), 0.0))
        assert told is not None
        assert told.startswith(f"spring torque: spring {number} carries")
    assert seen(guard, temperature=pair(axis, 80.0, 20.0)) is None
    assert seen(guard, temperature=(None, None)) is None
    told = seen(guard, temperature=[None, beyond(80.0)] if axis else [beyond(80.0), None])
    assert told is not None
    assert told.startswith(f"temperature: drive {number} is at 80.0 deg C")
    other = -0.5 if axis else 1.0
    for end in LIMITS.joint_range[axis]:
        if not 0.125 <= (end - other if axis else other - end) <= 2.5:
            continue
        assert seen(guard, joint_pos=pair(axis, end, other)) is None
        told = seen(guard, joint_pos=pair(axis, beyond(end), other))
        assert told is not None
        assert told.startswith(f"joint range: joint {number} is at")


@pytest.mark.parametrize(
    ("links", "further"),
    [((-0.5, -0.375), (-0.5, -0.376)), ((-1.0, 1.5), (-1.0, 1.501))],
)
def test_the_ends_of_the_knee_range_of_the_links(
    links: tuple[float, float], further: tuple[float, float]
) -> None:
    limits = SafetyLimits(joint_knee_range=(0.125, 2.5))
    guard = started(limits)
    assert seen(guard, joint_pos=links) is None
    told = seen(guard, joint_pos=further)
    assert told is not None
    assert told.startswith("joint range: q2 - q1 is at")


@pytest.mark.parametrize("axis", [0, 1])
def test_a_link_that_is_not_known_has_no_limits_and_the_other_one_keeps_its_own(axis: int) -> None:
    nothing = frozenset[str]()
    guard = Guard(LIMITS, 0.25, known=(nothing, ALL) if axis == 0 else (ALL, nothing))
    guard.start_at(REST)
    # Far beyond its own range, and the knee with it.
    assert seen(guard, joint_pos=pair(axis, 9.0, REST[1 - axis])) is None
    told = seen(guard, joint_pos=pair(axis, REST[axis], 9.0))
    assert told is not None
    assert told.startswith(f"joint range: joint {2 - axis} is at")


def test_readings_of_another_number_of_links_are_refused() -> None:
    for links in ((-0.5,), (-0.5, 0.5, 0.5)):
        with pytest.raises(ValueError, match="values to unpack"):
            seen(started(LIMITS), joint_pos=links)
        with pytest.raises(ValueError, match="values to unpack"):
            judged(started(LIMITS), joint_pos=links)


@pytest.mark.parametrize("axis", [0, 1])
def test_motors_may_stand_2_mrad_outside_their_range_before_they_are_enabled(axis: int) -> None:
    limits = SafetyLimits(motor_range=((-2.0, 1.0), (-1.0, 2.0)))
    guard = started(limits)
    for side, end in zip((-1.0, 1.0), limits.motor_range[axis], strict=True):
        for inside in (end - 0.5 * side, end, end + 0.002 * side):
            assert fault(guard.check_start, pair(axis, inside, 0.0)) is None
        told = fault(guard.check_start, pair(axis, end + 0.0021 * side, 0.0))
        assert told is not None
        assert told.startswith(f"motor range: motor {axis + 1} stands at")


def test_the_knee_may_stand_2_mrad_outside_its_range_before_motors_are_enabled() -> None:
    guard = started(SafetyLimits(motor_knee_range=(0.25, 3.0)))
    for side, end in ((-1.0, 0.25), (1.0, 3.0)):
        for inside in (end - 0.1 * side, end, end + 0.002 * side):
            assert fault(guard.check_start, (0.0, inside)) is None
        told = fault(guard.check_start, (0.0, end + 0.0021 * side))
        assert told is not None
        assert told.startswith("motor range: the motors stand with q2 - q1 at")


# --- encoders --------------------------------------------------------------------------------

WATCHED = SafetyLimits(following_error=0.25, following_cycles=2, joint_speed=1.0)


@pytest.mark.parametrize("axis", [0, 1])
def test_a_motor_away_from_its_command_is_found_after_its_cycles_and_no_other(axis: int) -> None:
    guard = started(WATCHED)
    away = pair(axis, REST[axis] + 0.5, REST[1 - axis])
    for _ in range(2):
        assert judged(guard, motor_pos=away) is None
    told = judged(guard, motor_pos=away)
    assert told is not None
    assert told.startswith(f"following error: motor {axis + 1} shows")
    # Wherever the motors are led from: none is suspected of what was before.
    guard.start_at(away)
    for _ in range(5):
        assert judged(guard, motor_pos=away, commands=away) is None


@pytest.mark.parametrize("axis", [0, 1])
def test_a_new_start_forgets_where_the_motors_and_the_links_were(axis: int) -> None:
    guard = Guard(WATCHED, 1e-3)
    guard.start_at(REST)
    away = pair(axis, REST[axis] + 0.5, REST[1 - axis])
    for _ in range(2):
        assert judged(guard, motor_pos=away) is None
    # The motor that was suspected has its two cycles again, and stands where it is led to.
    guard.start_at(away)
    assert [judged(guard, commands=away, joint_pos=away) for _ in range(2)] == [None, None]
    # Had it been on its way from its former place it would be there eight cycles later.
    told = judged(guard, commands=away, joint_pos=away)
    assert told is not None
    assert told.startswith(f"following error: motor {axis + 1} shows")


def test_of_two_motors_that_are_away_one_is_named_though_both_are() -> None:
    guard = started(WATCHED)
    away = (REST[0] + 0.5, REST[1] + 0.5)
    told = [judged(guard, motor_pos=away) for _ in range(3)]
    assert told[:2] == [None, None]
    assert str(told[2]).startswith("following error: motor ")


@pytest.mark.parametrize("axis", [0, 1])
@pytest.mark.parametrize("elapsed", [None, 1, 2, 3])
def test_a_link_may_turn_by_its_speed_in_the_time_that_has_passed(
    axis: int, elapsed: int | None
) -> None:
    # 1 rad/s for periods of 0.25 s; one period where nothing is said.
    most = 0.25 * (elapsed or 1)
    more = {} if elapsed is None else {"elapsed": elapsed}
    for turn, allowed in ((most, True), (-most, True), (most + 0.01, False)):
        guard = started(WATCHED)
        assert judged(guard, **more) is None
        links = pair(axis, REST[axis] + turn, REST[1 - axis])
        told = judged(guard, joint_pos=links, **more)
        assert (told is None) is allowed
        if told is not None:
            assert told.startswith(f"joint speed: joint {axis + 1} moved by")
        # It is news that count, and where the links are led from is no step.
        guard = started(WATCHED)
        assert judged(guard, **more) is None
        old = (bool(axis), not axis)
        assert judged(guard, joint_pos=links, fresh=old, **more) is None
        guard.start_at(REST)
        assert judged(guard, joint_pos=links, **more) is None


def test_a_motor_that_is_suspected_is_named_before_the_link_that_it_makes_doubtful() -> None:
    guard = started(WATCHED)
    assert judged(guard) is None
    told = judged(guard, motor_pos=(0.0, 0.5), joint_pos=(0.0, 0.5))
    assert told is not None
    assert told.startswith("following error: motor 1 shows")


@pytest.mark.parametrize("low", [True, False])
def test_who_is_at_a_limit_is_not_named_for_who_is_beyond_it(*, low: bool) -> None:
    limits = SafetyLimits(
        joint_range=((-1.0, 1.0), (-0.5, 1.5)), spring_torque=8.0, temperature=80.0
    )
    guard = started(limits)
    end, over = (-1.0, -0.75) if low else (1.0, 1.75)
    sign = -1.0 if low else 1.0
    well = {"joint_pos": (0.0, 0.0), "spring_torque": (0.0, 0.0), "temperature": (80.0, 80.0)}
    assert fault(guard.check, **well) is None
    for odd, told in (
        ({"joint_pos": (end, over)}, "joint range: joint 2 is at"),
        ({"spring_torque": (8.0 * sign, 8.125 * sign)}, "spring torque: spring 2 carries"),
        ({"temperature": (80.0, 80.5)}, "temperature: drive 2 is at 80.5 deg C"),
    ):
        assert str(fault(guard.check, **well | odd)).startswith(told)
