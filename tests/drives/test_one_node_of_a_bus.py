"""One node of a bus: its soft limits, its torque, its frames, and what parks it."""

import math
from configparser import ConfigParser
from dataclasses import replace
from typing import Any, cast

import can
import pytest
from drives_rig import MS, config, node
from object_tables import Objects

from legbench.drives.master.parking import is_parked, park, parked
from legbench.drives.master.port import Port
from legbench.drives.protocol.datatypes import DataType
from legbench.drives.protocol.pdo import Mapped
from legbench.drives.setup.config import (
    CONTROLWORD,
    POSITION_ACTUAL,
    STATUSWORD,
    TARGET_POSITION,
    NodeConfig,
    Parameter,
    PdoConfig,
)
from legbench.drives.setup.configuration import configuration
from legbench.drives.setup.eds import eds_text
from legbench.errors import ConfigError

TORQUE = Mapped(0x6077, 0, DataType.INTEGER16)
SPLIT = (
    PdoConfig(number=1, objects=(CONTROLWORD,), deadline_ms=20),
    PdoConfig(number=2, objects=(TARGET_POSITION,), deadline_ms=20),
)


def test_soft_limits_have_a_lower_and_a_higher_end() -> None:
    for low, high in ((1.0, 1.0), (1.0, 0.5), (math.nan, 1.0), (0.0, math.nan), (0.0, math.inf)):
        with pytest.raises(ConfigError, match=r"soft_limits is .* low must be below high"):
            replace(node(0), soft_limits=(low, high))
    for place in (0, 1):
        units = node(place).motor
        limits = replace(node(place), soft_limits=(-0.5, 1.5)).soft_limits_counts
        assert limits == tuple(sorted(map(units.to_counts, (-0.5, 1.5))))


@pytest.mark.parametrize("end", [-1, 1])
def test_soft_limits_are_counts_that_607dh_holds_either_way(end: int) -> None:
    most = (1 << 31) - 1
    units = node(0).motor
    for counts, fits in ((end * most, True), (end * (most + 1), False)):
        angle = (counts - units.offset_counts) / units.counts_per_rad
        assert units.to_counts(angle) == counts
        soft = (angle, 0.0) if end < 0 else (0.0, angle)
        if fits:
            assert counts in (replace(node(0), soft_limits=soft).soft_limits_counts or ())
        else:
            words = rf"{counts}.* counts; 607Dh holds -{most} to {most}:"
            with pytest.raises(ConfigError, match=words):
                replace(node(0), soft_limits=soft)


def test_a_torque_needs_its_scale_and_no_torque_needs_none() -> None:
    tpdo = (PdoConfig(number=1, objects=(STATUSWORD, POSITION_ACTUAL, TORQUE)),)
    assert node(0).torque_scale == 0.0
    with pytest.raises(ConfigError, match="torque_scale is 0"):
        replace(node(0), link=None, torque_object=TORQUE, tpdos=tpdo)


@pytest.mark.parametrize("words", ["RPDO", "TPDO"])
@pytest.mark.parametrize("place", [0, 1])
def test_a_frame_of_a_drive_has_a_number_of_its_own(words: str, place: int) -> None:
    more = Mapped(0x60B1, 0, DataType.INTEGER32)
    twice = PdoConfig(number=1, objects=(more,), cob_id=0x3F0)
    nodes = [node(0), node(1)]
    kept = nodes[place].rpdos if words == "RPDO" else nodes[place].tpdos
    changed: dict[str, Any] = {f"{words.lower()}s": (*kept, twice)}
    nodes[place] = replace(nodes[place], **changed)
    with pytest.raises(ConfigError, match=rf"'{nodes[place].name}' has {words}s \[1, 1\]"):
        config(nodes=tuple(nodes))


def test_a_deadline_is_written_for_commands_alone() -> None:
    answers = tuple(replace(pdo, deadline_ms=7) for pdo in node(0).tpdos)
    drive = replace(node(0), rpdos=SPLIT, tpdos=answers)
    told = [entry.key for entry in configuration(config(), drive) if entry.sub == 5]
    assert told == [(0x1400, 5), (0x1401, 5)]
    unwatched = replace(drive, rpdos=tuple(replace(pdo, deadline_ms=0) for pdo in SPLIT))
    assert not [entry for entry in configuration(config(), unwatched) if entry.sub == 5]


