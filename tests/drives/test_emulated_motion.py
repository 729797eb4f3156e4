"""The motor of an emulated drive against closed forms: ramps, interpolation, stops, homing."""

import math
from collections.abc import Callable

import pytest

from legbench.drives.emulated.alarms import Alarms
from legbench.drives.emulated.behaviour import Behaviour, MissingSetpoint
from legbench.drives.emulated.homing import Homing, HomingState
from legbench.drives.emulated.motion import Motion
from legbench.drives.emulated.switches import Switches
from legbench.drives.protocol.objects import Key
from legbench.drives.setup.units import AxisUnits

STEP_NS = 1_000_000
UNITS = AxisUnits(counts_per_rev=1000, offset_counts=300)
MIRRORED = AxisUnits(counts_per_rev=1000, offset_counts=300, sign=-1)
PER_RAD = 1000 / (2.0 * math.pi)


def motor(
    units: AxisUnits = UNITS, objects: dict[Key, int] | None = None, **behaviour: object
) -> Motion:
    """A motor whose objects are as after power-on, but for those that are given."""
    values = {
        (0x60C2, 1): 1,
        (0x60C2, 2): -3,
        (0x607E, 0): 0,
        (0x607D, 1): 0,
        (0x607D, 2): 0,
        (0x6080, 0): 0,
        (0x6065, 0): 0xFFFFFFFF,
        (0x6066, 0): 0,
    } | (objects or {})
    return Motion(units, Behaviour(**behaviour), values)  # pyrefly: ignore[bad-argument-type]


@pytest.mark.parametrize("units", [UNITS, MIRRORED])
def test_it_starts_where_it_stands_and_shows_its_true_angle(units: AxisUnits) -> None:
    made = motor(units, start_pos=0.5)
    assert made.actual == pytest.approx(300 + units.sign * 0.5 * PER_RAD)
    assert made.demand == made.actual
    assert made.angle == pytest.approx(0.5)


@pytest.mark.parametrize(
    ("value", "exponent", "span_ns"),
    [
        (1, -3, 1_000_000),
        (4, -3, 4_000_000),
        (10, -4, 1_000_000),
        (2, 0, 2_000_000_000),
        (3, -9, 3),
        (3, -12, 3),
        (1, 3, 10**12),
        (1, 5, 10**12),
        (0, -3, 1),
    ],
)
def test_the_interpolation_time_is_60c2(value: int, exponent: int, span_ns: int) -> None:
    assert motor(objects={(0x60C2, 1): value, (0x60C2, 2): exponent}).span_ns == span_ns


def test_a_target_is_reached_on_a_straight_line_and_held() -> None:
    made = motor(objects={(0x60C2, 1): 4}, interpolate=True)
    made.latch(700, 10 * STEP_NS)
    for step, demand in ((1, 400), (2, 500), (3, 600), (4, 700), (5, 700), (40, 700)):
        made.follow((10 + step) * STEP_NS, STEP_NS)
        assert made.demand == pytest.approx(demand)
        made.drive(STEP_NS)
        assert made.actual == pytest.approx(demand)
    # A new target half-way begins where the demand is.
    made.latch(300, 60 * STEP_NS)
    made.follow(62 * STEP_NS, STEP_NS)
    made.latch(900, 62 * STEP_NS)
    made.follow(63 * STEP_NS, STEP_NS)
    assert made.demand == pytest.approx(500 + (900 - 500) / 4)
    assert made.speed == pytest.approx(100 * 1000)


def test_without_interpolation_a_target_is_there_at_once() -> None:
    made = motor(interpolate=False)
    made.latch(700, 0)
    made.follow(1, STEP_NS)
    assert made.demand == 700


def test_missing_set_points_are_counted_until_one_comes() -> None:
    for kind in MissingSetpoint:
        made = motor(missing_setpoint=kind)
        made.latch(310, 0)
        made.follow(STEP_NS, STEP_NS)
        for count in (1, 2, 3):
            made.latch(None, count * STEP_NS)
            assert made.missing == count
            made.follow((count + 1) * STEP_NS, STEP_NS)
            extra = 10 * count if kind is MissingSetpoint.EXTRAPOLATE else 0
            assert made.demand == pytest.approx(310 + extra)
        made.latch(320, 10 * STEP_NS)
        assert made.missing == 0
        made.latch(None, 11 * STEP_NS)
        made.hold(11 * STEP_NS)
        assert (made.missing, made.speed, made.demand) == (0, 0.0, made.actual)


