"""Rules of the standards for the objects of an emulated drive, and what a drive does by default."""

from types import SimpleNamespace
from typing import Any

import pytest
from drives_rig import node

from legbench.drives.emulated import dictionary, rules
from legbench.drives.emulated.behaviour import Behaviour, MissingSetpoint
from legbench.drives.emulated.connection import Connection
from legbench.drives.emulated.dictionary import Dictionary, _shown_only, dictionary_of
from legbench.drives.emulated.rules import objection, usable, watched
from legbench.drives.protocol.datatypes import DataType
from legbench.drives.protocol.frame import Frame
from legbench.drives.protocol.objects import Access, Key, ObjectEntry
from legbench.drives.protocol.sdo import Abort
from legbench.drives.protocol.sdo_server import SdoAnswers

OPERATIONAL = b"\x05"

# --- rules -----------------------------------------------------------------------------------


def test_identifiers_that_an_object_may_be_given_are_those_that_301_leaves() -> None:
    # CiA 301, table 40: restricted CAN-IDs.
    restricted = {
        *range(0x80),
        *range(0x101, 0x181),
        *range(0x581, 0x600),
        *range(0x601, 0x680),
        *range(0x6E0, 0x700),
        *range(0x701, 0x800),
    }
    for cob in range(0x900):
        for flags in (0, 1 << 31, 1 << 30, 3 << 30):
            assert usable(cob | flags) is (cob < 0x800 and cob not in restricted)
    assert not usable(1 << 29 | 0x181)


def test_a_word_of_1016h_asks_for_a_node_and_a_time() -> None:
    for node_id in (0, 1, 127, 128, 255):
        for time_ms in (0, 1, 65_535):
            asks = 1 <= node_id <= 127 and time_ms > 0
            assert watched(node_id << 16 | time_ms) == ((node_id, time_ms) if asks else None)


VALUES: dict[Key, int] = {(0x1006, 0): 0, (0x1016, 1): 0, (0x1016, 2): 0}
TAKES: dict[Key, set[int]] = {
    # CiA 301, 7.5.2; CiA 402-2: option codes.
    (0x1003, 0): {0},
    (0x1019, 0): {0, *range(2, 241)},
    (0x1029, 1): {0, 1, 2},
    (0x6007, 0): {0, 1, 2, 3},
    (0x605A, 0): set(range(9)),
    (0x605B, 0): {0, 1},
    (0x605C, 0): {0, 1},
    (0x605D, 0): {1, 2, 3, 4},
    (0x605E, 0): {0, 1, 2, 3, 4},
    (0x607E, 0): {0x00, 0x40, 0x80, 0xC0},
}


@pytest.mark.parametrize("key", list(TAKES))
def test_an_object_takes_the_values_of_the_standards(key: Key) -> None:
    assert set(rules.ALLOWED) == set(TAKES)
    for value in range(-3, 260):
        wanted = None if value in TAKES[key] else Abort.INVALID_VALUE
        assert objection(key, value, VALUES) is wanted
    # The counter of SYNC stays as it is while SYNC has a period.
    running = VALUES | {(0x1006, 0): 1000}
    kept = Abort.DEVICE_STATE if key == (0x1019, 0) else None
    assert objection(key, min(TAKES[key]), running) is kept


def test_sync_has_a_free_identifier_and_no_drive_produces_it() -> None:
    for value, wanted in (
        (0x80, None),
        (0x100, None),
        (0x101, Abort.INVALID_VALUE),
        (1 << 30 | 0x80, Abort.INVALID_VALUE),
    ):
        assert objection((0x1005, 0), value, VALUES) is wanted


@pytest.mark.parametrize("sub", [1, 2])
def test_no_node_is_watched_twice(sub: int) -> None:
    other = VALUES | {(0x1016, 3 - sub): 126 << 16 | 30}
    for word, wanted in (
        (126 << 16 | 10, Abort.INCOMPATIBLE),
        (125 << 16 | 10, None),
        (126 << 16, None),
        (0, None),
    ):
        assert objection((0x1016, sub), word, other) is wanted
    again = VALUES | {(0x1016, sub): 126 << 16 | 30}
    assert objection((0x1016, sub), 126 << 16 | 10, again) is None


# --- dictionaries ----------------------------------------------------------------------------


def test_a_dictionary_names_the_objects_of_the_profile() -> None:
    # CiA 402-2: 6060h, 6061h and 8, cyclic synchronous position; 6080h max motor speed.
    assert (dictionary.MODE, dictionary.MODE_DISPLAY, dictionary.CYCLIC) == (
        (0x6060, 0),
        (0x6061, 0),
        8,
    )
    assert (dictionary.MAX_SPEED, dictionary.EMCY) == ((0x6080, 0), (0x1014, 0))
    assert dictionary.USUAL_LINKS == ((0x60E4, 1), (0x2064, 0))
    # COB-IDs of four PDOs each way.
    assert {(base + n, 1) for base in (0x1400, 0x1800) for n in range(4)} == dictionary.RELATIVE
    for place in (0, 1):
        found = {entry.key: entry.default for entry in dictionary_of(node(place)).entries}
        assert found[0x1014, 0] == 0x81 + place
        assert found[0x1803, 1] == (1 << 31) + 0x481 + place
        assert [found[0x1018, sub] for sub in (1, 2, 3, 4)] == [0x1234, 7, 0, 100 + place]


