"""Ends of the numbers of a bus file, written down once more; and what a file may leave out."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any, cast

import pytest
from can_rig import BUS, LIMITS
from drives_rig import config

from legbench.drives.setup import asking, bus_numbers, checks
from legbench.drives.setup.asking import latest_request_us
from legbench.drives.setup.building import finite
from legbench.drives.setup.bus_file import (
    bus_from_mapping,
    format_object,
    limits_from_mapping,
    load_bus,
    load_limits,
    parse_object,
)
from legbench.drives.setup.bus_numbers import check_bus_numbers, check_start_speed
from legbench.drives.setup.checks import _check_cycles, check_together
from legbench.drives.setup.cob_ids import check_cob_id
from legbench.drives.setup.config import BusConfig
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


# --- both files together ---------------------------------------------------------------------


def with_deadlines(place: int, number: int, deadline_ms: int, period_us: int) -> BusConfig:
    """The bench's bus with a second command frame, one of them with another deadline."""
    bus = load_bus(BUS)
    second = PdoConfig(number=2, objects=(parse_object("60B1:00 i32"),), deadline_ms=20)
    nodes = [replace(node, rpdos=(*node.rpdos, second)) for node in bus.nodes]
    rpdos = list(nodes[place].rpdos)
    rpdos[number] = replace(rpdos[number], deadline_ms=deadline_ms)
    nodes[place] = replace(nodes[place], rpdos=tuple(rpdos))
    return replace(bus, nodes=tuple(nodes), period_us=period_us, tpdo_deadline_us=None)


@pytest.mark.parametrize("place", [0, 1])
@pytest.mark.parametrize("number", [0, 1])
def test_every_deadline_of_every_drive_has_room_for_three_periods(place: int, number: int) -> None:
    limits = load_limits(LIMITS)
    for deadline_ms, period_us, most_ms in ((2, 667, 3), (11, 4000, 12)):
        words = rf"RPDO{number + 1} of 'motor{place + 1}' is {deadline_ms} ms.*to {most_ms} or more"
        with pytest.raises(ConfigError, match=words):
            _check_cycles(with_deadlines(place, number, deadline_ms, period_us), limits)
    for deadline_ms, period_us in ((0, 4000), (12, 4000), (3, 667)):
        _check_cycles(with_deadlines(place, number, deadline_ms, period_us), limits)


@pytest.mark.parametrize("name", ["following_cycles", "overrun_cycles", "lost_frames"])
def test_no_limit_in_cycles_lasts_longer_than_50_ms(name: str) -> None:
    few = {"following_cycles": 1, "overrun_cycles": 1, "lost_frames": 1}
    for period_us, most in ((1000, 50), (2000, 25), (667, 74)):
        bus = replace(load_bus(BUS), period_us=period_us, tpdo_deadline_us=None)

        def judge(cycles: int, *waive: str, bus: BusConfig = bus) -> None:
            # Limits of a file have an end of their own, which no period is part of.
            _check_cycles(bus, cast(Any, SimpleNamespace(**few | {name: cycles}, waive=waive)))

        judge(most)
        judge(most + 1, name)
        words = rf"{name} is {most + 1} cycles.* upper end is 50 ms: lower it to {most},"
        with pytest.raises(ConfigError, match=words):
            judge(most + 1)


def test_drives_that_are_led_have_to_notice_the_death_of_their_master(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    asked: list[tuple[str, float | None]] = []
    monkeypatch.setattr(checks, "check_springs", lambda config: asked.append(("springs", None)))
    monkeypatch.setattr(
        checks, "check_master_watch", lambda config, speed: asked.append(("master", speed))
    )
    bus, limits = load_bus(BUS), load_limits(LIMITS)
    check_together(bus, limits, leads=False)
    assert asked == []
    check_together(bus, limits)
    assert asked == [("springs", None), ("master", limits.command_speed)]


def test_an_identifier_is_named_in_hexadecimal_or_as_it_is() -> None:
    for cob_id, words in ((0, "cob_id 000h is NMT"), (-1, "cob_id -1 has no 11 bits")):
        with pytest.raises(ConfigError, match=words):
            check_cob_id(cob_id)


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
