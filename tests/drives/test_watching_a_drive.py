"""What a master knows of a drive beside the cycle: losses, heartbeats, emergencies, temperature."""

import math
import random
from dataclasses import replace

import pytest
from drives_rig import MS, config, node

from legbench.drives.master.axis_link import AxisLink
from legbench.drives.master.temperature import TemperaturePoll
from legbench.drives.master.watch import NodeWatch
from legbench.drives.protocol.datatypes import DataType
from legbench.drives.protocol.frame import Frame
from legbench.drives.protocol.pdo import Mapped
from legbench.drives.protocol.sdo import Abort, abort_data
from legbench.drives.setup.config import (
    CONTROLWORD,
    LINK_POSITION,
    POSITION_ACTUAL,
    STATUSWORD,
    TARGET_POSITION,
    NodeConfig,
    PdoConfig,
)
from legbench.drives.setup.units import AxisUnits, wrap

WHO = "drive 'knee' (node 2)"
NEVER = 1 << 30
LOST = 3


def watch(now_ns: int = 0, heartbeat_ms: int = 10) -> NodeWatch:
    return NodeWatch(replace(config(), heartbeat_ms=heartbeat_ms), node(1), now_ns)


def test_a_drive_has_gaps_until_two_cycles_in_a_row_were_complete() -> None:
    made, seen = watch(), []
    assert made.gaps is False
    for complete in (True, False, True, True, False, False, True, True):
        made.cycle(complete=complete)
        seen.append((made.gaps, made.missed))
    # An answer alone takes nothing back of what was missed.
    assert seen == [
        (False, 0),
        (True, 1),
        (True, 1),
        (False, 0),
        (True, 1),
        (True, 2),
        (True, 2),
        (False, 0),
    ]


@pytest.mark.parametrize("heartbeat_ms", [10, 25])
def test_a_drive_is_lost_after_three_heartbeats_have_not_come(heartbeat_ms: int) -> None:
    made = watch(5 * MS, heartbeat_ms)
    patience = 3 * heartbeat_ms * MS
    assert made.trouble(5 * MS + patience, NEVER) is None
    assert made.trouble(5 * MS + patience + 1, NEVER) == (
        "heartbeat lost",
        f"{WHO}: no heartbeat for {3 * heartbeat_ms} ms",
    )
    made.take_heartbeat(b"\x05", 100 * MS)
    assert made.trouble(100 * MS + patience, NEVER) is None
    # What is no heartbeat proves nothing.
    made.take_heartbeat(b"\x06", 200 * MS)
    made.take_heartbeat(b"\x05\x05", 200 * MS)
    assert made.trouble(101 * MS + patience, NEVER) is not None
    made.arm(300 * MS)
    assert made.trouble(300 * MS + patience, NEVER) is None
    assert made.trouble(2300 * MS, NEVER) == ("heartbeat lost", f"{WHO}: no heartbeat for 2000 ms")


@pytest.mark.parametrize(
    ("byte", "cause", "text"),
    [
        (0x00, "drive reset", "has started again; its configuration is gone"),
        (0x04, "drive left operational", "is stopped"),
        (0x05, None, ""),
        (0x7F, "drive left operational", "is pre_operational"),
    ],
)
def test_a_heartbeat_tells_of_a_drive_that_left_operational(
    byte: int, cause: str | None, text: str
) -> None:
    made = watch()
    made.take_heartbeat(bytes((byte,)), MS)
    assert made.trouble(MS, NEVER) == (None if cause is None else (cause, f"{WHO} {text}"))
    # A reset stays one, whatever the drive says afterwards; other states are as last heard.
    made.take_heartbeat(b"\x05", MS)
    assert (made.trouble(MS, NEVER) is None) == (byte != 0)
    made.take_heartbeat(bytes((byte,)), MS)
    made.arm(MS)
    assert made.state is None
    assert made.trouble(MS, NEVER) is None


