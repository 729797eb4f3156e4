import itertools
import random

import pytest
from drives_rig import config

from legbench.drives.protocol.frame import Frame
from legbench.drives.setup.wire import (
    bus_load,
    check_load,
    exact_bits,
    plain_bits,
    schedule,
    worst_bits,
)
from legbench.errors import ConfigError


def stuffed_by_hand(text: str) -> int:
    """An independent path: after five equal bits a sixth of the other kind is put in."""
    out = ""
    for bit in text:
        out += bit
        if len(out) >= 5 and len(set(out[-5:])) == 1:
            out += "1" if bit == "0" else "0"
    return len(out) - len(text)


def crc_by_division(bits: str) -> str:
    """Remainder of the division by the polynomial C599h of ISO 11898-1."""
    divisor = 0xC599
    value = int(bits, 2) << 15
    for place in range(value.bit_length() - 16, -1, -1):
        if value >> (place + 15) & 1:
            value ^= divisor << place
    return f"{value:015b}"


@pytest.mark.parametrize("extended", [False, True])
def test_exact_length_is_that_of_stuffing_by_hand(extended: bool) -> None:
    source = random.Random(4)
    for _ in range(400):
        identifier = source.randrange(1 << (29 if extended else 11))
        data = source.choice((source.randbytes(source.randrange(9)), bytes(8), b"\xff" * 8))
        frame = Frame(identifier, data, extended=extended)
        if extended:
            head = f"0{identifier >> 18:011b}11{identifier & 0x3FFFF:018b}000"
        else:
            head = f"0{identifier:011b}000"
        stream = head + f"{len(data):04b}" + "".join(f"{byte:08b}" for byte in data)
        stream += crc_by_division(stream)
        plain = plain_bits(len(data), extended=extended)
        # Delimiters, acknowledge, end of frame and intermission are 13 bits, never stuffed.
        assert len(stream) + 13 == plain
        assert exact_bits(frame) == plain + stuffed_by_hand(stream)
        assert plain <= exact_bits(frame) <= worst_bits(len(data), extended=extended)


def test_lengths_of_the_literature() -> None:
    assert [worst_bits(length) for length in (0, 6, 8)] == [55, 115, 135]
    assert [plain_bits(length) for length in (0, 8)] == [47, 111]
    assert worst_bits(8, extended=True) == 160


def test_bus_load_is_computed_and_too_much_is_refused() -> None:
    usual = config()
    frames = 55 + 2 * 115 + 2 * 135
    beats = 65 * (2 / 20 + 1 / 10)
    assert bus_load(usual) == pytest.approx((frames + beats) / 1000)
    assert check_load(usual) < 0.8
    assert len(schedule(usual)) == 8
    for bitrate in itertools.takewhile(lambda rate: rate < 700_000, (125_000, 250_000, 500_000)):
        with pytest.raises(ConfigError, match="the limit is 80 %; raise bitrate or period_us"):
            check_load(config(bitrate=bitrate))
