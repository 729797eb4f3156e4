import itertools
import struct

import pytest
from drives_rig import node
from hypothesis import given, settings
from hypothesis import strategies as st

from legbench.drives.errors import CodecError
from legbench.drives.master.axis_link import AxisLink
from legbench.drives.protocol.datatypes import FORMATS, DataType, pack, range_of, size_of, unpack
from legbench.drives.protocol.emcy import Emergency, decode_emcy, emcy_frame
from legbench.drives.protocol.frame import Frame, describe_id, sync_frame
from legbench.drives.protocol.nmt import (
    HeartbeatWatch,
    NmtCommand,
    NmtState,
    decode_heartbeat,
    decode_nmt,
    heartbeat_frame,
    nmt_frame,
)
from legbench.drives.protocol.pdo import Mapped, PdoMap, split_word
from legbench.drives.setup.units import AxisUnits, wrap

NUMERIC = list(FORMATS)
LAYOUTS = st.lists(st.sampled_from(NUMERIC), min_size=1, max_size=8).filter(
    lambda kinds: sum(size_of(kind) or 0 for kind in kinds) <= 8
)


@settings(derandomize=True, max_examples=80)
@given(st.data())
def test_values_come_back_as_they_went(data: st.DataObject) -> None:
    kinds = data.draw(LAYOUTS)
    layout = PdoMap([Mapped(0x2000 + place, 1, kind) for place, kind in enumerate(kinds)])
    values = tuple(data.draw(st.integers(*range_of(kind))) for kind in kinds)
    packed = layout.pack(values)
    assert layout.unpack(packed) == values
    # Independent path: every object alone, one after the other.
    assert packed == b"".join(map(pack, kinds, values))
    assert layout.size == len(packed) == sum(entry.bits for entry in layout.entries) // 8


def test_every_16_bit_statusword_and_controlword_survives() -> None:
    layout = PdoMap([Mapped(0x6041, 0, DataType.UNSIGNED16), Mapped(0x6064, 0, DataType.INTEGER32)])
    for word in range(1 << 16):
        value = -word * 32768
        assert layout.unpack(layout.pack((word, value))) == (word, value)


def test_a_frame_of_another_length_is_refused() -> None:
    layout = PdoMap([Mapped(0x6041, 0, DataType.UNSIGNED16), Mapped(0x6064, 0, DataType.INTEGER32)])
    for length in (*range(6), 7, 8):
        with pytest.raises(CodecError, match=f"{length} bytes, mapped are 6"):
            layout.unpack(bytes(length))


def test_maps_that_cannot_be_are_refused() -> None:
    wide = Mapped(0x2000, 0, DataType.UNSIGNED64)
    with pytest.raises(CodecError, match="nothing has 0 bytes; it must have 1 to 8"):
        PdoMap([])
    with pytest.raises(CodecError, match="has 16 bytes"):
        PdoMap([wide, wide])
    with pytest.raises(CodecError, match="is text"):
        Mapped(0x1008, 0, DataType.VISIBLE_STRING)
    with pytest.raises(CodecError, match=r"32768 does not fit 6077h:00; it holds -32768 to 32767"):
        PdoMap([Mapped(0x6077, 0, DataType.INTEGER16)]).pack([32768])
    with pytest.raises(CodecError, match="2 values for a PDO of 1"):
        PdoMap([Mapped(0x6077, 0, DataType.INTEGER16)]).pack([1, 2])


def test_the_object_whose_value_does_not_fit_is_named_among_those_that_do() -> None:
    layout = PdoMap([Mapped(0x6040, 0, DataType.UNSIGNED16), Mapped(0x607A, 0, DataType.INTEGER32)])
    for fits in (0, 0xFFFF):
        with pytest.raises(CodecError, match=r"^2147483648 does not fit 607Ah:00; it holds -2"):
            layout.pack([fits, 1 << 31])


def test_mapping_words_of_the_standard() -> None:
    assert Mapped(0x6040, 0, DataType.UNSIGNED16).word == 0x60400010
    assert Mapped(0x607A, 0, DataType.INTEGER32).word == 0x607A0020
    assert split_word(0x60E40120) == (0x60E4, 1, 32)


