"""What a drive took of its configuration, its habits and its way to a stop, at their ends."""

import math
from dataclasses import replace
from types import SimpleNamespace
from typing import Any, cast

import pytest
from drives_rig import config, node

from legbench.drives.emulated import memory
from legbench.drives.emulated.emergencies import EmergencyOutlet
from legbench.drives.emulated.lss import LssSlave
from legbench.drives.protocol.datatypes import DataType
from legbench.drives.protocol.frame import Frame
from legbench.drives.protocol.objects import Key
from legbench.drives.setup import quirks
from legbench.drives.setup.config import NodeConfig, Parameter
from legbench.drives.setup.outcome import ObjectOutcome
from legbench.drives.setup.quirks import ModeShown, Quirks
from legbench.drives.setup.stopping import LONGEST_WAY, check_stopping, stopping_way
from legbench.drives.setup.taken import _deadline, _lacking, not_given, tells_heartbeat, unprotected
from legbench.drives.setup.waivers import describe_waivers
from legbench.errors import ConfigError
from legbench.limits.safety import SafetyLimits
from legbench.limits.upper_ends import LIMIT_ENDS

U32 = DataType.UNSIGNED32


def outcome(index: int, sub: int = 0, *, agrees: bool = True) -> ObjectOutcome:
    parameter = Parameter(index=index, sub=sub, kind=U32, value=5)
    return ObjectOutcome(parameter=parameter, there=5 if agrees else 6, agrees=agrees)


# --- habits ----------------------------------------------------------------------------------


def test_a_drive_has_half_a_second_for_its_mode_and_30_s_at_most() -> None:
    usual = Quirks()
    assert (usual.mode_patience_ms, usual.mode_shown) == (500, ModeShown.CONFIGURED)
    assert (usual.follows_bit, usual.warnings) == (True, ())
    assert (quirks.USUAL_PATIENCE_MS, quirks.LONGEST_PATIENCE_MS) == (500, 30_000)
    for patience_ms in (1, 30_000):
        assert Quirks(mode_patience_ms=patience_ms).mode_patience_ms == patience_ms
    for patience_ms in (0, -1, 30_001):
        with pytest.raises(ConfigError, match=f"mode_patience_ms is {patience_ms} ms"):
            Quirks(mode_patience_ms=patience_ms)


def test_a_warning_is_an_error_code_that_stands_there_once() -> None:
    for codes in ((1,), (0xFFFF,), (1, 0xFFFF, 0x8611)):
        assert Quirks(warnings=codes).warnings == codes
    for codes, said in (
        ((0,), "holds 0x0; error codes are 0x1 to 0xFFFF"),
        ((5, -1), "holds -0x1; error codes"),
        ((0x10000,), "holds 0x10000; error codes"),
        ((0x8611, 5, 0x8611), "holds 0x8611 twice"),
    ):
        with pytest.raises(ConfigError, match=said):
            Quirks(warnings=codes)


# --- the way of a stop -----------------------------------------------------------------------


def braking(place: int, ramp: float, index: int = 0x6085) -> NodeConfig:
    """A drive with a ramp [rad/s2]."""
    drive = node(place)
    counts = round(ramp * abs(drive.motor.counts_per_rad))
    return replace(drive, parameters=(Parameter(index=index, sub=0, kind=U32, value=counts),))


@pytest.mark.parametrize("index", [0x6085, 0x6084])
@pytest.mark.parametrize("place", [0, 1])
def test_a_stop_takes_half_the_square_of_the_speed_over_its_ramp(place: int, index: int) -> None:
    assert LONGEST_WAY == 0.2
    for speed, ramp in ((2.0, 50.0), (3.0, 10.0)):
        way = stopping_way(braking(place, ramp, index), speed)
        assert way == pytest.approx(speed * speed / (2.0 * ramp), rel=1e-5)
    with pytest.raises(ConfigError, match=f"'{node(place).name}' has no quick-stop ramp"):
        stopping_way(node(place), 1.0)
    with pytest.raises(ConfigError, match="has no quick-stop ramp"):
        stopping_way(braking(place, 0.0), 1.0)


@pytest.mark.parametrize("place", [0, 1])
def test_either_motor_stops_within_a_fifth_of_a_radian(place: int) -> None:
    def at(speed: float) -> Any:
        return cast(Any, SimpleNamespace(command_speed=speed))

    nodes = [braking(0, 100.0), braking(1, 100.0)]
    nodes[place] = braking(place, 10.0)
    bus = config(nodes=tuple(nodes))
    # Of 10 rad/s2, 0.2 rad last from 2 rad/s on.
    check_stopping(bus, at(1.9999))
    words = rf"'{nodes[place].name}' needs 0\.2 rad to stop from 2\.0001 rad/s"
    with pytest.raises(ConfigError, match=words):
        check_stopping(bus, at(2.0001))
    # Without a highest speed nothing can be told.
    check_stopping(bus, at(math.inf))
    check_stopping(replace(bus, waive=("quick-stop ramp",)), at(50.0))


# --- what was taken --------------------------------------------------------------------------


def test_deadlines_are_those_of_command_frames() -> None:
    for index, sub, wanted in (
        (0x1400, 5, True),
        (0x15FF, 5, True),
        (0x1400, 4, False),
        (0x1400, 6, False),
        (0x1600, 5, False),
        (0x13FF, 5, False),
        (0x1800, 5, False),
    ):
        assert _deadline(outcome(index, sub)) is wanted


