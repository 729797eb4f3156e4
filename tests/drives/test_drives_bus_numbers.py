"""Every number of a bus and a limits file has two ends, and names that it takes no nonsense."""

from collections.abc import Mapping
from dataclasses import fields
from pathlib import Path

import pytest
from can_rig import BUS, LIMITS

from legbench.drives.setup.bus_file import (
    bus_from_mapping,
    limits_from_mapping,
    load_bus,
    load_limits,
)
from legbench.drives.setup.bus_numbers import BUS_NUMBERS
from legbench.drives.setup.cob_ids import FREE, check_cob_id
from legbench.drives.setup.config import BusConfig
from legbench.errors import ConfigError
from legbench.limits.safety import SafetyLimits
from legbench.limits.upper_ends import LIMIT_ENDS
from legbench.reading import read_toml

NONSENSE = (-5, 0, -0.0, float("nan"), float("inf"), -float("inf"), 10**19, 10**400, True, "1", [])
COUNTS = [name for name, (_, _, unit) in LIMIT_ENDS.items() if unit == "cycles"]


def bus(**changes: object) -> BusConfig:
    return bus_from_mapping({**read_toml(BUS), **changes})


def first_node(**changes: object) -> BusConfig:
    content = read_toml(BUS)
    content["node"][0] |= changes
    return bus_from_mapping(content)


@pytest.mark.parametrize("value", NONSENSE, ids=repr)
@pytest.mark.parametrize("name", [*BUS_NUMBERS, "heartbeat_ms", "tpdo_deadline_us", "start_speed"])
def test_no_number_of_a_bus_takes_nonsense(name: str, value: object) -> None:
    with pytest.raises(ConfigError, match=name):
        bus(**{name: value})


@pytest.mark.parametrize("value", NONSENSE, ids=repr)
@pytest.mark.parametrize("name", list(LIMIT_ENDS))
def test_no_limit_takes_nonsense(name: str, value: object) -> None:
    with pytest.raises(ConfigError, match=name):
        limits_from_mapping({name: value})


@pytest.mark.parametrize("name", [*BUS_NUMBERS, "heartbeat_ms", *COUNTS])
def test_no_count_takes_half_of_one(name: str) -> None:
    with pytest.raises(ConfigError, match=rf"{name} is 7\.5; it must be of type int"):
        limits_from_mapping({name: 7.5}) if name in COUNTS else bus(**{name: 7.5})


def test_every_number_of_both_files_is_in_a_table() -> None:
    kinds = {"int", "float"}
    named = {field.name for field in fields(BusConfig) if _plain(field.type) in kinds}
    own = {"tpdo_deadline_us", "start_speed", "heartbeat_ms", "stated_bitrate"}
    assert named - own == set(BUS_NUMBERS)
    assert {f.name for f in fields(SafetyLimits) if _plain(f.type) in kinds} == set(LIMIT_ENDS)


def _plain(kind: object) -> str:
    return str(getattr(kind, "__name__", kind)).split(" | ")[0]


@pytest.mark.parametrize(("name", "ends"), list(BUS_NUMBERS.items()))
def test_the_ends_of_a_bus_are_taken_and_no_more(name: str, ends: tuple[int, int, str]) -> None:
    low, high, _ = ends
    fits = {"period_us": {"tpdo_deadline_us": 100}}.get(name, {})
    if name not in ("master_id", "period_us"):
        assert getattr(bus(**{name: low}, **fits), name) == low
    assert getattr(bus(**{name: high}, **fits), name) == high
    for value in (low - 1, high + 1):
        with pytest.raises(ConfigError, match=rf"{name} is {value}.*; it must be {low:g} to"):
            bus(**{name: value})


@pytest.mark.parametrize(("name", "ends"), list(LIMIT_ENDS.items()))
def test_a_limit_beyond_its_end_is_waived_by_name(
    name: str, ends: tuple[float, float, str]
) -> None:
    usual, most, unit = ends
    kind = int if unit == "cycles" else float
    assert getattr(limits_from_mapping({name: kind(usual)}), name) == usual
    with pytest.raises(ConfigError, match=rf'{name} is .* {unit}, the upper end is .*"{name}"'):
        limits_from_mapping({name: kind(usual + 1)})
    waived = limits_from_mapping({name: kind(most), "waive": [name]})
    assert (getattr(waived, name), waived.waive) == (most, (name,))
    with pytest.raises(ConfigError, match=f"{name} is"):
        limits_from_mapping({name: kind(most + 1), "waive": [name]})


def test_a_waiver_has_a_name_that_is_known() -> None:
    for given in (["everything"], ["lost_frames"] * 2, [3], "lost_frames", {}):
        with pytest.raises(ConfigError, match="waive"):
            limits_from_mapping({"waive": given})
        with pytest.raises(ConfigError, match="waive"):
            bus(waive=given)