def test_the_first_emergency_counts_and_all_are_remembered() -> None:
    made = watch()
    clear, over, under = bytes(8), bytes.fromhex("1043090000000000"), b"\x20\x32\x05" + bytes(5)
    made.take_emergency(clear)
    made.take_emergency(over[:7])
    assert made.trouble(0, NEVER) is None
    for data in (over, under, clear):
        made.take_emergency(data)
    text = f"{WHO}: EMCY 4310h drive over-temperature of node 2"
    assert made.trouble(0, NEVER) == ("drive emergency", text)
    assert [told.code for told in made.history] == [0x0000, 0x4310, 0x3220, 0x0000]
    made.arm(0)
    assert made.trouble(0, NEVER) is None
    assert len(made.history) == 4


def test_cycles_without_data_add_up_until_two_in_a_row_have_theirs() -> None:
    for pattern, missed in (
        ("", 0),
        ("-", 1),
        ("--", 2),
        ("---", 3),
        ("-+", 1),
        ("-++", 0),
        ("-+-+-", 3),
        ("-+-++-", 1),
        ("++++", 0),
    ):
        made = watch()
        for mark in pattern:
            made.cycle(complete=mark == "+")
        assert made.missed == missed, pattern
        assert made.lost_total == pattern.count("-")
        found = made.trouble(0, LOST)
        if missed < LOST:
            assert found is None
        else:
            text = f"{WHO} sent no process data for {missed} cycles, the limit is {LOST}"
            assert found == ("process data lost", text)


@pytest.mark.parametrize("seed", range(5))
def test_a_drive_is_looked_at_whenever_a_look_finds_something(seed: int) -> None:
    dice, made, found = random.Random(seed), watch(), 0
    for at_ms in range(300):
        now_ns = at_ms * MS
        event = dice.choices(
            ("cycle", "lost", "beat", "state", "emergency", "arm", "silent"),
            (60, 6, 6, 1, 1, 8, 1),
        )[0]
        match event:
            case "cycle" | "lost":
                made.cycle(complete=event == "cycle")
            case "beat" | "state":
                byte = 5 if event == "beat" else dice.choice((0, 4, 5, 0x7F))
                made.take_heartbeat(bytes((byte,)), now_ns)
            case "emergency":
                made.take_emergency(dice.choice((b"\x10\x23", b"\x00\x00")) + bytes(6))
            case "arm":
                made.arm(now_ns)
            case _:
                made.expects_heartbeat = not made.expects_heartbeat
        found += made.trouble(now_ns, 1) is not None
        if now_ns <= made.well_until_ns:
            assert made.trouble(now_ns, 1) is None
        else:
            # It is looked at for a reason, even where one loss is not yet too many.
            assert made.trouble(now_ns, 1) is not None
    assert 30 < found < 270


def test_a_drive_in_order_is_looked_at_when_its_heartbeat_is_overdue_and_not_before() -> None:
    made = watch(5 * MS)
    assert made.well_until_ns == 35 * MS
    made.take_heartbeat(b"\x05", 12 * MS)
    assert made.well_until_ns == 42 * MS
    made.expects_heartbeat = False
    assert made.well_until_ns == math.inf
    assert made.trouble(1 << 63, 1) is None


def test_arming_forgets_all_that_was_before() -> None:
    made = watch()
    assert (made.missed, made.lost_total, made.bad_total) == (0, 0, 0)
    made.cycle(complete=False)
    made.bad_total = 4
    made.arm(0)
    assert (made.missed, made.lost_total, made.bad_total) == (0, 0, 0)


# --- temperature -----------------------------------------------------------------------------

TEMPERATURE = Mapped(0x2070, 0, DataType.INTEGER16)
READ = bytes.fromhex("4070200000000000")
WARM = bytes.fromhex("4b70200071010000")
"""36.9 deg C."""


@pytest.mark.parametrize("node_id", [1, 2, 127])
def test_a_drive_is_asked_for_its_temperature_every_200_cycles(node_id: int) -> None:
    poll = TemperaturePoll(replace(node(0), node_id=node_id, temperature_object=TEMPERATURE))
    asked = [cycle for cycle in range(1000) if poll.due(cycle) is not None]
    assert asked == [0, 200, 400, 600, 800]
    assert poll.due(1000) == Frame(0x600 + node_id, READ)


