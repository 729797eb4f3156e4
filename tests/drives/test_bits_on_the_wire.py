"""Frame lengths and bus load against a bit stream stuffed by hand (ISO 11898-1)."""

import random
from dataclasses import replace

import pytest
from drives_rig import config

from legbench.drives.protocol.frame import Frame
from legbench.drives.setup.wire import (
    ERROR_BITS,
    MAX_LOAD,
    bus_load,
    check_load,
    exact_bits,
    plain_bits,
    schedule,
    worst_bits,
)
from legbench.errors import ConfigError


def checksum(bits: str) -> str:
    """CRC-15 of CAN by long division of the message times x^15, a text of bits each."""
    divisor, rest = "1100010110011001", list(bits + "0" * 15)
    for place in range(len(bits)):
        if rest[place] == "1":
            for offset, bit in enumerate(divisor):
                rest[place + offset] = "01"[rest[place + offset] != bit]
    return "".join(rest[-15:])


def on_the_wire(frame: Frame) -> str:
    """All bits of a frame up to the next start of frame, stuffed."""
    if frame.extended:
        identifier = f"{frame.cob_id:029b}"
        head = f"0{identifier[:11]}11{identifier[11:]}{int(frame.remote)}00"
    else:
        head = f"0{frame.cob_id:011b}{int(frame.remote)}00"
    body = head + f"{len(frame.data):04b}" + "".join(f"{byte:08b}" for byte in frame.data)
    body += checksum(body)
    stuffed, run = "", 0
    for bit in body:
        run = run + 1 if stuffed.endswith(bit) else 1
        stuffed += bit
        if run == 5:
            stuffed, run = stuffed + "10"[int(bit)], 1
    # CRC delimiter, acknowledge slot and delimiter, seven bits end of frame, three between frames.
    return stuffed + "1" + "01" + "1" * 7 + "1" * 3


def frames() -> list[Frame]:
    """Frames of every length and kind, at random and as long as stuffing can make them."""
    draw = random.Random(9)
    found = [
        Frame(draw.getrandbits(29 if extended else 11), draw.randbytes(length), extended=extended)
        for extended in (False, True)
        for length in range(9)
        for _ in range(40)
    ]
    found += [Frame(cob_id, bytes((byte,)) * 8) for cob_id in (0, 0x7FF) for byte in (0, 255, 0x78)]
    return found


def test_an_exact_length_is_that_of_the_stuffed_bits() -> None:
    for frame in frames():
        assert exact_bits(frame) == len(on_the_wire(frame)), frame


def test_an_exact_length_lies_between_that_without_stuffing_and_the_worst() -> None:
    for frame in frames():
        length, extended = len(frame.data), frame.extended
        plain = plain_bits(length, extended=extended)
        assert plain <= exact_bits(frame) <= worst_bits(length, extended=extended)


def test_lengths_of_the_standard() -> None:
    # 44 bits and 3 between frames; with 29 bits of identifier 64 and 3; 8 a byte.
    for length in range(9):
        assert plain_bits(length) == 47 + 8 * length
        assert plain_bits(length, extended=True) == 67 + 8 * length
        # After the first five bits alike a stuff bit is due with every fourth bit.
        assert worst_bits(length) == 47 + 8 * length + (34 + 8 * length - 1) // 4
        assert worst_bits(length, extended=True) == 67 + 8 * length + (54 + 8 * length - 1) // 4
    assert worst_bits(8) == 135
    # Error flag 6, echo 6 at most, delimiter 8, intermission 3.
    assert ERROR_BITS == 6 + 6 + 8 + 3


def test_the_schedule_counts_each_frame_of_each_node_at_its_rate() -> None:
    bus = replace(config(), period_us=2000, heartbeat_ms=50, master_heartbeat_ms=20)
    entries = {entry.what: (entry.bits, entry.rate) for entry in schedule(bus)}
    assert entries == {
        "SYNC 080h": (55, 500.0),
        "RPDO1 201h hip": (115, 500.0),
        "TPDO1 181h hip": (135, 500.0),
        "heartbeat hip": (65, 20.0),
        "RPDO1 202h knee": (115, 500.0),
        "TPDO1 182h knee": (135, 500.0),
        "heartbeat knee": (65, 20.0),
        "heartbeat master": (65, 50.0),
    }
    total = 500 * (55 + 2 * 115 + 2 * 135) + 65 * (2 * 20 + 50)
    assert bus_load(bus) == pytest.approx(total / 1e6)
    assert check_load(bus) == bus_load(bus)


def test_a_wire_is_full_at_80_percent() -> None:
    assert MAX_LOAD == 0.8
    bits = bus_load(config()) * config().bitrate
    assert check_load(replace(config(), bitrate=round(bits / 0.799))) == pytest.approx(0.799)
    with pytest.raises(ConfigError, match=r"takes 80 % of \d+ bit/s at worst, the limit is 80 %"):
        check_load(replace(config(), bitrate=int(bits / 0.801)))