@pytest.mark.parametrize("kind", NUMERIC)
def test_types_hold_their_range_and_nothing_else(kind: DataType) -> None:
    low, high = range_of(kind)
    for value in (low, high, (low + high) // 2):
        assert unpack(kind, pack(kind, value)) == value
    for value in (low - 1, high + 1):
        with pytest.raises(CodecError, match=f"{value} is no {kind.name}"):
            pack(kind, value)


def test_nmt_heartbeat_and_emergency_round_trips() -> None:
    for command, node_id in itertools.product(NmtCommand, range(128)):
        assert decode_nmt(nmt_frame(command, node_id).data) == (command, node_id)
    for state, node_id in itertools.product(NmtState, (1, 127)):
        frame = heartbeat_frame(node_id, state)
        assert frame.cob_id == 0x700 + node_id
        assert decode_heartbeat(frame.data) is state
    for code in range(1 << 16):
        emergency = Emergency(node_id=5, code=code, register=code & 0xFF, vendor=b"abcde")
        frame = emcy_frame(emergency)
        assert decode_emcy(5, frame.data) == emergency
    assert Emergency(node_id=5, code=0xFFFF, register=0).meaning == "vendor error"


def test_bytes_that_mean_nothing_are_nothing() -> None:
    assert decode_nmt(b"\x03\x01") is None
    assert decode_nmt(b"\x01\x80") is None
    assert decode_nmt(b"\x01") is None
    assert decode_heartbeat(b"\x06") is None
    assert decode_heartbeat(b"") is None
    assert decode_emcy(1, bytes(7)) is None


def test_names_of_identifiers() -> None:
    assert describe_id(0x080) == "SYNC"
    assert describe_id(0x081) == "EMCY of 1"
    assert describe_id(0x185) == "TPDO1 of 5"
    assert describe_id(0x47F) == "RPDO3 of 127"
    assert describe_id(0x702) == "heartbeat of 2"
    assert str(Frame(0x181, b"\x37\x12")) == "181#3712"
    assert sync_frame().data == b""
    assert sync_frame(240).data == b"\xf0"


def test_a_heartbeat_never_heard_is_lost_too() -> None:
    watch = HeartbeatWatch(30, 100)
    assert not watch.lost(130)
    assert watch.lost(131)
    watch.feed(131)
    assert not watch.lost(161)


@settings(derandomize=True, max_examples=50)
@given(st.integers(-(1 << 40), 1 << 40), st.sampled_from([16, 32]))
def test_positions_are_followed_across_the_seam(start: int, bits: int) -> None:
    # The encoder on the link has 16 bits, that on the motor 32.
    axis, shown = AxisLink(node(0)), {16: 0, 32: 0}
    moved = began = 0
    step = (1 << bits) // 3
    for move in (0, step, step, -step, step, step, step, -1):
        moved += move
        shown[bits] = wrap(start + moved, bits)
        assert axis.feed(0x181, struct.pack("<Hih", 0x0237, shown[32], shown[16]))
        counts = {16: axis.link_counts, 32: axis.motor_counts}[bits]
        began = counts if move == 0 else began
        assert counts - began == moved
    nearest = AxisUnits(counts_per_rev=1000, bits=bits).nearest
    assert nearest(wrap(start, bits), start) == start


@settings(derandomize=True, max_examples=50)
@given(
    st.integers(1, 1 << 24),
    st.floats(0.1, 200.0),
    st.sampled_from([-1, 1]),
    st.integers(1 - (1 << 31), (1 << 31) - 1),
    st.floats(-20.0, 20.0),
)
def test_angles_come_back_to_half_a_count(
    counts: int, gear: float, sign: int, offset: int, angle: float
) -> None:
    units = AxisUnits(counts_per_rev=counts, gear=gear, sign=sign, offset_counts=offset)
    back = units.to_rad(units.to_counts(angle))
    assert abs(back - angle) <= 0.5000001 * units.resolution
    assert units.to_counts(back) == units.to_counts(angle)
