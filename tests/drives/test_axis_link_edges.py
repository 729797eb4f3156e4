"""What a drive's process data is before its first answer, and where its first position lies."""

import math
from dataclasses import replace

import pytest
from drives_rig import node

from legbench.drives.master.axis_link import AxisLink
from legbench.drives.protocol.datatypes import DataType
from legbench.drives.protocol.pdo import Mapped
from legbench.drives.setup.config import POSITION_ACTUAL, STATUSWORD, PdoConfig
from legbench.drives.setup.units import AxisUnits

TORQUE = Mapped(0x6077, 0, DataType.INTEGER16)


def shown(status: int, counts: int, torque: bytes = b"") -> bytes:
    return status.to_bytes(2, "little") + counts.to_bytes(4, "little", signed=True) + torque


def test_before_its_first_answer_a_drive_has_shown_nothing() -> None:
    for place in (0, 1):
        axis = AxisLink(node(place))
        assert (axis.fresh, axis.known) == (False, False)
        assert axis.missing_ids == axis.tpdo_ids == (0x181 + place,)
        assert (axis.statusword, axis.motor_counts, axis.link_counts) == (0, 0, 0)
        assert (axis.target_counts, axis.sent_counts) == (0, None)
        # Count 0 of either encoder, of which the knee's motor counts the other way.
        turn = math.tau / (1 << 20)
        assert axis.motor_pos == pytest.approx((-777 * turn, 777 * turn)[place])
        assert axis.link_pos == pytest.approx(55 * math.tau / (1 << 16))
        # Without a target that was sent, a stop keeps the one that is set.
        axis.target_counts = 4321
        axis.hold()
        assert axis.target_counts == 4321
        axis.frames(0x0F)
        axis.target_counts = 5000
        axis.hold()
        assert axis.target_counts == 4321


@pytest.mark.parametrize(
    ("units", "first", "next_shown", "counts"),
    [
        # A 12-bit encoder of a single turn: its first count is the one that is nearest to angle 0.
        (AxisUnits(counts_per_rev=4096, offset_counts=3000, modulus_counts=4096), 500, 4000, 4596),
        (AxisUnits(counts_per_rev=4096, offset_counts=100, modulus_counts=4096), 4000, 90, -96),
        # One that counts on for ever: its first count is what it shows.
        (AxisUnits(counts_per_rev=4096, offset_counts=-2_000_000_000), 2_000_000_000, 1, 2 * 10**9),
    ],
)
def test_a_position_that_repeats_is_first_the_one_nearest_to_angle_0(
    units: AxisUnits, first: int, next_shown: int, counts: int
) -> None:
    tpdo = (PdoConfig(number=1, objects=(STATUSWORD, POSITION_ACTUAL)),)
    axis = AxisLink(replace(node(0), motor=units, link=None, tpdos=tpdo))
    assert axis.feed(0x181, shown(0x37, first))
    assert axis.motor_counts == counts
    axis.feed(0x181, shown(0x37, next_shown))
    # From there on by the shorter way.
    assert abs(axis.motor_counts - counts) <= units.modulus // 2
    assert axis.motor_counts % units.modulus == next_shown


@pytest.mark.parametrize("sign", [1, -1])
def test_a_torque_has_the_scale_of_its_drive_and_the_direction_of_its_encoder(sign: int) -> None:
    tpdo = (PdoConfig(number=1, objects=(STATUSWORD, POSITION_ACTUAL, TORQUE)),)
    units = replace(node(0).motor, sign=sign)
    axis = AxisLink(
        replace(
            node(0), motor=units, link=None, tpdos=tpdo, torque_object=TORQUE, torque_scale=0.25
        )
    )
    assert math.isnan(axis.torque)
    assert axis.feed(0x181, shown(0x37, 9, (-8).to_bytes(2, "little", signed=True)))
    assert axis.torque == -2.0 * sign


def test_a_link_that_repeats_after_an_odd_number_of_counts_goes_the_shorter_way() -> None:
    usual = node(0)
    units = AxisUnits(counts_per_rev=4095, modulus_counts=4095, bits=16)
    axis = AxisLink(replace(usual, link=units))
    (pdo,) = usual.tpdos
    for counts, shown_counts in ((10, 10), (-5, 4090), (2042, 2042), (4089, 4089), (4095, 0)):
        values = {entry: 0 for entry in pdo.objects} | {usual.link_object: shown_counts}
        axis.feed(0x181, b"".join(values[e].to_bytes(e.bits // 8, "little") for e in pdo.objects))
        assert axis.link_counts == counts