@pytest.mark.parametrize("name", ["motor_range", "joint_range"])
@pytest.mark.parametrize(
    "pairs",
    [
        [],
        [[-1.0, 1.0]],
        [[-1.0, 1.0]] * 3,
        [[-1.0, 1.0], [1.0]],
        [[-1.0, 1.0], [-1.0, float("nan")]],
        [[-1.0, 1.0], [-1.0, float("inf")]],
        [[-1.0, 1.0], [-1.0, True]],
        [[-1.0, 1.0], [-7.0, 1.0]],
        [[-1.0, 1.0], [1.0, 1.0]],
        [[-1.0, 1.0], [-1.0, 10**400]],
        [-1.0, 1.0],
        1.0,
    ],
    ids=repr,
)
def test_a_range_has_two_pairs_of_angles(name: str, pairs: object) -> None:
    with pytest.raises(ConfigError, match="range"):
        limits_from_mapping({name: pairs})


def reserved() -> Mapping[int, str]:
    """Numbers of CiA 301, table 38 and 40, written down by hand."""
    return {
        0x000: "NMT",
        0x001: "reserved",
        0x07F: "reserved",
        0x080: "SYNC",
        0x081: "EMCY of 1",
        0x0FF: "EMCY of 127",
        0x100: "TIME",
        0x101: "reserved",
        0x180: "reserved",
        0x580: "reserved",
        0x581: "SDO reply of 1",
        0x5FF: "SDO reply of 127",
        0x601: "SDO request of 1",
        0x67F: "SDO request of 127",
        0x6E0: "reserved",
        0x701: "heartbeat of 1",
        0x77F: "heartbeat of 127",
        0x780: "reserved",
        0x7FF: "reserved",
        0x800: "no 11 bits",
        1 << 31: "no 11 bits",
        -1: "no 11 bits",
    }


@pytest.mark.parametrize("key", ["rpdo", "tpdo"])
@pytest.mark.parametrize(("cob_id", "owner"), list(reserved().items()))
def test_an_identifier_of_another_service_is_refused(cob_id: int, owner: str, key: str) -> None:
    objects = {
        "rpdo": ["6040:00 u16", "607A:00 i32"],
        "tpdo": ["6041:00 u16", "6064:00 i32", "2064:00 i16"],
    }[key]
    pdo = {"number": 1, "objects": objects, "cob_id": cob_id}
    with pytest.raises(ConfigError, match=owner):
        first_node(**{key: [pdo]})


def test_every_identifier_is_free_or_refused() -> None:
    free = {cob_id for low, high in FREE for cob_id in range(low, high + 1)}
    for cob_id in range(0x800):
        if cob_id in free:
            check_cob_id(cob_id)
            continue
        with pytest.raises(ConfigError, match="process data may have 181h to 57Fh or 680h"):
            check_cob_id(cob_id)
    assert not free & set(reserved())


def test_two_users_of_an_identifier_are_named() -> None:
    rpdo = {"number": 1, "objects": ["6040:00 u16", "607A:00 i32"], "cob_id": 0x182}
    with pytest.raises(
        ConfigError, match="RPDO1 of 'motor1' and TPDO1 of 'motor2' share a COB-ID, 182h"
    ):
        first_node(rpdo=[rpdo])
    rpdos = [{"number": 1, "objects": ["6040:00 u16"]}, {"number": 1, "objects": ["607A:00 i32"]}]
    with pytest.raises(ConfigError, match=r"'motor1' has RPDOs \[1, 1\]; each once"):
        first_node(rpdo=rpdos)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"vendor": -1}, "vendor is -1; it must be 0 to"),
        ({"serial": 1 << 32}, "serial is 4294967296; it must be 0 to"),
        ({"name": "motor2"}, "names must differ"),
        ({"id": 126}, "master 126 must differ"),
        ({"temperature_scale": 0.0}, "temperature_scale is 0"),
        ({"temperature_scale": -0.1}, "temperature_scale is -0.1"),
        ({"temperature_scale": 11.0}, "temperature_scale is 11"),
        ({"heartbeat_consumer": 1}, "heartbeat_consumer is 1; it must be of type bool"),
        ({"temperature_object": "2070:00 str"}, "2070h:00 is text"),
        ({"parameters": {"6098:00 i8": 200}}, "6098h:00.* is 200, but its type INTEGER8 holds"),
        ({"parameters": {"6085:00 u32": -1}}, "6085h:00.* is -1, but its type"),
        ({"parameters": {"60fd:00 u32": 1, "60FD:00 u32": 2}}, "60FDh:00.* twice"),
        ({"motor": {"counts_per_rev": 10**12}}, "counts_per_rev is 1000000000000; .* at most"),
        ({"motor": {"counts_per_rev": 1, "gear": 1e9}}, r"gear is 1e\+09; it must be positive"),
        ({"motor": {"counts_per_rev": 1, "offset_counts": 1 << 31}}, "offset_counts is 2147483648"),
    ],
)
def test_no_number_of_a_node_takes_nonsense(changes: dict[str, object], words: str) -> None:
    with pytest.raises(ConfigError, match=words):
        first_node(**changes)


def test_the_shipped_files_waive_nothing() -> None:
    assert load_bus(BUS).waive == load_limits(LIMITS).waive == ()


def test_a_file_of_nonsense_is_named(tmp_path: Path) -> None:
    path = tmp_path / "limits.toml"
    path.write_text("lost_frames = 1_000_000\n", encoding="utf-8")
    with pytest.raises(ConfigError, match=r"limits\.toml: lost_frames is 1e\+06 cycles, the upper"):
        load_limits(path)
