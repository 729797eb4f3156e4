"""The position loop of an emulated motor and the order of events on its wire, by closed forms."""

import math
from typing import Any, cast, final

import pytest
from test_emulated_motion import PER_RAD, STEP_NS, motor

from legbench.drives.emulated.network import Network
from legbench.drives.protocol.frame import Frame

MS = 1_000_000


@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_a_motor_that_slews_goes_no_faster_either_way_and_stops_where_it_should(
    side: float,
) -> None:
    made = motor(slew_rate=2.0)
    start = made.actual
    made.demand = start + side * 0.005 * PER_RAD
    gone = []
    for _ in range(4):
        made.drive(STEP_NS)
        gone.append((made.actual - start) / PER_RAD)
    # 2 rad/s are 2 mrad in a millisecond.
    assert gone == pytest.approx([side * way for way in (2e-3, 4e-3, 5e-3, 5e-3)])


@pytest.mark.parametrize("beside", [-40.0, 40.0])
def test_a_loop_over_the_encoder_of_the_link_closes_at_2_hz(beside: float) -> None:
    made = motor()
    start = made.actual
    made.demand, made.beside = start + 100.0, beside
    left = []
    for _ in range(3):
        made.drive(STEP_NS)
        left.append(start + 100.0 - beside - made.actual)
    first = 100.0 - beside
    assert left == pytest.approx([first * math.exp(-4e-3 * math.pi * n) for n in (1, 2, 3)])


@pytest.mark.parametrize("delay", [0, 1, 3])
def test_a_target_is_followed_once_so_many_have_come_after_it(delay: int) -> None:
    made = motor(setpoint_delay=delay, interpolate=False)
    start, seen = made.actual, []
    for number in range(1, 7):
        made.latch(1000 * number, number * MS)
        made.follow(number * MS, STEP_NS)
        seen.append(made.demand)
    assert seen == [start] * delay + [1000.0 * number for number in range(1, 7 - delay)]


@pytest.mark.parametrize(
    ("exponent", "span_ns"),
    # 60C2h:02 is a power of ten of seconds: nanoseconds are the finest, 1000 s the coarsest.
    [(-10, 7), (-9, 7), (-8, 70), (3, 7 * 10**12), (4, 7 * 10**12)],
)
def test_an_interpolation_time_is_a_nanosecond_at_the_least(exponent: int, span_ns: int) -> None:
    assert motor(objects={(0x60C2, 1): 7, (0x60C2, 2): exponent}).span_ns == span_ns


def test_a_motor_that_was_never_led_stands_and_is_late_from_then_on() -> None:
    made = motor(objects={(0x6065, 0): 10, (0x6066, 0): 3})
    assert (made.speed, made.missing, made.limited, made.jammed) == (0.0, 0, False, False)
    made.demand += 11.0
    # More than 3 ms (6066h) outside the window (6065h).
    assert [made.overdue(STEP_NS) for _ in range(4)] == [False, False, False, True]


# --- events ----------------------------------------------------------------------------------


@final
class Witness:
    """A participant that notes what it is told, and sends nothing."""

    def __init__(self) -> None:
        self.told: list[tuple[str, int]] = []

    def receive(self, frame: Frame, now_ns: int) -> None:
        self.told.append(("frame", now_ns))

    def take(self) -> list[tuple[int, Frame]]:
        return []

    def tick(self, now_ns: int) -> float:
        self.told.append(("tick", now_ns))
        return 0.0


def told(start_ns: int) -> list[tuple[str, int]]:
    """What a participant is told while a frame is sent from a time on."""
    witness = Witness()
    network = Network((), others=[cast(Any, witness)])
    station = network.attach()
    network.advance(start_ns)
    network.send(station, Frame(0x181, b"\1"))
    network.advance(start_ns + MS // 2)
    return witness.told


def test_the_grid_of_the_body_goes_before_a_frame_that_ends_at_the_same_time() -> None:
    ((_, lasts_ns),) = told(0)
    assert told(MS - lasts_ns) == [("tick", MS), ("frame", MS)]
    assert told(MS - lasts_ns - 1) == [("frame", MS - 1), ("tick", MS)]


def test_what_a_master_at_another_bitrate_has_not_sent_goes_with_it() -> None:
    for bitrate, sent in ((None, [0x181]), (500_000, [])):
        network = Network((), keep_log=True)
        station = network.attach(bitrate=bitrate)
        network.send(station, Frame(0x181))
        network.detach(station)
        network.advance(2 * MS)
        assert [frame.cob_id for _, frame in network.log or ()] == sent
