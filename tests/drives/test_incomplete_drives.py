"""Drives that lack objects, fix them or round them: what they are told, refused for, and miss."""

from dataclasses import replace
from pathlib import Path

import can
import pytest
from drives_rig import LIMITS, config, node, rig
from object_tables import NO_OBJECT, Objects

from legbench.drives.errors import DriveError, SdoAbortError
from legbench.drives.protocol.datatypes import DataType, pack
from legbench.drives.setup.config import BusConfig, NodeConfig, Parameter
from legbench.drives.setup.configuration import configuration
from legbench.drives.setup.master_watch import means_of
from legbench.drives.setup.needs import Need, row_of
from legbench.drives.setup.outcome import ObjectOutcome, cycle_count
from legbench.drives.setup.stopping import check_stopping
from legbench.drives.setup.taken import check_taken, tells_heartbeat, unprotected
from legbench.errors import ConfigError
from legbench.limits.safety import SafetyLimits

READ_ONLY, GENERAL, TOO_HIGH, TYPE = 0x06010002, 0x08000000, 0x06090031, 0x06070010
HIP = "hip"


class Table:
    """One drive that has every object of its configuration, until a test changes it."""

    def __init__(self, bus: BusConfig | None = None) -> None:
        self.bus = bus or config()
        self.node = self.bus.nodes[0]
        self.it = Objects()
        self.fixed: set[tuple[int, int]] = set()
        for parameter in configuration(self.bus, self.node):
            self.it.tables[0].setdefault(parameter.key, 0)
            self.it.sizes[parameter.key] = len(pack(parameter.kind, 0))
        self.up = self.it.bring_up(self.bus)
        self._send = self.it.send
        self.it.send = self._answer

    def _answer(self, message: can.Message) -> None:
        data = bytes(message.data)
        key = (int.from_bytes(data[1:3], "little"), data[3])
        if key in self.fixed and data[0] != 0x40:
            self.it.aborts[key] = READ_ONLY
            self._send(message)
            del self.it.aborts[key]
            return
        self._send(message)

    def has(self, key: tuple[int, int], value: int) -> None:
        """Fix a value: a write is answered by 06010002h."""
        self.it.tables[0][key] = value
        self.fixed.add(key)

    def configured(self) -> dict[tuple[int, int], ObjectOutcome]:
        return {entry.parameter.key: entry for entry in self.up.configure(self.node)}


def test_a_value_that_is_fixed_and_right_counts_as_written() -> None:
    wanted = {one.key: one.value for one in configuration(config(), node(0))}
    for key, value in wanted.items():
        it = Table()
        it.has(key, value)
        entry = it.configured()[key]
        assert (entry.agrees, entry.code, entry.there is not None) == (True, READ_ONLY, True)
        assert entry.line is None
        assert not it.up.differences(it.node)


def test_a_required_value_that_is_fixed_otherwise_is_refused_and_a_protection_is_told() -> None:
    for parameter in {one.key: one for one in configuration(config(), node(0))}.values():
        it = Table()
        row = row_of(parameter)
        wrong = 0x7FFFFFFF if parameter.kind is DataType.UNSIGNED32 else 0
        wrong = 9 if parameter.value == 0 else wrong
        wrong = 255 if parameter.key == (0x1400, 2) else wrong
        if parameter.kind is DataType.UNSIGNED32 and parameter.index == 0x1005:
            wrong = 0x40000080  # A producer of SYNC.
        it.has(parameter.key, wrong)
        if row.need is Need.REQUIRED:
            with pytest.raises(SdoAbortError, match=r"'hip'\), .*holds .*it is required: "):
                it.up.configure(it.node)
            continue
        entry = it.configured()[parameter.key]
        assert not entry.agrees
        line = entry.line or ""
        assert entry.name in line
        assert row.purpose in line
        assert row.instead in line
        assert line.count("\n") == 0


def test_what_is_missing_is_told_with_what_takes_its_place() -> None:
    it = Table()
    for key in ((0x1006, 0), (0x1016, 1), (0x605E, 0), (0x60B1, 0), (0x1402, 1)):
        del it.it.tables[0][key]
        it.it.aborts[key] = NO_OBJECT
    found = it.configured()
    told = unprotected({HIP: tuple(found.values())})
    lines = [line for line in told if "the bus file gives no value" not in line]
    # The rig's file gives no window, no torque limit, no ramp and no range of the drive's own.
    assert len(told) - len(lines) == 4
    assert len(lines) == 3  # An offset and a spare PDO that are not there cost nothing.
    assert lines[1].startswith("drive 'hip', 1016h:01 Consumer heartbeat time 1: the drive has no")
    assert "not protected by the drive's watch over the master's heartbeat" in lines[1]
    assert "instead: the deadline of its commands (140xh:05)" in lines[1]
    check_taken(it.bus, {HIP: tuple(found.values())}, speed=20.0)


