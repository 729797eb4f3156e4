"""Counts and angles by their numbers: the formula, the ends of what an axis has, the seams."""

import math
from typing import Any

import pytest

from legbench.drives.setup.units import AxisUnits, wrap
from legbench.errors import ConfigError


def axis(**changes: Any) -> AxisUnits:
    return AxisUnits(**{"counts_per_rev": 4096, **changes})


@pytest.mark.parametrize(
    ("name", "takes", "refuses"),
    [
        ("counts_per_rev", (1, 1 << 31), (0, -1, (1 << 31) + 1)),
        ("gear", (1e-4, 1e4), (0.99e-4, 1.01e4, 0.0, -1.0, math.nan)),
        ("offset_counts", (1 - (1 << 31), (1 << 31) - 1), (-(1 << 31), 1 << 31)),
        ("sign", (-1, 1), (0, 2, -2)),
        ("bits", (8, 16, 32, 64), (7, 15, 17, 31, 33, 63, 65, 128)),
    ],
)
def test_an_axis_takes_its_numbers_up_to_their_ends(
    name: str, takes: tuple[Any, ...], refuses: tuple[Any, ...]
) -> None:
    for value in takes:
        assert getattr(axis(**{name: value}), name) == value
    for value in refuses:
        with pytest.raises(ConfigError, match=f"^{name} is "):
            axis(**{name: value})


def test_a_plain_axis_turns_with_its_encoder() -> None:
    plain = AxisUnits(counts_per_rev=4096)
    assert (plain.gear, plain.sign, plain.offset_counts, plain.bits) == (1.0, 1, 0, 32)
    assert plain.to_counts(math.pi) == 2048
    assert plain.to_rad(1024) == pytest.approx(0.5 * math.pi)


@pytest.mark.parametrize("sign", [-1, 1])
def test_counts_are_offset_and_turns_of_the_encoder(sign: int) -> None:
    units = AxisUnits(counts_per_rev=4096, gear=50.0, sign=sign, offset_counts=100)
    assert units.resolution == pytest.approx(2.0 * math.pi / (50 * 4096))
    for turns in (-0.5, 0.0, 0.25, 3.0):
        counts = 100 + sign * round(turns * 50 * 4096)
        assert units.to_counts(2.0 * math.pi * turns) == counts
        assert units.to_rad(counts) == pytest.approx(2.0 * math.pi * turns)
    # To the nearest count.
    count = units.resolution
    assert units.to_counts(0.49 * count) == 100
    assert units.to_counts(0.51 * count) == 100 + sign


def test_a_position_object_wraps_at_half_its_range() -> None:
    shown = {32_767: 32_767, 32_768: -32_768, -32_768: -32_768, -32_769: 32_767, 65_536: 0}
    for counts, value in shown.items():
        assert wrap(counts, 16) == value
    half = 1 << 31
    for counts, value in {half - 1: half - 1, half: -half, -half - 1: half - 1, 0: 0}.items():
        assert wrap(counts) == wrap(counts, 32) == value


@pytest.mark.parametrize("bits", [16, 32])
def test_a_position_is_the_nearest_that_shows_the_same(bits: int) -> None:
    whole, half = 1 << bits, 1 << (bits - 1)
    nearest = AxisUnits(counts_per_rev=1000, bits=bits).nearest
    for near in (0, 5 * whole + 17, -3 * whole - 4):
        for move in (0, 1, -1, half - 1, -half, 12_345):
            shown = wrap(near + move, bits)
            assert nearest(shown, near) == near + move
        # Half the range and beyond is nearer from the other side.
        assert nearest(wrap(near + half, bits), near) == near - half
    assert nearest(-half if bits == 32 else 7, 0) == (-half if bits == 32 else 7)


def test_a_position_of_64_bits_is_as_far_from_zero_as_it_holds() -> None:
    for bits, most in ((16, (1 << 31) - 1), (32, (1 << 31) - 1), (64, (1 << 63) - 1)):
        for offset in (most, -most):
            assert axis(bits=bits, offset_counts=offset).offset_counts == offset
        for offset in (most + 1, -most - 1):
            with pytest.raises(ConfigError, match=f"offset_counts is {offset}; .* {bits} bits"):
                axis(bits=bits, offset_counts=offset)


def test_a_position_repeats_within_what_its_object_shows() -> None:
    for modulus, low in (
        (16, -(1 << 15)),
        (16, (1 << 16) - 16),
        (1 << 16, 0),
        (1 << 16, -(1 << 15)),
    ):
        units = axis(bits=16, modulus_counts=modulus, lowest_count=low)
        assert (units.modulus, units.lowest) == (modulus, low)
    for modulus in (15, (1 << 16) + 1):
        with pytest.raises(ConfigError, match=f"modulus_counts is {modulus}; .* 16 to 65536"):
            axis(bits=16, modulus_counts=modulus)
    for low in (-(1 << 15) - 1, (1 << 16) - 15):
        with pytest.raises(ConfigError, match=f"lowest_count is {low}; .* -32768 to 65520"):
            axis(bits=16, modulus_counts=16, lowest_count=low)


def test_a_count_is_wrapped_into_the_signed_range_of_its_object() -> None:
    for counts in (0, 1, 127, 128, 200, 255, 256, -1, -128, -129, -1000):
        signed = int.from_bytes((counts % 256).to_bytes(1, "little"), "little", signed=True)
        assert wrap(counts, 8) == signed
