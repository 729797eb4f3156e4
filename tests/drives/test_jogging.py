"""A jog at both sides of each of its limits, of either motor, and what it says of its end."""

import math
from dataclasses import replace
from types import SimpleNamespace
from typing import Any, cast

import pytest
from can_rig import LIMITS
from guard_rig import pair
from service_rig import BENCH, MS, opened, states, written

from legbench.commissioning import jog as jog_module
from legbench.commissioning.jog import jog
from legbench.drives.emulated.behaviour import Behaviour
from legbench.drives.emulated.build import emulate
from legbench.drives.emulated.bus import LockstepBus
from legbench.drives.master.session import Session
from legbench.drives.protocol.cia402 import POWERED
from legbench.drives.setup.bus_file import load_limits
from legbench.errors import ConfigError
from legbench.limits.safety import SafetyLimits

STIFFNESS = (4.0, 5.0)
NAMES = ("motor1", "motor2")
START = (-0.2, 0.4)


def jogged(place: int, **changes: Any) -> tuple[Any, Any]:
    """What a jog tells, and the network that it moved."""
    network = emulate(BENCH, [Behaviour(start_pos=at) for at in START], keep_log=True)
    network.advance(20 * MS)
    way: dict[str, Any] = {"by": 0.01, "speed": 1.0, "back": False, **changes}
    with Session(LockstepBus("leg", network=network), BENCH) as session:
        done = jog(session, load_limits(LIMITS), STIFFNESS, NAMES[place], **way)
    return done, network


@pytest.mark.parametrize("place", [0, 1])
@pytest.mark.parametrize("back", [False, True])
def test_a_jog_moves_one_motor_tells_its_far_end_and_leaves_no_power(
    place: int, back: bool
) -> None:
    done, network = jogged(place, by=-0.05 if place else 0.05, back=back)
    moved = pair(place, -0.05 if place else 0.05, 0.0)
    there = [at + way for at, way in zip(START, moved, strict=True)]
    assert done.node == NAMES[place]
    assert done.before_pos == pytest.approx(START, abs=1e-4)
    assert done.after_pos == pytest.approx(there, abs=1e-4)
    # The links of emulated drives without a leg are stiff on their shafts.
    assert done.link_pos == pytest.approx(there, abs=5e-3)
    torques = [k * (m - q) for k, m, q in zip(STIFFNESS, there, done.link_pos, strict=True)]
    assert done.spring_torque == pytest.approx(torques, abs=5e-3)
    end = START if back else there
    assert [drive.axis.motion.angle for drive in network.drives] == pytest.approx(end, abs=1e-3)
    assert not set(states(network)) & set(POWERED)


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"by": 0.0}, r"a jog by 0 rad; it may be up to 0\.3 rad, and not zero"),
        ({"by": 0.3000001}, "a jog by 0.3 rad; it may be"),
        ({"by": -0.3000001}, "a jog by -0.3 rad; it may be"),
        ({"speed": 0.0}, r"a jog at 0 rad/s; it may be up to 1 rad/s"),
        ({"speed": -0.5}, "a jog at -0.5 rad/s"),
        ({"speed": 1.0000001}, "a jog at 1 rad/s"),
        ({"speed": math.nan}, "a jog at nan rad/s"),
        ({"by": math.nan}, "a jog by nan rad"),
    ],
)
def test_a_jog_is_short_and_slow(changes: dict[str, float], said: str) -> None:
    session, network = opened()
    way: dict[str, Any] = {"by": 0.01, "speed": 0.5, "back": False, **changes}
    with session, pytest.raises(ConfigError, match=said):
        jog(session, load_limits(LIMITS), STIFFNESS, "motor1", **way)
    assert written(network) == []


def test_the_longest_and_fastest_jog_is_made() -> None:
    done, _ = jogged(1, by=0.3, speed=1.0)
    assert done.after_pos[1] - START[1] == pytest.approx(0.3, abs=1e-4)


def test_a_node_that_is_not_there_is_named_with_those_that_are() -> None:
    session, _ = opened()
    with session, pytest.raises(ConfigError, match=r"no node 'knee' .* there are motor1, motor2"):
        jog(session, load_limits(LIMITS), STIFFNESS, "knee", by=0.1, speed=0.5, back=False)


@pytest.mark.parametrize("axis", [1, 2])
@pytest.mark.parametrize("end", [0, 1])
@pytest.mark.parametrize("kind", ["motor", "joint"])
def test_every_range_has_two_ends(kind: str, end: int, axis: int) -> None:
    limits = load_limits(LIMITS)
    ranges = [list(one) for one in getattr(limits, f"{kind}_range")]
    ranges[axis - 1][end] = math.inf if end else -math.inf
    changed: dict[str, Any] = {f"{kind}_range": tuple(map(tuple, ranges))}
    open_ended = replace(limits, **changed)
    session, network = opened()
    said = rf"{kind}_range of axis {axis} is \[.*inf.*\] rad; a motor is not jogged without"
    with session, pytest.raises(ConfigError, match=said):
        jog(session, open_ended, STIFFNESS, "motor1", by=0.1, speed=0.5, back=False)
    assert written(network) == []


# --- places ----------------------------------------------------------------------------------

RANGES = SafetyLimits(motor_range=((-1.0, 0.5), (-0.5, 1.0)))
KNEE = SafetyLimits(motor_knee_range=(0.25, 1.0))
EPS = 1e-4
"""More than the counts of an encoder, less than what may be outside at the start."""