def test_software_limits_cut_a_target_on_both_sides_and_say_so() -> None:
    made = motor(objects={(0x607D, 1): 200, (0x607D, 2): 400}, interpolate=False)
    for target, kept in ((400, 400), (401, 400), (300, 300), (200, 200), (199, 200)):
        made.latch(target, 0)
        made.follow(STEP_NS, STEP_NS)
        assert made.demand == kept
        assert made.limited == (target != kept)
    for low, high in ((0, 0), (400, 200)):
        made = motor(objects={(0x607D, 1): low, (0x607D, 2): high}, interpolate=False)
        made.latch(10_000, 0)
        made.follow(STEP_NS, STEP_NS)
        assert made.demand == 10_000
        assert not made.limited


@pytest.mark.parametrize("speed", [500.0, -500.0])
def test_a_ramp_loses_its_deceleration_times_time_and_then_stands(speed: float) -> None:
    made, deceleration = motor(), 5000.0
    made.seek(speed, STEP_NS)
    assert made.speed == pytest.approx(speed)
    start, sign = made.demand, math.copysign(1.0, speed)
    for step in range(1, 100):
        assert not made.ramp(deceleration, STEP_NS)
        assert made.speed == pytest.approx(sign * (abs(speed) - 5.0 * step))
        assert made.demand - start == pytest.approx(
            sign * 1e-3 * sum(abs(speed) - 5.0 * past for past in range(1, step + 1))
        )
    assert made.ramp(deceleration, STEP_NS)
    rest = made.demand
    assert made.ramp(deceleration, STEP_NS)
    assert (made.speed, made.demand) == (0.0, rest)


def test_a_ramp_without_deceleration_stops_at_once() -> None:
    made = motor()
    made.seek(500.0, STEP_NS)
    before = made.demand
    assert made.ramp(0.0, STEP_NS)
    assert made.demand == before
    # What was on the way is forgotten: interpolation begins where the ramp ended.
    made.follow(10 * STEP_NS, STEP_NS)
    assert made.demand == before


def test_the_position_loop_is_a_low_pass_of_its_corner_frequency() -> None:
    made = motor(bandwidth=20.0)
    made.demand = 1300.0
    for step in range(1, 30):
        made.drive(STEP_NS)
        left = 1000.0 * math.exp(-2.0 * math.pi * 20.0 * 1e-3 * step)
        assert made.demand - made.actual == pytest.approx(left)


def test_a_motor_is_no_faster_than_6080_in_either_direction() -> None:
    for sign in (1, -1):
        made = motor(objects={(0x6080, 0): 7000})
        made.demand = 300.0 + sign * 20.0
        ways = []
        for _ in range(4):
            before = made.actual
            made.drive(STEP_NS)
            ways.append(sign * (made.actual - before))
        assert ways == pytest.approx([7.0, 7.0, 6.0, 0.0])


@pytest.mark.parametrize("units", [UNITS, MIRRORED])
def test_mechanical_stops_hold_the_motor_and_block_what_presses_on(units: AxisUnits) -> None:
    made = motor(units, hard_stop=(-0.4, 0.6))
    for demand, angle, blocked in (
        (0.6, 0.6, False),
        (0.9, 0.6, True),
        (0.1, 0.1, False),
        (-0.4, -0.4, False),
        (-0.9, -0.4, True),
    ):
        made.demand = 300.0 + demand * units.counts_per_rad
        made.drive(STEP_NS)
        assert made.angle == pytest.approx(angle)
        assert made.blocked() == blocked, demand
    free = motor(units)
    free.demand = 1e9
    free.drive(STEP_NS)
    assert free.actual == 1e9
    assert not free.blocked()