def test_what_watches_over_the_master_and_was_not_taken_is_told() -> None:
    watches = [(0x1016, 1), (0x6007, 0), (0x1400, 5), (0x1401, 5)]
    others = [(0x1017, 0), (0x6065, 0), (0x1018, 1), (0x1800, 5)]
    refused = {
        "hip": [outcome(*key, agrees=False) for key in others],
        "knee": [outcome(*key, agrees=False) for key in watches + others],
    }
    said = _lacking(refused).split("; ")
    told = [part for part in said if part.startswith("'")]
    assert [part.split()[:2] for part in told] == [
        ["'knee'", f"{index:04X}h:{sub:02X}"] for index, sub in watches
    ]
    assert _lacking({"hip": [outcome(*key) for key in watches]}) == ""


def test_a_heartbeat_is_told_unless_the_drive_holds_another() -> None:
    assert tells_heartbeat([])
    assert tells_heartbeat([outcome(0x1017), outcome(0x1016, 1, agrees=False)])
    assert not tells_heartbeat([outcome(0x1016, 1), outcome(0x1017, agrees=False)])


def test_a_protection_that_the_file_gives_no_value_for_is_told_once_for_all_drives() -> None:
    left = {key for key, _ in not_given(())}
    assert (0x1400, 5) in left
    assert (0x6085, 0) in left
    assert not {(0x6084, 0), (0x607D, 2)} & left
    # One ramp is enough, and any deadline of a command frame is.
    for ramp in ((0x6084, 0), (0x6085, 0)):
        assert not {(0x6084, 0), (0x6085, 0)} & {key for key, _ in not_given({ramp})}
    for key, given in (((0x1401, 5), True), ((0x1800, 5), False), ((0x1401, 4), False)):
        assert ((0x1400, 5) not in {one for one, _ in not_given({key})}) is given
    lines = unprotected({"hip": [outcome(0x6085)], "knee": [outcome(0x6085)]})
    deadline = [line for line in lines if "1400h:05" in line]
    assert len(deadline) == 1
    assert deadline[0].startswith("drives 'hip', 'knee', 1400h:05")
    (alone,) = [line for line in unprotected({"hip": []}) if "6085h" in line]
    assert alone.startswith("drive 'hip', 6085h:00")


# --- emulated drives -------------------------------------------------------------------------


def test_the_first_emergency_of_a_drive_waits_for_nothing() -> None:
    outlet = EmergencyOutlet({(0x1015, 0): 10})
    for _ in range(2):
        outlet.put(Frame(0x81), 0)
        assert outlet.take() == [(0, Frame(0x81))]
        outlet.clear()


def test_an_identity_is_asked_for_from_its_first_word_on() -> None:
    address = (0x123, 0x402, 5, 77)
    low = [*address[:2], 0, 9, 70, 80]

    def asks(*places: int) -> bytes | None:
        slave = LssSlave(address, 1)
        answer = None
        for place in places:
            answer = slave.feed(
                bytes((0x46 + place,)) + low[place].to_bytes(4, "little") + bytes(3)
            )
        return answer

    assert asks(0, 1, 2, 3, 4, 5) == bytes.fromhex("4f00000000000000")
    for places in ((5,), (0, 1, 2, 3, 4), (0, 1, 2, 3, 5), (1, 2, 3, 4, 5), (4, 5)):
        assert asks(*places) is None
    assert asks(5, 0, 1, 2, 3, 4, 5) is not None


def test_no_drive_stores_its_history_its_signatures_or_what_it_is_told_to_do() -> None:
    never: set[Key | int] = {0x1003, 0x1010, 0x1011, 0x6040, 0x6071, 0x607A}
    assert set(memory.NEVER) == never
    assert range(0x10000) == memory.ALL


# --- what is waived --------------------------------------------------------------------------

ENDLESS = (
    "or without end where they lack what stops them (1016h or 140xh:05, both with 6007h), which "
    "`legbench drives check` tells by their data sheet"
)


def test_every_waiver_says_what_it_costs() -> None:
    costs = {
        "quick-stop ramp": "a drive may run on beyond the springs before a quick stop has ended",
        "spring watch": "the springs of drives with one encoder may be wound beyond their limit",
        "drive heartbeat": "drives tell that they live every 20 ms",
        "master watch": f"drives may go on for 21 ms when their master is gone, {ENDLESS}",
    }
    for names in (tuple(costs), tuple(reversed(costs)), ("spring watch",), ()):
        bus = config(waive=names)
        wanted = tuple(f"the bus file waives the {name}: {costs[name]}" for name in names)
        assert describe_waivers(bus, None) == wanted
    assert describe_waivers(None, None) == ()


def test_a_limit_that_is_waived_is_told_with_its_usual_end_and_unit() -> None:
    waived = SafetyLimits(
        lost_frames=100, command_speed=200.0, waive=("lost_frames", "command_speed")
    )
    assert describe_waivers(None, waived) == (
        "the limits file waives the upper end of lost_frames: it is 100 cycles, the usual end 50 "
        "cycles",
        "the limits file waives the upper end of command_speed: it is 200 rad/s, the usual end "
        f"{LIMIT_ENDS['command_speed'][0]:g} rad/s",
    )