def test_a_drive_that_nothing_of_its_own_would_stop_is_refused() -> None:
    for missing in ([(0x6007, 0)], [(0x1016, 1), (0x1400, 5)]):
        it = Table()
        it.it.aborts = dict.fromkeys(missing, NO_OBJECT)
        outcomes = {HIP: tuple(it.configured().values())}
        words = r"'hip' would not stand within 100 ms .*no means .*waive = .*has no such object"
        with pytest.raises(DriveError, match=words):
            check_taken(it.bus, outcomes, speed=20.0)
        check_taken(replace(it.bus, waive=("master watch",)), outcomes, speed=20.0)
    # A deadline never begins where no commands are sent.
    it = Table()
    it.it.aborts = {(0x1016, 1): NO_OBJECT}
    outcomes = {HIP: tuple(it.configured().values())}
    check_taken(it.bus, outcomes)
    with pytest.raises(DriveError, match="no means to notice it"):
        check_taken(it.bus, outcomes, commands=False)


def test_times_count_as_the_drive_holds_them() -> None:
    bus = config()
    for there, time_ms in ((0x7E0032, 50), (0x7E0000, None), (0x7D001E, None), (0x7E003C, 60)):
        held = {one.key: one.value for one in configuration(bus, bus.nodes[0])}
        held[0x1016, 1] = there
        names = [one.name for one in means_of(bus, bus.nodes[0], held=held)]
        times = [one.time_ms for one in means_of(bus, bus.nodes[0], held=held)]
        assert ("heartbeat consumer 1016h" in names) == (time_ms is not None)
        assert time_ms is None or time_ms + 1.0 in times
    for reaction, stops in ((3, True), (1, True), (0, False), (2, False)):
        held[0x6007, 0] = reaction
        assert bool(means_of(bus, bus.nodes[0], held=held)) is stops


def test_a_rounded_time_is_taken_and_told_and_another_one_refused() -> None:
    for there, fits in ((25, True), (32, True), (40, True), (41, False), (0, False)):
        it = Table()
        it.it.keeps, it.it.tables[0][0x1017, 0] = {(0x1017, 0)}, there
        if not fits:
            with pytest.raises(DriveError, match=f"wrote 20, reads {there}; .*heartbeat: give"):
                it.up.configure(it.node)
            continue
        entry = it.configured()[0x1017, 0]
        assert entry.line == (
            f"1017h:00 Producer heartbeat time [ms]: wanted 20, the drive holds {there}"
        )
    # Fixed at something else, the drive is watched by its process data alone.
    it = Table()
    it.has((0x1017, 0), 0)
    assert not tells_heartbeat(tuple(it.configured().values()))


def test_identifiers_agree_by_valid_bit_and_eleven_bits() -> None:
    for flags, fits in ((0, True), (1 << 30, True), (1 << 31, False), (1 << 29, False)):
        it = Table()
        key = (0x1800, 1)
        it.it.keeps, it.it.tables[0][key] = {key}, 0x181 | flags
        if fits:
            assert it.configured()[key].line is None
            continue
        with pytest.raises(DriveError, match=r"1800h:01 TPDO1 COB-ID: wrote .* process data"):
            it.up.configure(it.node)
    it = Table()
    # A spare one is off, whatever else stands there.
    it.it.keeps, it.it.tables[0][0x1801, 1] = {(0x1801, 1)}, 0x80000000
    assert it.configured()[0x1801, 1].agrees
    it.it.tables[0][0x1801, 1] = 0x281
    with pytest.raises(DriveError, match=r"1801h:01 .* name it in the bus file instead"):
        it.up.configure(it.node)


def test_process_data_beyond_the_fourth_is_switched_off() -> None:
    it = Table()
    table = it.it.tables[0]
    table.update({(0x1404, 1): 0x80000000, (0x1405, 1): 0x4F1, (0x1804, 1): 0x40000491})
    found = it.configured()
    assert [(index, value & 0xFFFFFFFF) for _, index, sub, value in it.it.wrote if sub == 1][
        -2:
    ] == [
        (0x1405, 0x800004F1),
        (0x1804, 0x80000491),
    ]
    assert found[0x1405, 1].agrees
    assert (0x1404, 1) not in found


def test_an_interpolation_time_is_fitted_to_a_fixed_power_of_ten() -> None:
    for index, count in ((-3, 1), (-4, 10), (-5, 100), (-6, None), (-2, None)):
        it = Table()
        it.has((0x60C2, 2), index)
        if count is None:
            with pytest.raises(SdoAbortError, match="60C2h:02 Interpolation time index"):
                it.up.configure(it.node)
            continue
        it.configured()
        assert it.it.tables[0][0x60C2, 1] == count
        assert not it.up.differences(it.node)
    assert cycle_count(1, -3, -4) == 10
    assert cycle_count(25, -4, -3) is None


