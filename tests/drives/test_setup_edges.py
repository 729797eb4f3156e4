"""Edges of what a bus file may say: laps of an encoder, bits of a home, tables that are added."""

import math
from dataclasses import replace

import pytest
from drives_rig import node

from legbench.drives.protocol.datatypes import DataType
from legbench.drives.protocol.pdo import Mapped
from legbench.drives.setup.field_ranges import _check_lap
from legbench.drives.setup.file_edit import edited
from legbench.drives.setup.homed import HomedCondition
from legbench.drives.setup.units import AxisUnits
from legbench.errors import ConfigError
from legbench.reading import UnreadableError


@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_a_motor_stays_within_half_a_lap_of_angle_0_on_either_side(side: float) -> None:
    units = AxisUnits(counts_per_rev=4096, modulus_counts=4096)
    single = replace(node(0), motor=units)
    # Half a turn, less the 0.2 rad that a motor may reach beyond its range.
    end = math.pi - 0.2
    for gap, fits in ((1e-9, True), (-1e-9, False)):
        far = side * (end - gap)
        motor = (min(far, 0.0), max(far, 0.0))
        if fits:
            _check_lap(single, motor)
            continue
        words = r"repeats every 6\.283 rad, .* beyond 3\.142 rad from angle 0"
        with pytest.raises(ConfigError, match=words):
            _check_lap(single, motor)


def test_a_home_is_shown_by_bits_of_its_object_and_by_no_others() -> None:
    word = Mapped(0x6041, 0, DataType.UNSIGNED16)
    for mask, value in ((0xFFFF, 0xFFFF), (0xFFFF, None), (1, 0), (0x8000, 0x8000), (3, 2)):
        home = HomedCondition(object=word, mask=mask, value=value)
        assert home.wanted == (mask if value is None else value)
        assert home.met(home.wanted | 0xFFFF & ~mask)
        assert not home.met(home.wanted ^ mask)
    for mask in (0, -1, 0x10000):
        with pytest.raises(ConfigError, match="16 bits, so it must be 1 to 0xffff"):
            HomedCondition(object=word, mask=mask)
    for value in (-1, 4, 0x10000):
        with pytest.raises(ConfigError, match="no bits outside of mask, 0x3"):
            HomedCondition(object=word, mask=3, value=value)


def test_a_table_on_the_way_to_a_value_is_added() -> None:
    text = "# of the leg\n[node]\nid = 1\n"
    changed = edited(text, {("node", "motor", "offset_counts"): 5, ("limits", "speed"): 2.5})
    assert changed.startswith(text.rstrip("\n"))
    assert "[node.motor]" in changed
    assert "offset_counts = 5" in changed
    assert "[limits]\nspeed = 2.5" in changed
    for place in (("node", 0, "id"), ("node", "id", "x"), ("more", 0, "id")):
        with pytest.raises(UnreadableError, match="there is no "):
            edited(text, {place: 1})
