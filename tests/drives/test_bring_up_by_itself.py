"""The bring-up question by question, with two drives that are no more than a table of objects."""

from dataclasses import replace
from typing import Any, cast

import can
import pytest
from drives_rig import MS, config, node
from object_tables import NO_OBJECT, Objects

from legbench.drives.errors import BusError, DriveError, SdoAbortError
from legbench.drives.master.bring_up import BringUp
from legbench.drives.master.port import Port
from legbench.drives.protocol.datatypes import DataType, pack
from legbench.drives.protocol.pdo import Mapped
from legbench.drives.setup.configuration import configuration
from legbench.drives.setup.needs import Need, row_of
from legbench.drives.setup.quirks import Quirks

NAMES = ("hip", "knee")
NO_SUB_INDEX, GENERAL, HARDWARE = 0x06090011, 0x08000000, 0x06060000

# --- who is there ----------------------------------------------------------------------------


def test_drives_that_the_bus_file_means_are_asked_and_nothing_is_written() -> None:
    it = Objects()
    it.bring_up().identify()
    for place in (0, 1):
        asked = [(index, sub) for at, index, sub in it.asked if at == place]
        assert asked == [(0x1000, 0), *((0x1018, sub) for sub in (1, 2, 3, 4)), (0x6502, 0)]
    assert not it.wrote
    it = Objects()
    it.bring_up().identify(config().nodes[1:])
    assert {place for place, _, _ in it.asked} == {1}


@pytest.mark.parametrize("place", [0, 1])
def test_a_node_that_is_no_such_drive_is_named(place: int) -> None:
    who = rf"^node {place + 1} \('{NAMES[place]}'\)"
    # The low word of the device type is the profile, the high one what kind of drive it is.
    for device, fits in ((0xFFFF0192, True), (0x00000192, True), (0x00020191, False)):
        it = Objects()
        it.tables[place][0x1000, 0] = device
        if fits:
            it.bring_up().identify()
            continue
        with pytest.raises(DriveError, match=rf"{who} is no CiA 402 drive: .* {device:08X}h"):
            it.bring_up().identify()
    # Bit 7 of 6502h is cyclic synchronous position.
    for modes, fits in ((0x80, True), (0x3FF, True), (0x7F, False), (0x100, False)):
        it = Objects()
        it.tables[place][0x6502, 0] = modes
        if fits:
            it.bring_up().identify()
            continue
        with pytest.raises(DriveError, match=rf"{who} knows no cyclic synchronous position mode"):
            it.bring_up().identify()


@pytest.mark.parametrize("place", [0, 1])
@pytest.mark.parametrize("sub", [1, 2, 3, 4])
def test_each_part_of_an_identity_is_compared_where_the_bus_file_gives_it(
    place: int, sub: int
) -> None:
    name = ("vendor", "product", "revision", "serial")[sub - 1]
    it = Objects()
    it.tables[place][0x1018, sub] = 0x99
    if name == "revision":
        it.bring_up().identify()  # The rig's file says nothing of it.
        nodes = list(config().nodes)
        given = replace(nodes[place].identity, revision=3)
        nodes[place] = replace(nodes[place], identity=given)
        bus = config(nodes=tuple(nodes))
    else:
        bus = config()
    wanted = {"vendor": 0x1234, "product": 7, "revision": 3, "serial": 100 + place}[name]
    words = rf"\('{NAMES[place]}'\) has {name} 0x99, expected is {wanted:#x}; correct the bus file"
    with pytest.raises(DriveError, match=words):
        it.bring_up(bus).identify()
    there = it.bring_up().identity(node(place))
    values = (there.vendor, there.product, there.revision, there.serial)
    usual = [0x1234, 7, 3, 100 + place]
    usual[sub - 1] = 0x99
    assert list(values) == usual


def test_two_drives_that_are_swapped_are_both_named() -> None:
    it = Objects()
    for place in (0, 1):
        it.tables[place][0x1018, 4] = 101 - place
    words = "has serial 0x65, expected is 0x64; that one is node 2: 'hip' and 'knee' are swapped"
    with pytest.raises(DriveError, match=words):
        it.bring_up().identify()


@pytest.mark.parametrize("refused", [set(), {1}, {2}, {1, 2}])
def test_all_nodes_are_told_to_be_pre_operational_whatever_the_bus_refuses(
    refused: set[int],
) -> None:
    it = Objects()
    it.refuses = refused
    if refused:
        with pytest.raises(BusError, match="full"):
            it.bring_up().pre_operational()
    else:
        it.bring_up().pre_operational()
    assert it.orders == [(0x80, number) for number in (1, 2) if number not in refused]