def check(
    monkeypatch: pytest.MonkeyPatch,
    limits: SafetyLimits,
    places: tuple[float, float],
    place: int,
    by: float,
) -> str | None:
    """What is said of a jog that begins with the motors at these places."""
    shown = {
        node.name: (node.motor.to_counts(at), None)
        for node, at in zip(BENCH.nodes, places, strict=True)
    }
    monkeypatch.setattr(jog_module, "read_counts", lambda _session, node: shown[node.name])
    session = cast(Any, SimpleNamespace(config=BENCH))
    try:
        jog_module._check_range(session, limits, place, by)
    except ConfigError as error:
        return str(error)
    return None


@pytest.mark.parametrize("place", [0, 1])
@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_a_jog_ends_within_the_range_of_its_motor(
    place: int, side: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    end = RANGES.motor_range[place][side > 0.0]
    for gap, refused in ((EPS, False), (-EPS, True)):
        places = pair(place, end - 0.25 * side, 0.0)
        by = (0.25 - gap) * side
        told = check(monkeypatch, RANGES, places, place, by)
        assert (told is not None) is refused
        if told is not None:
            assert told.startswith(f"the jog would take '{NAMES[place]}' from ")
        # The other motor goes nowhere.
        assert check(monkeypatch, RANGES, places, 1 - place, 0.25) is None


@pytest.mark.parametrize("place", [0, 1])
@pytest.mark.parametrize("side", [-1.0, 1.0])
@pytest.mark.parametrize("jogs", [0, 1])
def test_either_motor_may_stand_2_mrad_outside_before_any_is_enabled(
    place: int, side: float, jogs: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    end = RANGES.motor_range[place][side > 0.0]
    for beyond, refused in ((0.002 - EPS, False), (0.002 + EPS, True)):
        places = pair(place, end + side * beyond, 0.0)
        told = check(monkeypatch, RANGES, places, jogs, -0.25 * side if jogs == place else 0.25)
        assert (told is not None) is refused
        if told is not None:
            assert told.startswith(f"'{NAMES[place]}' stands at {end + side * beyond:.3f} rad")


@pytest.mark.parametrize("place", [0, 1])
@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_the_knee_begins_within_2_mrad_of_its_range_and_ends_within(
    place: int, side: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    end = KNEE.motor_knee_range[side > 0.0]
    turn = side if place else -side  # By this the knee goes beyond its end.
    for knee, by, said in (
        (end - 0.25 * side, (0.25 - EPS) * turn, None),
        (end - 0.25 * side, (0.25 + EPS) * turn, "the jog would take q2 - q1, the knee, from "),
        (end + (0.002 - EPS) * side, -0.25 * turn, None),
        (end + (0.002 + EPS) * side, -0.25 * turn, "the motors stand with q2 - q1 at "),
    ):
        told = check(monkeypatch, KNEE, (-0.125, knee - 0.125), place, by)
        assert (told is None) is (said is None), (knee, by)
        assert str(told).startswith(said or "None")


@pytest.mark.parametrize("place", [0, 1])
@pytest.mark.parametrize("by", [-0.125, 0.125])
def test_the_ends_themselves_are_reached(
    place: int, by: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    units = [node.motor for node in BENCH.nodes]
    there = [one.to_rad(one.to_counts(at)) for one, at in zip(units, START, strict=True)]
    there[place] += by
    motor, knee = there[place], there[1] - there[0]
    ranges = [(-9.0, 9.0), (-9.0, 9.0)]
    ranges[place] = (-9.0, motor) if by > 0.0 else (motor, 9.0)
    opens = (by > 0.0) is (place == 1)
    limits: Any = SimpleNamespace(
        motor_range=ranges, motor_knee_range=(-9.0, knee) if opens else (knee, 9.0)
    )
    assert check(monkeypatch, limits, START, place, by) is None


def ending_at(value: float, gap: float) -> float:
    """The number that with a gap makes a value to the last bit."""
    guess = value - gap
    near = (guess, math.nextafter(guess, math.inf), math.nextafter(guess, -math.inf))
    return next(number for number in near if number + gap == value)


@pytest.mark.parametrize("side", [-1, 1])
def test_what_may_be_outside_before_a_jog_is_2_mrad_and_not_less(
    side: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    units = [node.motor for node in BENCH.nodes]
    there = [one.to_rad(one.to_counts(at)) for one, at in zip(units, START, strict=True)]
    inward: Any = {"place": 1, "by": -0.01 * side}
    for knee in (False, True):
        value = there[1] - there[0] if knee else there[1]
        end = ending_at(value, 0.002 * side)
        one = (end, 9.0) if side < 0 else (-9.0, end)
        wide = (-9.0, 9.0)
        ranges = [wide, wide] if knee else [wide, one]
        limits: Any = SimpleNamespace(motor_range=ranges, motor_knee_range=one if knee else wide)
        assert check(monkeypatch, limits, START, **inward) is None
        beyond = math.nextafter(end, -side * math.inf)
        ranges[1] = wide if knee else (beyond, 9.0) if side < 0 else (-9.0, beyond)
        if knee:
            limits.motor_knee_range = (beyond, 9.0) if side < 0 else (-9.0, beyond)
        assert check(monkeypatch, limits, START, **inward) is not None


def test_limits_of_another_number_of_motors_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    limits: Any = SimpleNamespace(motor_range=[(-9.0, 9.0)], motor_knee_range=(-9.0, 9.0))
    with pytest.raises(ValueError, match="zip"):
        check(monkeypatch, limits, START, 0, 0.1)