def test_another_option_that_brakes_is_tried_where_one_is_refused() -> None:
    it = Table()
    refused = {(0x605A, 0): 2, (0x6007, 0): 3, (0x605E, 0): 2}
    send = it.it.send

    def choosy(message: can.Message) -> None:
        data = bytes(message.data)
        key = (int.from_bytes(data[1:3], "little"), data[3])
        if data[0] != 0x40 and refused.get(key) == data[4]:
            it.it.aborts[key] = TOO_HIGH
        send(message)
        it.it.aborts.clear()

    it.it.send = choosy
    found = it.configured()
    assert {key: found[key].there for key in refused} == {
        (0x605A, 0): 6,
        (0x6007, 0): 1,
        (0x605E, 0): 1,
    }
    assert found[0x605A, 0].line == "605Ah:00 Quick stop option code: wanted 2, the drive holds 6"


def ramped(index: int) -> NodeConfig:
    ramp = Parameter(index=index, sub=0, kind=DataType.UNSIGNED32, value=100_000_000)
    return replace(node(0), parameters=(ramp,))


def test_a_quick_stop_brakes_on_the_profile_ramp_where_that_is_what_the_file_gives() -> None:
    for index, option in ((0x6085, 2), (0x6084, 1)):
        bus = config(nodes=(ramped(index), node(1)))
        told = {one.key: one.value for one in configuration(bus, bus.nodes[0])}
        assert told[0x605A, 0] == option
        it = Table(bus)
        it.it.aborts = {(index, 0): NO_OBJECT}
        outcomes = {HIP: tuple(it.configured().values())}
        words = rf"'hip' does not take its quick-stop ramp, {index:04X}h:00 .*waive = \[\"quick"
        with pytest.raises(DriveError, match=words):
            check_taken(bus, outcomes)
        check_taken(replace(bus, waive=("quick-stop ramp",)), outcomes)
    with pytest.raises(ConfigError, match=r"no quick-stop ramp: .*6084:00 u32.*waive"):
        check_stopping(config(), SafetyLimits(command_speed=1.0))
    check_stopping(config(waive=("quick-stop ramp",)), SafetyLimits(command_speed=1.0))


def test_a_type_that_the_drive_does_not_have_is_the_bus_files_fault() -> None:
    it = Table(config(nodes=(ramped(0x6085), node(1))))
    it.it.aborts = {(0x6085, 0): TYPE}
    with pytest.raises(SdoAbortError, match=r"6085h:00 .*length does not match.*give a value"):
        it.up.configure(it.node)
    vendor = Parameter(index=0x3001, sub=2, kind=DataType.UNSIGNED8, value=1)
    it = Table(config(nodes=(replace(node(0), parameters=(vendor,)), node(1))))
    it.it.aborts = {(0x3001, 2): GENERAL}
    with pytest.raises(SdoAbortError, match=r"3001h:02: .*08000000h.*the bus file asks for it"):
        it.up.configure(it.node)


def test_identity_modes_and_error_codes_may_be_missing() -> None:
    it = Objects()
    for key in ((0x1018, 3), (0x1018, 4), (0x6502, 0)):
        it.aborts[key] = NO_OBJECT
    nodes = tuple(
        replace(one, identity=replace(one.identity, serial=None)) for one in config().nodes
    )
    bus = config(nodes=nodes)
    it.bring_up(bus).identify()
    assert it.bring_up(bus).identity(nodes[0]).serial is None
    assert it.bring_up(bus).error_text(nodes[0]) == "it has no error code (603Fh)"
    with pytest.raises(DriveError, match=r"\('hip'\) does not tell its serial \(1018h\), expected"):
        it.bring_up().identify()


def test_a_leg_whose_drives_lack_protections_runs_and_says_so(tmp_path: Path) -> None:
    # No heartbeat of the drives, no watch over the master's: deadlines and process data are left.
    with rig(tmp_path) as it:
        for drive in it.network.drives:
            for key in ((0x1016, 1), (0x1017, 0), (0x1006, 0), (0x605E, 0)):
                del drive._store._entries[key]
        it.link.open()
        assert len(it.link.unprotected) == 8
        assert all(line.startswith("drives 'hip', 'knee', ") for line in it.link.unprotected)
        it.link.start()
        it.run(200)
        assert it.link.fault is None
    bare = replace(LIMITS, command_speed=20.0)
    with rig(tmp_path, limits=bare) as it:
        for key in ((0x1016, 1), (0x6007, 0)):
            del it.network.drives[0]._store._entries[key]
        with pytest.raises(DriveError, match="'hip' would not stand within 100 ms"):
            it.link.open()
        assert not any(0x200 < frame.cob_id <= 0x27F for _, frame in it.network.log or [])
