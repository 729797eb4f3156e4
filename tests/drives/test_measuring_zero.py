"""Encoder offsets from what five reads of each encoder show, in the field's exact numbers."""

import math
from dataclasses import replace
from types import SimpleNamespace
from typing import Any, cast

import pytest
from drives_rig import node
from service_rig import BENCH, opened, written

from legbench.commissioning import zero as zero_module
from legbench.commissioning.zero import EncoderZero, measure
from legbench.drives.errors import DriveError
from legbench.drives.setup.config import NodeConfig
from legbench.drives.setup.encoders import Side
from legbench.errors import ConfigError

Reads = list[tuple[int, int | None]]


def measured(
    monkeypatch: pytest.MonkeyPatch, of: NodeConfig, angle: float, reads: Reads
) -> tuple[EncoderZero, int]:
    """Offsets of a node whose encoders show these counts one after the other, and the reads."""
    left = list(reads)
    monkeypatch.setattr(zero_module, "read_counts", lambda _session, _node: left.pop(0))
    session = cast(Any, SimpleNamespace())
    return zero_module._node(session, of, angle), len(reads) - len(left)


def test_an_offset_is_what_is_shown_at_zero_by_the_median_of_five_reads(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    # A quarter of a turn: 2^18 of 2^20 counts of the motor, 2^14 of 2^16 of the link.
    reads: Reads = [(1000, 50), (1040, 10), (1003, 49), (1001, 40), (1002, 30)]
    for place, motor in ((0, 1002 - (1 << 18)), (1, 1002 + (1 << 18))):
        found, count = measured(monkeypatch, node(place), math.pi / 2.0, reads)
        assert (found.motor_offset, found.link_offset) == (motor, 40 - (1 << 14))
        assert (found.node, found.side, count) == (("hip", "knee")[place], Side.MOTOR, 5)


def test_a_link_encoder_is_measured_within_half_a_lap_of_zero(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    for shown, offset in ((32_767, 32_767), (-32_768, -32_768), (100, 100)):
        found, _ = measured(monkeypatch, node(0), 0.0, [(0, shown)] * 5)
        assert (found.motor_offset, found.link_offset) == (0, offset)


@pytest.mark.parametrize("encoder", [0, 1])
@pytest.mark.parametrize("read", range(5))
def test_one_read_more_than_40_counts_away_is_a_leg_that_moves(
    encoder: int, read: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    for away, moves in ((40, False), (-40, False), (41, True), (-41, True)):
        counts = [[500, 500] for _ in range(5)]
        counts[read][encoder] += away
        reads: Reads = [(motor, link) for motor, link in counts]
        if not moves:
            measured(monkeypatch, node(0), 0.0, reads)
            continue
        name = ("motor", "link")[encoder]
        with pytest.raises(DriveError, match=f"^{name} encoder of 'hip' moves by 41 counts"):
            measured(monkeypatch, node(0), 0.0, reads)


def test_a_drive_with_one_encoder_has_one_offset(monkeypatch: pytest.MonkeyPatch) -> None:
    one = replace(node(0), link=None)
    found, _ = measured(monkeypatch, one, 0.0, [(7, None)] * 5)
    assert (found.motor_offset, found.link_offset) == (7, None)
    units = replace(node(0).link or node(0).motor, bits=32)
    side = replace(node(0), motor=units, link=None, side=Side.LINK)
    found, _ = measured(monkeypatch, side, math.pi / 2.0, [(7, None)] * 5)
    assert (found.side, found.motor_offset) == (Side.LINK, 7 - (1 << 14))


@pytest.mark.parametrize("place", [0, 1])
def test_a_posture_has_an_angle_of_at_most_half_a_turn_for_each_node(place: int) -> None:
    posture = [0.0, 0.0]
    for angle, refused in (
        (math.pi, False),
        (-math.pi, False),
        (math.nextafter(math.pi, 4.0), True),
        (math.nextafter(-math.pi, -4.0), True),
        (math.nan, True),
    ):
        posture[place] = angle
        session, network = opened()
        with session:
            if not refused:
                assert [one.node for one in measure(session, posture)] == ["motor1", "motor2"]
                continue
            with pytest.raises(ConfigError, match=r"an angle of the posture is .*; it must be -pi"):
                measure(session, posture)
        assert written(network) == []
    for wrong in ([0.0], [0.0] * 3):
        session, _ = opened()
        with session, pytest.raises(ValueError, match="zip"):
            measure(session, wrong)
    assert len(BENCH.nodes) == 2