# --- what they hold --------------------------------------------------------------------------


@pytest.mark.parametrize("place", [0, 1])
def test_a_target_is_where_the_motor_is_before_anything_is_enabled(place: int) -> None:
    it = Objects()
    actual = 5000 - 9000 * place
    assert it.bring_up().preload(node(place)) == actual
    assert it.wrote == [(place, 0x607A, 0, actual)]
    it = Objects()
    it.keeps = {(0x607A, 0)}
    words = rf"node {place + 1} \('{NAMES[place]}'\) does not take a target position by SDO"
    with pytest.raises(DriveError, match=words):
        it.bring_up().preload(node(place))


@pytest.mark.parametrize("place", [0, 1])
def test_a_motor_at_the_end_of_the_drives_own_limits_is_within_them(place: int) -> None:
    actual = 5000 - 9000 * place
    for ends, fits in (
        ((actual, actual + 1), True),
        ((actual - 1, actual), True),
        ((actual + 1, actual + 9), False),
        ((actual - 9, actual - 1), False),
        ((0, 0), True),  # Equal or turned round: the drive does not clamp.
        ((9, -9), True),
    ):
        it = Objects()
        it.tables[place].update({(0x607D, 1): ends[0], (0x607D, 2): ends[1]})
        limits = it.bring_up().soft_limits(node(place))
        assert limits == (ends if ends[0] < ends[1] else None)
        if fits:
            it.bring_up().check_soft_limits(node(place))
            continue
        words = rf"'{NAMES[place]}'\) stands at .*\({actual} counts\), outside its software limits"
        with pytest.raises(DriveError, match=words):
            it.bring_up().check_soft_limits(node(place))


def test_a_drive_without_limits_of_its_own_has_none_and_another_refusal_is_told() -> None:
    for code in (NO_OBJECT, NO_SUB_INDEX, GENERAL):
        for sub in (1, 2):
            it = Objects()
            it.tables[0].update({(0x607D, 1): -9, (0x607D, 2): 9})
            it.aborts[0x607D, sub] = code
            assert it.bring_up().soft_limits(node(0)) is None
            it.bring_up().check_soft_limits(node(0))
    it.aborts = {(0x607D, 1): HARDWARE}
    with pytest.raises(SdoAbortError):
        it.bring_up().soft_limits(node(0))


def configurable(it: Objects, place: int) -> None:
    """Give a drive all objects of its configuration, with zeros in them."""
    for parameter in configuration(config(), node(place)):
        it.tables[place].setdefault(parameter.key, 0)
        it.sizes[parameter.key] = len(pack(parameter.kind, 0))


@pytest.mark.parametrize("place", [0, 1])
def test_a_configuration_is_written_read_back_and_without_differences_then(place: int) -> None:
    here = node(place)
    wanted = list(configuration(config(), here))
    it = Objects()
    configurable(it, place)
    up = it.bring_up()
    final = {parameter.key: parameter.value for parameter in wanted}
    differing = [entry.parameter.key for entry in up.differences(here)]
    assert differing == [
        entry.key
        for entry in {entry.key: entry for entry in wanted}.values()
        if not row_of(entry).agrees(entry.value, it.tables[place][entry.key])
    ]
    assert len(differing) > 20
    assert not it.wrote
    assert [entry.parameter.key for entry in up.configure(here)] == list(final)
    # The table keeps words as signed numbers.
    assert all((it.tables[place][key] ^ value) % (1 << 32) == 0 for key, value in final.items())
    assert [(index, sub) for _, index, sub, _ in it.wrote] == [entry.key for entry in wanted]
    assert up.differences(here) == []
    # A drive that may do without an object does; one that may not is told.
    for parameter in {entry.key: entry for entry in wanted}.values():
        row = row_of(parameter)
        for code in (NO_OBJECT, NO_SUB_INDEX, GENERAL):
            it.aborts = {parameter.key: code}
            if row.need is not Need.REQUIRED or row.may_lack:
                (entry,) = (one for one in up.configure(here) if not one.agrees)
                assert (entry.parameter.key, entry.code) == (parameter.key, code)
                assert up.differences(here) == []
                continue
            with pytest.raises(SdoAbortError, match=f"{parameter.index:04X}h.*it is required: "):
                up.configure(here)
            assert [entry.parameter.key for entry in up.differences(here)] == [parameter.key]
    it.aborts = {}
    # A required value that is not kept ends it.
    key = (0x1800, 2)
    it.keeps, it.tables[place][key] = {key}, final[key] ^ 1
    with pytest.raises(DriveError, match=rf"node {place + 1} .* does not take this value"):
        up.configure(here)
    assert [entry.parameter.key for entry in up.differences(here)] == [key]


