"""What a bus is where its file says nothing, and what its numbers may be at the very least."""

import math
from dataclasses import replace
from datetime import datetime
from typing import Any

import pytest
from drives_rig import config, node

from legbench.drives.protocol.datatypes import DataType
from legbench.drives.protocol.pdo import Mapped
from legbench.drives.setup.config import BusConfig
from legbench.drives.setup.eds import eds_text, stamps_of
from legbench.drives.setup.field_ranges import check_field_ranges
from legbench.drives.setup.parameters import Parameter, check_parameter
from legbench.drives.setup.units import AxisUnits
from legbench.errors import ConfigError
from legbench.limits.safety import SafetyLimits

FREE = (-math.inf, math.inf)


def test_a_bus_whose_file_says_nothing_is_this_one() -> None:
    bus = BusConfig(nodes=(node(0), node(1)))
    assert (bus.interface, bus.channel, bus.bitrate, bus.stated_bitrate) == (
        *(None, None),
        *(1_000_000, None),
    )
    assert (bus.period_us, bus.reply_delay_us, bus.deadline_us) == (1000, 250, 720)
    assert (bus.master_id, bus.heartbeat_ms, bus.master_heartbeat_ms) == (126, 20, 10)
    assert (bus.sdo_timeout_ms, bus.sdo_retries) == (200, 3)
    assert (bus.settle_cycles, bus.enable_spread_ms, bus.start_speed) == (20, 100, 2.0)
    assert bus.waive == ()


def test_a_deadline_lies_within_the_period() -> None:
    for period_us in (1000, 2000):
        for deadline_us, taken in (
            (0, False),
            (1, True),
            (period_us - 1, True),
            (period_us, False),
        ):
            changes = {"period_us": period_us, "tpdo_deadline_us": deadline_us}
            if taken:
                assert config(**changes).deadline_us == deadline_us
            else:
                with pytest.raises(ConfigError, match="tpdo_deadline_us is"):
                    config(**changes)


@pytest.mark.parametrize("name", ["motor_object", "target_object"])
def test_each_object_of_a_motor_holds_as_many_bits_as_its_encoder(name: str) -> None:
    short = {"motor_object": 0x6064, "target_object": 0x607A}
    changes: dict[str, Any] = {name: Mapped(short[name], 0, DataType.INTEGER16)}
    with pytest.raises(ConfigError, match=f"{short[name]:04X}h"):
        replace(node(0), **changes)


def test_the_data_sheet_of_the_emulated_drives_is_the_same_on_every_day() -> None:
    text = eds_text()
    assert "CreationDate=11-22-2026\n" in text
    assert "CreationTime=01:27PM\n" in text
    stamps = stamps_of(text)
    assert stamps is not None
    assert stamps.created == stamps.modified == datetime(2026, 11, 22, 13, 27)


# --- ranges ----------------------------------------------------------------------------------


def refused(place: int, led: Any = FREE, joint: Any = FREE, **changes: Any) -> str | None:
    """What is said against the ranges of one joint, whose drive is changed."""
    nodes = [node(0), node(1)]
    nodes[place] = replace(nodes[place], **changes)
    ranges: dict[str, Any] = {"motor_range": [FREE, FREE], "joint_range": [FREE, FREE]}
    ranges["motor_range"][place], ranges["joint_range"][place] = led, joint
    try:
        check_field_ranges(config(nodes=tuple(nodes)), SafetyLimits(**ranges))
    except ConfigError as error:
        return str(error)
    return None


@pytest.mark.parametrize("place", [0, 1])
def test_a_link_may_not_show_one_count_at_two_places(place: int) -> None:
    lap, name = 2.0 * math.pi, ("hip", "knee")[place]
    for high, taken in ((math.nextafter(lap, 0.0), True), (lap, False)):
        told = refused(place, joint=(0.0, high))
        assert (told is None) is taken
        assert taken or str(told).startswith(f"link of '{name}': ")
    # A range that is open on one side is none.
    assert refused(place, joint=(0.0, math.inf)) is None
    assert refused(place, joint=(-math.inf, 0.0)) is None
    assert refused(place, joint=(0.0, lap), link=None) is None


@pytest.mark.parametrize("place", [0, 1])
@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_a_motor_shows_its_range_and_200_mrad_beyond_either_end(place: int, side: float) -> None:
    # The last count of 32 bits is at 1.2 rad; the knee counts the other way.
    gear = ((1 << 31) - 1) / 1.2 * math.tau / (1 << 30)
    units = AxisUnits(counts_per_rev=1 << 30, gear=gear, sign=1 - 2 * place)
    name = ("hip", "knee")[place]
    for end, taken in ((0.999, True), (1.001, False)):
        led = tuple(sorted((-0.5 * side, end * side)))
        told = refused(place, led, motor=units)
        assert (told is None) is taken
        assert taken or str(told).startswith(f"motor of '{name}': its range")
    assert refused(place, (-math.inf, 5.0), motor=units) is None
    assert refused(place, (-5.0, math.inf), motor=units) is None


# --- objects that a bus file may give ----------------------------------------------------------

WRITTEN, MEMORY = "is written by itself", "would wear out the drive's memory"
SERVICE, DROPS = "moves a service of CiA 301", "lets the leg drop: give 1 to 4"


@pytest.mark.parametrize(
    ("first", "last", "said"),
    [
        *((0x1005, 0x1006, WRITTEN), (0x1010, 0x1011, MEMORY), (0x1012, 0x1012, SERVICE)),
        *((0x1014, 0x1014, SERVICE), (0x1016, 0x1017, WRITTEN), (0x1029, 0x1029, WRITTEN)),
        *((0x1200, 0x12FF, SERVICE), (0x1400, 0x1BFF, WRITTEN), (0x6007, 0x6007, WRITTEN)),
        *((0x6040, 0x6040, WRITTEN), (0x605A, 0x605A, WRITTEN), (0x605B, 0x605E, DROPS)),
        *((0x6060, 0x6060, WRITTEN), (0x607A, 0x607A, WRITTEN)),
        (0x607D, 0x607D, "would not move with offset_counts"),
        *((0x60B0, 0x60B0, WRITTEN), (0x60C2, 0x60C2, WRITTEN)),
    ],
)
def test_objects_that_are_written_otherwise_are_refused_from_their_first_to_their_last(
    first: int, last: int, said: str
) -> None:
    for index in (first, last):
        parameter = Parameter(index=index, sub=0, kind=DataType.INTEGER16, value=0)
        with pytest.raises(ConfigError, match=said):
            check_parameter("hip", parameter)


def test_the_neighbours_of_such_objects_may_be_given() -> None:
    beside = (0x1004, 0x1007, 0x100F, 0x1013, 0x1015, 0x1018, 0x1028, 0x102A, 0x11FF, 0x1300)
    beside += (0x13FF, 0x1C00, 0x6006, 0x6008, 0x603F, 0x6041, 0x6059, 0x605F, 0x6061, 0x6079)
    beside += (0x607B, 0x607C, 0x607E, 0x60AF, 0x60B1, 0x60C1, 0x60C3)
    for index in beside:
        check_parameter("hip", Parameter(index=index, sub=0, kind=DataType.INTEGER16, value=0))