def test_a_following_error_is_one_after_its_time_outside_its_window() -> None:
    made = motor(objects={(0x6065, 0): 50, (0x6066, 0): 3})
    for late in (50.0, -50.0):
        made.demand = made.actual + late
        assert not any(made.overdue(STEP_NS) for _ in range(20))
    made.demand = made.actual - 51.0
    assert [made.overdue(STEP_NS) for _ in range(5)] == [False, False, False, True, True]
    # One moment inside, and the time begins anew.
    made.demand = made.actual
    assert not made.overdue(STEP_NS)
    made.demand = made.actual + 51.0
    assert [made.overdue(STEP_NS) for _ in range(4)] == [False, False, False, True]
    off = motor()
    off.demand = 1e9
    assert not any(off.overdue(STEP_NS) for _ in range(20))
    at_once = motor(objects={(0x6065, 0): 50})
    at_once.demand = at_once.actual + 51.0
    assert at_once.overdue(STEP_NS)


def test_renaming_a_position_moves_nothing() -> None:
    made = motor(hard_stop=(-0.4, 0.6), start_pos=0.2, objects={(0x60C2, 1): 2})
    made.latch(310, 0)
    target = (310 - made.actual) / PER_RAD
    made.set_position(5000)
    assert made.actual == 5000
    assert made.angle == pytest.approx(0.2)
    made.follow(STEP_NS, STEP_NS)
    made.drive(STEP_NS)
    assert made.angle == pytest.approx(0.2 + 0.5 * target)
    made.demand = 1e9
    made.drive(STEP_NS)
    assert made.angle == pytest.approx(0.6)
    made.demand = -1e9
    made.drive(STEP_NS)
    assert made.angle == pytest.approx(-0.4)


# --- homing ----------------------------------------------------------------------------------

SEARCH, LEAVE, HOME = 400, 100, 5000
START = 0x10


def homing(made: Motion, method: int, **changes: int) -> tuple[Homing, Callable[[int, int], None]]:
    """A homing run and a hand that gives it a controlword for so many cycles."""
    values = made._values
    values |= {(0x6098, 0): method, (0x607C, 0): HOME, (0x6099, 1): SEARCH, (0x6099, 2): LEAVE}
    values |= {(0x6099, 2): changes.get("leave", LEAVE)}
    run = Homing(values, Switches(UNITS, made._behaviour))

    def cycles(word: int, count: int) -> None:
        for _ in range(count):
            run.command(word)
            run.step(made, STEP_NS)
            made.drive(STEP_NS)

    return run, cycles


@pytest.mark.parametrize("method", [35, 37])
def test_homing_in_place_renames_the_position_at_once(method: int) -> None:
    made = motor(start_pos=0.2)
    run, cycles = homing(made, method)
    cycles(0x0F, 3)
    assert run.state is HomingState.IDLE
    cycles(0x0F | START, 1)
    assert run.state is HomingState.ATTAINED
    assert made.actual == HOME
    assert made.angle == pytest.approx(0.2)


@pytest.mark.parametrize(("method", "direction"), [(-1, -1), (-2, 1), (-3, -1), (-4, 1)])
def test_homing_seeks_a_stop_at_its_speed_and_leaves_it_for_the_index(
    method: int, direction: int
) -> None:
    made = motor(start_pos=0.2, hard_stop=(-2.5, 6.0))
    run, cycles = homing(made, method)
    before = made.actual
    cycles(0x0F | START, 1)
    assert run.state is HomingState.SEARCHING
    assert made.actual - before == pytest.approx(direction * SEARCH * 1e-3)
    # The stops lie at counts -98 and 1255, the index pulses next to them at 0 and 1000.
    stop = 300 + (6.0 if direction > 0 else -2.5) * PER_RAD
    search = math.ceil(abs(stop - before) / (SEARCH * 1e-3)) + 2
    cycles(0x0F | START, search)
    if method in (-3, -4):
        assert run.state is HomingState.ATTAINED
        assert made.actual == HOME
        assert made.angle == pytest.approx((stop - 300) / PER_RAD)
        return
    assert run.state is HomingState.SEARCHING
    back = made.actual
    cycles(0x0F | START, 1)
    assert made.actual - back == pytest.approx(-direction * LEAVE * 1e-3)
    index = 1000 if direction > 0 else 0
    cycles(0x0F | START, round(abs(index - stop) / (LEAVE * 1e-3)) + 3)
    assert run.state is HomingState.ATTAINED
    assert made.actual == HOME
    assert made.angle == pytest.approx((index - 300) / PER_RAD)