def test_a_drive_without_the_object_is_never_asked() -> None:
    poll = TemperaturePoll(replace(node(0), temperature_object=None))
    assert [poll.due(cycle) for cycle in range(400)] == [None] * 400
    poll.feed(WARM)
    assert poll.celsius is None


def test_a_temperature_is_a_tenth_of_its_object_and_unanswered_requests_count() -> None:
    poll = TemperaturePoll(replace(node(0), temperature_object=TEMPERATURE))
    poll.feed(WARM)
    assert (poll.celsius, poll.unanswered) == (None, 0)
    poll.due(0)
    assert poll.unanswered == 0
    poll.feed(bytes.fromhex("4b71200071010000"))
    assert poll.celsius is None
    poll.feed(WARM)
    assert poll.celsius == pytest.approx(36.9)
    poll.due(200)
    for count in (1, 2, 3):
        poll.due(200 * count + 200)
        assert poll.unanswered == count
    # An answer is one to the latest request; a second copy of it changes nothing.
    poll.feed(bytes.fromhex("4b702000ceff0000"))
    assert (poll.celsius, poll.unanswered) == (pytest.approx(-5.0), 0)
    poll.feed(WARM)
    assert poll.celsius == pytest.approx(-5.0)


def test_a_refused_or_unreadable_temperature_is_an_unanswered_request() -> None:
    for reply in (abort_data(Abort.NO_OBJECT, 0x2070, 0), bytes.fromhex("4f70200071000000")):
        poll = TemperaturePoll(replace(node(0), temperature_object=TEMPERATURE))
        poll.due(0)
        poll.feed(reply)
        poll.feed(WARM)
        assert poll.celsius is None
        poll.due(200)
        assert poll.unanswered == 1
        poll.feed(WARM)
        assert poll.celsius == pytest.approx(36.9)
        assert poll.unanswered == 0


# --- process data of one drive ---------------------------------------------------------------

MODE = Mapped(0x6060, 0, DataType.INTEGER8)
SPLIT = (
    PdoConfig(number=1, objects=(STATUSWORD, POSITION_ACTUAL)),
    PdoConfig(number=3, objects=(LINK_POSITION,)),
)
HERE = AxisUnits(counts_per_rev=1 << 20, offset_counts=777, sign=-1)
LINK = AxisUnits(counts_per_rev=1 << 18, offset_counts=-55)


def split_node() -> NodeConfig:
    """A drive whose answer comes in two frames."""
    return replace(node(1), motor=HERE, link=LINK, link_object=LINK_POSITION, tpdos=SPLIT)


def motor_frame(status: int, counts: int) -> bytes:
    return status.to_bytes(2, "little") + wrap(counts).to_bytes(4, "little", signed=True)


def link_frame(counts: int) -> bytes:
    return wrap(counts).to_bytes(4, "little", signed=True)


def test_a_cycle_is_fresh_once_every_frame_has_come_in_either_order() -> None:
    for order in ((0x182, 0x382), (0x382, 0x182)):
        axis = AxisLink(split_node())
        data = {0x182: motor_frame(0x0237, 1777), 0x382: link_frame(945)}
        assert axis.tpdo_ids == (0x182, 0x382)
        assert axis.rpdo_ids == (0x202,)
        assert not axis.known
        axis.begin_cycle()
        assert axis.missing_ids == (0x182, 0x382)
        assert axis.feed(order[0], data[order[0]])
        # Half an answer is none.
        assert (axis.fresh, axis.statusword, axis.known) == (False, 0, False)
        assert axis.missing_ids == (order[1],)
        assert axis.feed(order[1], data[order[1]])
        assert (axis.fresh, axis.known, axis.missing_ids) == (True, True, ())
        assert (axis.statusword, axis.state_text) == (0x0237, "operation enabled")
        assert axis.motor_pos == pytest.approx(HERE.to_rad(1777))
        axis.begin_cycle()
        assert not axis.fresh
        assert axis.missing_ids == (0x182, 0x382)