def test_arrays_of_a_data_sheet_are_those_of_the_standard() -> None:
    found = ConfigParser(interpolation=None)
    found.read_string(eds_text())
    kinds = {name: found[name].get("ObjectType") for name in found.sections()}
    arrays = {name for name, kind in kinds.items() if kind == "0x8"}
    # CiA 301, 7.5.2, and CiA 402-2: numbered values of one kind.
    assert arrays == {"1003", "1010", "1011", "1016", "1029", "607D", "6099", "60E4"}


# --- parking ---------------------------------------------------------------------------------


def parking(it: Objects, nodes: tuple[NodeConfig, ...], *powered: str) -> list[str]:
    """Lines that parking says of drives whose objects are a table."""
    for place, each in enumerate(nodes):
        for entry in parked(each):
            it.tables[place].setdefault(entry.key, 0x200 + place)
    port = Port(cast(Any, it), it)
    heard = list[can.Message]()
    return park(port, config(nodes=nodes), heard.append, powered)


def test_all_command_frames_of_all_drives_are_switched_off_and_read_back() -> None:
    it = Objects()
    nodes = (node(0), replace(node(1), rpdos=SPLIT))
    assert parking(it, nodes) == []
    off = -(1 << 31)
    wanted = [(0, 0x1400, 1, off + 0x201), (1, 0x1400, 1, off + 0x202), (1, 0x1401, 1, off + 0x302)]
    assert it.wrote == wanted
    assert it.asked == [entry[:3] for entry in wanted]


def test_a_drive_that_keeps_its_power_is_left_out_and_all_others_are_parked() -> None:
    it = Objects()
    said = ["drive 'hip' (node 1) is not parked, because it has kept its power"]
    assert parking(it, (node(0), node(1)), "hip") == said
    assert [place for place, *_ in it.wrote] == [1]
    both = parking(Objects(), (node(0), node(1)), "hip", "knee")
    assert [line.split("'")[1] for line in both] == ["hip", "knee"]


def test_a_frame_that_stays_on_is_told_and_so_is_a_drive_that_refuses() -> None:
    it = Objects()
    it.keeps = {(0x1401, 1)}
    nodes = (replace(node(0), rpdos=SPLIT), replace(node(1), rpdos=SPLIT))
    assert parking(it, nodes) == [
        "drive 'hip' (node 1) keeps its commands switched on: 1401h:01 is 00000200h",
        "drive 'knee' (node 2) keeps its commands switched on: 1401h:01 is 00000201h",
    ]
    it = Objects()
    it.aborts = {(0x1400, 1): 0x08000022}
    lines = parking(it, nodes)
    assert [line.split(":")[0] for line in lines] == [
        "drive 'hip' (node 1) is not parked",
        "drive 'knee' (node 2) is not parked",
    ]


def test_an_object_of_a_parked_drive_differs_by_one_bit_in_one_place() -> None:
    drive = replace(node(1), rpdos=SPLIT)
    off = 1 << 31
    for index, first in ((0x1400, 0x202), (0x1401, 0x302)):
        entry = Parameter(index=index, sub=1, kind=DataType.UNSIGNED32, value=first)
        assert is_parked(drive, entry, off | first)
        for there in (first, off | (first ^ 1), off | (first ^ 0x100), 0):
            assert not is_parked(drive, entry, there)
    for key in ((0x1402, 1), (0x1800, 1), (0x1400, 2)):
        entry = Parameter(index=key[0], sub=key[1], kind=DataType.UNSIGNED32, value=0x202)
        assert not is_parked(drive, entry, off | 0x202)


# --- a port ----------------------------------------------------------------------------------


def test_nobody_is_waited_for_beyond_the_end_by_frames_that_say_nothing() -> None:
    class Waiting:
        """Two extended frames and one for us, all there already, at a time that stands still."""

        channel_info = "waiting"

        def __init__(self) -> None:
            self.frames = [
                can.Message(arbitration_id=0x181, is_extended_id=extended)
                for extended in (True, True, False)
            ]

        def now_ns(self) -> int:
            return MS

        def recv(self, timeout: float | None = None) -> can.Message | None:
            assert timeout == 0.0
            return self.frames.pop(0) if self.frames else None

    for until_ns in (MS, 0):
        bus = Waiting()
        port = Port(cast(Any, bus), cast(Any, bus))
        assert port.receive(until_ns) is None
        assert len(bus.frames) == 2
        taken = port.take()
        assert taken is not None
        assert not taken.is_extended_id