def test_homing_without_a_speed_away_from_the_stop_fails_there() -> None:
    for method, leave, state in (
        (-1, 0, HomingState.FAILED),
        (-3, 0, HomingState.ATTAINED),
        (-1, LEAVE, HomingState.SEARCHING),
    ):
        run, cycles = homing(motor(hard_stop=(0.0, 0.1)), method, leave=leave)
        cycles(START, 3)
        assert run.state is state


@pytest.mark.parametrize("method", [0, 15, 16, 31, 32, 36, 38, -5])
def test_an_unknown_method_fails_and_moves_nothing(method: int) -> None:
    made = motor(start_pos=0.2)
    run, cycles = homing(made, method)
    before = made.actual
    cycles(START, 5)
    assert run.state is HomingState.FAILED
    assert made.actual == before


def test_the_end_of_bit_4_interrupts_homing_and_its_edge_begins_anew() -> None:
    for method, leave in ((-3, SEARCH), (-1, LEAVE)):
        made = motor(start_pos=0.05 if method == -1 else 0.6, hard_stop=(0.0, 3.0))
        run, cycles = homing(made, method, leave=leave)
        cycles(START, 40)
        assert run.state is HomingState.SEARCHING
        cycles(0x00, 1)
        assert run.state is HomingState.IDLE
        before = made.actual
        cycles(0x00, 5)
        assert made.actual == before
        cycles(START, 1)
        assert run.state is HomingState.SEARCHING
    made = motor()
    run, cycles = homing(made, 37)
    cycles(START, 1)
    made.demand = made.actual = HOME + 7.0
    # The bit stands: once attained it stays so, and names nothing again.
    cycles(START, 3)
    assert made.actual == HOME + 7.0
    assert run.state is HomingState.ATTAINED
    cycles(0x00, 1)
    assert run.state is HomingState.ATTAINED


# --- alarms ----------------------------------------------------------------------------------


def alarms() -> tuple[Alarms, dict[Key, int]]:
    values: dict[Key, int] = {(0x603F, 0): 0, (0x1001, 0): 0, (0x1003, 0): 0, (0x1003, 1): 0}
    return Alarms(5, values), values


def shown(values: dict[Key, int]) -> tuple[int, ...]:
    """603Fh, 1001h, 1003h:00 and :01."""
    return tuple(values[key] for key in ((0x603F, 0), (0x1001, 0), (0x1003, 0), (0x1003, 1)))


def test_an_error_is_told_once_and_the_register_holds_all_of_them() -> None:
    wrong, values = alarms()
    assert str(wrong.raise_(0x3220)) == "085#2032050000000000"
    assert wrong.raise_(0x3220) is None
    assert shown(values) == (0x3220, 0b101, 1, 0x3220)
    assert str(wrong.raise_(0x8611)) == "085#1186250000000000"
    assert shown(values) == (0x8611, 0b100101, 1, 0x8611)


def test_errors_are_forgotten_together_once_no_cause_stands() -> None:
    wrong, values = alarms()
    assert wrong.reset() is None
    wrong.hold(0x3220)
    wrong.hold(0x4310)
    wrong.raise_(0x3220)
    wrong.raise_(0x4310)
    wrong.release(0x3220)
    assert wrong.standing
    assert wrong.reset() is None
    assert shown(values)[0] == 0x4310
    wrong.release(0x4310)
    wrong.release(0x4310)
    assert not wrong.standing
    assert str(wrong.reset()) == "085#0000000000000000"
    assert shown(values) == (0, 0, 1, 0x4310)
    assert wrong.reset() is None
    assert wrong.raise_(0x3220) is not None


def test_an_error_of_communication_goes_by_itself_and_the_last_gives_the_all_clear() -> None:
    wrong, values = alarms()
    assert wrong.clear(0x8130) is None
    wrong.raise_(0x8130)
    wrong.raise_(0x8250)
    assert wrong.clear(0x8130) is None
    assert shown(values)[0] == 0x8250
    assert str(wrong.clear(0x8250)) == "085#0000000000000000"
    assert shown(values)[:2] == (0, 0)
    assert wrong.raise_(0x8130) is not None