def test_a_frame_of_a_wrong_length_changes_nothing() -> None:
    axis = AxisLink(split_node())
    axis.feed(0x182, motor_frame(0x0237, 1777))
    axis.feed(0x382, link_frame(945))
    axis.begin_cycle()
    for length in (0, 5, 7, 8):
        assert not axis.feed(0x182, bytes(length))
    assert axis.missing_ids == (0x182, 0x382)
    assert (axis.statusword, axis.motor_counts) == (0x0237, 1777)


@pytest.mark.parametrize("turns", [-2000, -1, 0, 1, 2000])
def test_a_link_is_found_within_half_a_turn_of_its_motor_and_then_followed(turns: int) -> None:
    axis = AxisLink(node(1))
    motor, link = axis.node.motor, axis.node.link_units
    motor_counts, link_counts = 0, 0
    for step in range(40):
        angle = 2.0 * math.pi * turns + 0.3 * step
        motor_counts, link_counts = motor.to_counts(angle), link.to_counts(angle + 0.4)
        data = motor_frame(0x37, motor_counts)
        data += wrap(link_counts, 16).to_bytes(2, "little", signed=True)
        axis.begin_cycle()
        assert axis.feed(0x182, data)
        assert axis.motor_counts == motor_counts
        assert axis.link_counts == link_counts
        assert axis.link_pos - axis.motor_pos == pytest.approx(0.4, abs=1e-4)
    # After homing the motor's count is another one and the link's is not.
    axis.forget()
    assert not axis.known
    axis.begin_cycle()
    axis.feed(0x182, motor_frame(0x37, -500) + link_frame(0)[:2])
    assert axis.motor_counts == -500
    near = link.to_counts(motor.to_rad(-500))
    assert axis.link_counts == link.nearest(0, near)


def test_a_target_is_kept_unwrapped_and_sent_wrapped() -> None:
    axis = AxisLink(split_node())
    for counts in (0, 777, (1 << 31) - 1, (1 << 31) + 5, -(1 << 31) - 7):
        axis.aim(HERE.to_rad(counts))
        assert axis.target_counts == counts
        assert axis.target_pos == HERE.to_rad(counts)
        data = b"\x0f\x00" + wrap(counts).to_bytes(4, "little", signed=True)
        assert axis.frames(0x0F) == [(0x202, data)]
    axis.feed(0x182, motor_frame(0x37, 4321))
    axis.feed(0x382, link_frame(0))
    axis.aim_at_actual()
    assert axis.target_counts == 4321


def test_commands_in_other_layouts_say_the_same_with_the_mode_8() -> None:
    other = Mapped(0x60B1, 0, DataType.INTEGER32)
    layouts: tuple[tuple[tuple[Mapped, ...], ...], ...] = (
        ((TARGET_POSITION, CONTROLWORD),),
        ((CONTROLWORD, TARGET_POSITION, MODE),),
        ((CONTROLWORD, MODE), (TARGET_POSITION, other)),
        ((CONTROLWORD,), (TARGET_POSITION,)),
        ((CONTROLWORD, TARGET_POSITION), (MODE,)),
    )
    parts = {
        CONTROLWORD: b"\x1f\x00",
        TARGET_POSITION: (-70_000).to_bytes(4, "little", signed=True),
        MODE: b"\x08",
        other: bytes(4),
    }
    for layout in layouts:
        pdos = tuple(
            PdoConfig(number=number, objects=objects) for number, objects in enumerate(layout, 1)
        )
        axis = AxisLink(replace(node(0), rpdos=pdos))
        axis.target_counts = -70_000
        assert axis.frames(0x1F) == [
            (0x101 + 0x100 * number, b"".join(parts[entry] for entry in objects))
            for number, objects in enumerate(layout, 1)
        ]


def test_a_state_in_words_is_unknown_where_no_pattern_fits() -> None:
    axis = AxisLink(node(0))
    axis.statusword = 0x0001
    assert axis.state_text == "unknown state"