def test_a_value_is_held_for_the_bus_alone_where_it_is_a_number() -> None:
    for kind, default, shown in (
        (DataType.UNSIGNED32, 5, b"\x05\0\0\0"),
        (DataType.REAL32, 1.0, b"\0\0\x80\x3f"),
    ):
        entry = ObjectEntry(0x6080, 0, "it", kind, Access.RW, default)
        held = _shown_only(entry)
        assert (held.kind, held.default) == (DataType.OCTET_STRING, shown)
    for kind, default in ((DataType.VISIBLE_STRING, "text"), (DataType.UNSIGNED32, b"\x01")):
        entry = ObjectEntry(0x6080, 0, "it", kind, Access.RW, default)
        assert _shown_only(entry) is entry


def test_limits_of_an_object_refuse_what_lies_beyond() -> None:
    limited = Dictionary(entries=(), limits={(0x6085, 0): (10, 100)})
    for value, wanted in ((9, Abort.TOO_LOW), (10, None), (100, None), (101, Abort.TOO_HIGH)):
        assert limited.refusal((0x6085, 0), value) is wanted
        assert limited.refusal((0x6084, 0), value) is None


def test_a_drive_behaves_by_default_as_is_written_here() -> None:
    usual = Behaviour()
    assert (usual.reply_delay_us, usual.seed, usual.boot_us) == ((50, 250), 0, 5000)
    assert (usual.missing_limit, usual.sync_loss_periods) == (3, 5)
    assert (usual.status_lag_us, usual.mode_lag_us, usual.setpoint_delay) == (0, 2000, 0)
    assert (usual.rpdos, usual.tpdos, usual.start_pos, usual.rated_torque) == (4, 4, 0.0, 10.0)
    assert (usual.missing_setpoint, usual.sdo_answers) == (MissingSetpoint.HOLD, SdoAnswers.SIZED)
    assert usual.lacking is Abort.NO_OBJECT
    on = (usual.interpolate, usual.follows_bit, usual.halt_blocks_mode)
    off = (usual.slow_loop, usual.mode_needs_power, usual.fixed_mapping)
    assert (set(on), set(off)) == ({True}, {False})
    assert (usual.ignores, usual.lacks) == (frozenset(), frozenset())
    assert (usual.defaults, usual.warnings) == ((), ())
    nothing = (usual.bandwidth, usual.slew_rate, usual.motor_noise, usual.hard_stop)
    assert set(nothing) == {None}
    assert usual.home_switch is None
    ideal = Behaviour.ideal(0.5)
    assert ideal == Behaviour(reply_delay_us=(0, 0), interpolate=False, start_pos=0.5)


class Power:
    """The power stage and the alarms of a drive, as its connection sees them."""

    def __init__(self, *, option: int = 3, faulted: bool = False) -> None:
        self.log: list[Any] = []
        note = self.log.append
        alarms = SimpleNamespace(
            raise_=lambda code: Frame(0x81, code.to_bytes(2, "little")),
            clear=lambda code: Frame(0x82, code.to_bytes(2, "little")),
        )
        power = SimpleNamespace(faulted=faulted, connection_lost=lambda: note("stop"))
        axis: Any = SimpleNamespace(
            alarms=alarms, power=power, take=lambda: [Frame(0x83), Frame(0x84)]
        )
        self.connection = Connection(axis, {(0x6007, 0): option, (0x1015, 0): 0})

    def sent(self) -> list[tuple[int, str]]:
        return [(frame.cob_id, frame.data.hex()) for _, frame in self.connection.outlet.take()]


def test_what_a_connection_reports_and_when_it_stops() -> None:
    it = Power()
    it.connection.report(0x8250, 5)
    it.connection.over(0x8250, 6)
    it.connection.forward(7)
    assert it.sent() == [(0x81, "5082"), (0x82, "5082"), (0x83, ""), (0x84, "")]
    assert it.log == []
    it.connection.lost(0x8130, 8)
    assert (it.sent(), it.log) == ([(0x81, "3081")], ["stop"])
    # A fault keeps its reason until it is reset.
    it = Power(faulted=True)
    it.connection.over(0x8250, 6)
    assert it.sent() == []


@pytest.mark.parametrize("option", [0, 1, 2, 3])
@pytest.mark.parametrize("faulted", [False, True])
def test_a_connection_that_nmt_ends_is_an_error_where_it_is_a_fault(
    option: int, faulted: bool
) -> None:
    it = Power(option=option, faulted=faulted)
    it.connection.end(5)
    told = option == 1 and not faulted
    assert it.sent() == ([(0x81, "0081")] if told else [])
    assert it.log == ["stop"]


def test_a_drive_off_the_bus_stops_at_once_and_tells_when_it_is_back() -> None:
    it = Power()
    it.connection.leave_bus(5)
    assert (it.sent(), it.log) == ([], ["stop"])
    it.connection.rejoin_bus(9)
    assert it.sent() == [(0x81, "4081"), (0x82, "4081")]
