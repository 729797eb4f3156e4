"""Ends of the numbers of a bus file, written down once more; and what a file may leave out."""

from dataclasses import replace
from typing import Any

import pytest
from can_rig import BUS
from drives_rig import config

from legbench.drives.setup import asking, bus_numbers
from legbench.drives.setup.asking import latest_request_us
from legbench.drives.setup.building import finite
from legbench.drives.setup.bus_file import (
    bus_from_mapping,
    format_object,
    limits_from_mapping,
    parse_object,
)
from legbench.drives.setup.bus_numbers import check_bus_numbers, check_start_speed
from legbench.drives.setup.pdos import PdoConfig
from legbench.errors import ConfigError
from legbench.reading import read_toml

ENDS = {
    "bitrate": (10_000, 1_000_000),
    "period_us": (200, 20_000),
    "reply_delay_us": (1, 10_000),
    "master_id": (1, 127),
    "master_heartbeat_ms": (1, 21_845),
    "sdo_timeout_ms": (1, 10_000),
    "sdo_retries": (1, 10),
    "settle_cycles": (1, 1000),
    "enable_spread_ms": (1, 500),
}
USUAL = {name: low for name, (low, _) in ENDS.items()} | {"heartbeat_ms": 10}


@pytest.mark.parametrize(("name", "ends"), list(ENDS.items()))
def test_every_number_of_a_bus_has_the_ends_that_are_written_here(
    name: str, ends: tuple[int, int]
) -> None:
    low, high = ends
    for value in (low, high):
        check_bus_numbers(USUAL | {name: value}, ())
    for value in (low - 1, high + 1):
        with pytest.raises(ConfigError, match=f"{name} is {value}"):
            check_bus_numbers(USUAL | {name: value}, ())


@pytest.mark.parametrize(("waived", "end"), [((), 100), (("drive heartbeat",), 2000)])
def test_a_heartbeat_of_a_drive_is_faster_than_100_ms_or_waived(
    waived: tuple[str, ...], end: int
) -> None:
    for beat in (1, end):
        check_bus_numbers(USUAL | {"heartbeat_ms": beat}, waived)
    for beat in (0, end + 1):
        with pytest.raises(ConfigError, match=f"heartbeat_ms is {beat} ms.*most {end} ms") as told:
            check_bus_numbers(USUAL | {"heartbeat_ms": beat}, waived)
        assert ("or waive" in str(told.value)) is (not waived)


def test_a_start_is_slower_than_5_rad_per_second() -> None:
    for speed in (1e-9, 5.0):
        check_start_speed(speed)
    for speed in (0.0, -1.0, 5.0000001, float("nan")):
        with pytest.raises(ConfigError, match=r"start_speed is .* above 0 and at most 5"):
            check_start_speed(speed)


def test_periods_of_a_run_are_1_2_and_4_ms() -> None:
    assert bus_numbers.RUN_PERIODS_US == (1000, 2000, 4000)
    assert (bus_numbers.WORD, bus_numbers.LONG) == (65_535, 4_294_967_295)


def test_a_number_of_a_file_is_smaller_than_1e18() -> None:
    for value in (0, -5, 0.999e18, -(10**18 - 1), 1.5):
        assert finite("bus", "gear", value) == value
    for value, said in (
        (1e18, r"1e\+18"),
        (-1e18, r"-1e\+18"),
        (float("inf"), "inf"),
        (float("nan"), "nan"),
        (10**18, "too large"),
        (-(10**400), "too large"),
    ):
        with pytest.raises(ConfigError, match=rf"^bus: gear is {said}; .* below 1e\+18"):
            finite("bus", "gear", value)


def test_both_ranges_of_the_knee_are_read_as_pairs() -> None:
    ranges: dict[str, Any] = {"motor_knee_range": [0.25, 2.5], "joint_knee_range": [0.5, 2.25]}
    found = limits_from_mapping(ranges)
    assert found.motor_knee_range == (0.25, 2.5)
    assert found.joint_knee_range == (0.5, 2.25)
    for name in ranges:
        with pytest.raises(ConfigError, match=rf"{name} needs pairs \[low, high\] in rad"):
            limits_from_mapping(ranges | {name: [0.25]})


def test_every_name_of_a_waiver_is_a_name() -> None:
    for given in (["lost_frames", 3], [3, "lost_frames"], [3]):
        with pytest.raises(ConfigError, match="'waive' must be a list of names"):
            limits_from_mapping({"waive": given})


def test_commands_that_are_not_given_hold_the_target_of_the_drive() -> None:
    content = read_toml(BUS)
    for table in content["node"]:
        table.pop("rpdo", None)
    content["node"][0]["target_object"] = "2345:01 i32"
    first, second = bus_from_mapping(content).nodes
    for node, target in ((first, "2345:01 i32"), (second, "607A:00 i32")):
        (pdo,) = node.rpdos
        assert [format_object(entry) for entry in pdo.objects] == ["6040:00 u16", target]
        assert (pdo.number, pdo.deadline_ms) == (1, 20)


# --- requests beside the cycle ---------------------------------------------------------------


def bits(size: int) -> int:
    """Longest classic CAN frame with an identifier of 11 bits (ISO 11898-1), stuffed."""
    return 47 + 8 * size + (34 + 8 * size - 1) // 4


def test_a_request_leaves_in_time_for_the_fuller_channel() -> None:
    assert asking.PATIENCE_MS == 100
    assert asking.SDO_BYTES == 8
    heartbeats = 2 * bits(8) + bits(1)
    for reply_us, bitrate in ((100, 1_000_000), (250, 1_000_000), (100, 500_000)):
        # A second drive with a second command frame, which sends more than it waits.
        more = PdoConfig(
            number=2, objects=(parse_object("60B1:00 i32"), parse_object("60B2:00 i16"))
        )
        plain = config(reply_delay_us=reply_us, bitrate=bitrate, period_us=4000)
        full = replace(plain.nodes[1], rpdos=(*plain.nodes[1].rpdos, more))
        first, wide = plain.nodes[0].rpdos, full.rpdos
        sizes = [sum(bits(6) for _ in first), sum(bits(6) for _ in wide)]
        assert sizes == [bits(6), 2 * bits(6)]
        waits = [max(reply_us, 1e6 * size / bitrate) for size in sizes]
        latest = [int(4000 - 1e6 * heartbeats / bitrate - wait) for wait in waits]
        assert latest[1] <= latest[0]
        for order in ((0, 1), (1, 0)):
            nodes = [replace(plain.nodes[0], channel="a"), replace(full, channel="b")]
            bus = replace(plain, nodes=tuple(nodes[place] for place in order))
            assert latest_request_us(bus) == min(latest)
        together = replace(plain, nodes=(plain.nodes[0], full))
        wait = max(reply_us, 1e6 * sum(sizes) / bitrate)
        assert latest_request_us(together) == int(4000 - 1e6 * heartbeats / bitrate - wait)