@pytest.mark.parametrize("place", [0, 1])
def test_a_mode_that_lags_is_waited_for_50_times_10_ms(place: int) -> None:
    for lag_ms, comes in ((0, True), (300, True), (480, True), (520, False)):
        it = Objects()
        configurable(it, place)
        up, began = it.bring_up(), list[int]()
        real = it.send

        def send(
            message: can.Message,
            _it: Any = it,
            _real: Any = real,
            _began: list[int] = began,
            _lag: int = lag_ms,
        ) -> None:
            if bytes(message.data[:3]) == b"\x40\x61\x60" and not _began:
                _began.append(_it.time_ns)
            waited = _it.time_ns - _began[0] if _began else 0
            _it.tables[place][0x6061, 0] = 8 if waited >= _lag * MS else 6
            _real(message)

        it.send = send
        if comes:
            up.configure(node(place))
            assert lag_ms * MS <= it.time_ns - began[0] <= (lag_ms + 11) * MS
            continue
        with pytest.raises(
            DriveError, match=r"stays in mode 6 .6061h. for 500 ms, asked for was 8"
        ):
            up.configure(node(place))
        # A look and a rest, fifty times, and the look that comes too late.
        assert it.time_ns - began[0] == 50 * (10 * MS + MS // 10) + MS // 10


@pytest.mark.parametrize("place", [0, 1])
def test_patience_with_a_mode_ends_with_its_last_nanosecond(place: int) -> None:
    slow = replace(node(place), quirks=Quirks(mode_patience_ms=91))
    it = Objects()
    configurable(it, place)
    it.tables[place][0x6061, 0] = 6
    with pytest.raises(DriveError, match=r"stays in mode 6 .* for 91 ms"):
        it.bring_up().configure(slow)
    # An answer after 0.1 ms, and nine times 10.1 ms until the next: 91 ms to the nanosecond.
    assert it.asked.count((place, 0x6061, 0)) == 10


def test_frames_that_have_come_by_now_are_passed_on() -> None:
    it = Objects()
    came = [
        can.Message(arbitration_id=cob_id, data=b"\x05", is_extended_id=False)
        for cob_id in (0x702, 0x701, 0x282)
    ]
    waiting, heard = list(came), list[can.Message]()
    take: Any = lambda timeout=None: waiting.pop(0) if waiting else None  # noqa: E731
    it.recv = take
    BringUp(Port(cast(Any, it), it), config(), heard.append).poll_frames()
    assert heard == came


# --- power and warmth ------------------------------------------------------------------------


@pytest.mark.parametrize("place", [0, 1])
def test_drives_with_power_are_stopped_and_only_those(place: int) -> None:
    for status, powered in ((0x0250, False), (0x0218, False), (0x0237, True), (0x0201, True)):
        it = Objects()
        it.tables[place][0x6041, 0] = status
        up = it.bring_up()
        assert up.powered(node(place)) is powered
        assert not up.powered(node(1 - place))
        if not powered:
            up.unpower()
            assert not it.wrote
            continue
        with pytest.raises(DriveError, match=f"found with power: drive '{NAMES[place]}' keeps"):
            up.unpower()
        assert {(at, index) for at, index, _, _ in it.wrote} == {(place, 0x6040)}


def test_errors_and_temperatures_are_read_as_they_are() -> None:
    it = Objects()
    warmth = Mapped(0x2070, 0, DataType.INTEGER16)
    for code, words in ((0x3220, "3220h under-voltage"), (0x0001, "0001h see the drive manual")):
        it.tables[1][0x603F, 0] = code
        assert it.bring_up().error_text(node(1)) == words
    it.tables[1][0x2070, 0] = -5
    up = it.bring_up()
    assert up.temperature(replace(node(1), temperature_object=warmth)) == -5
    assert up.temperature(replace(node(1), temperature_object=None)) is None
