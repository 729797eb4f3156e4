"""Drives that differ from the standard: each difference alone, and random combinations."""

import random
from dataclasses import replace
from typing import Any

import pytest
from odd_drive_draw import (
    INTERPOLATES,
    Drawn,
    ordinary,
)
from odd_drives import START, pair, trial

from legbench.drives.protocol.datatypes import DataType
from legbench.drives.protocol.pdo import Mapped
from legbench.drives.protocol.sdo import Abort
from legbench.drives.protocol.sdo_server import SdoAnswers
from legbench.drives.setup.encoders import Side
from legbench.drives.setup.parameters import Parameter
from legbench.drives.setup.pdos import CONTROLWORD, STATUSWORD, packed
from legbench.drives.setup.quirks import ModeShown
from legbench.drives.setup.units import AxisUnits

T = DataType
BLOCKS, OF = 3, 20


def led(*drives: Drawn) -> str | None:
    """Lead an odd drive beside an ordinary one; the refusal, none if both ran as they should."""
    found = trial((*drives, ordinary(1, START[1]))[:2])
    assert found.wrong == ()
    return found.refused


def behaving(**changes: Any) -> Drawn:
    """An ordinary drive but for its behaviour."""
    drawn = ordinary(0, START[0])
    return replace(drawn, behaviour=replace(drawn.behaviour, **changes))


def told(drawn: Drawn, **quirks: Any) -> Drawn:
    """The same drive with the quirks that its bus file tells."""
    node = replace(drawn.node, quirks=replace(drawn.node.quirks, **quirks))
    return replace(drawn, node=node)


def built(**changes: Any) -> Drawn:
    """An ordinary drive but for its node, its process data packed by itself."""
    drawn = ordinary(0, START[0])
    there = {
        name: getattr(drawn.node, name)
        for name in ("motor_object", "target_object", "link", "link_object", "torque_object")
    } | changes
    answers = [STATUSWORD, there["motor_object"]]
    answers += [there["link_object"]] if there["link"] is not None else []
    answers += [there["torque_object"]] if there["torque_object"] is not None else []
    rpdos = packed((CONTROLWORD, there["target_object"]), deadline_ms=20)
    return replace(drawn, node=replace(drawn.node, **changes, rpdos=rpdos, tpdos=packed(answers)))


# --- what is answered, and what is not there -------------------------------------------------


@pytest.mark.parametrize("answers", [SdoAnswers.FOUR_BYTES, SdoAnswers.UNSIZED])
def test_answers_of_four_bytes_or_without_a_size_are_read(answers: SdoAnswers) -> None:
    assert led(behaving(sdo_answers=answers)) is None


CODES = (Abort.NO_OBJECT, Abort.GENERAL, Abort.UNSUPPORTED_ACCESS)
NOT_NEEDED: tuple[Any, ...] = (
    0x603F, (0x1018, 3), (0x1018, 4), 0x1005, 0x1006, 0x1016, 0x1017, 0x1029, 0x605A, 0x605B,
    0x605C, 0x605D, 0x605E, 0x607E, 0x60B0, 0x60B1, 0x60B2, 0x60C2, (0x1400, 5),
)  # fmt: skip


@pytest.mark.parametrize(
    ("lacks", "code"),
    [
        pytest.param(
            lacks, CODES[(place + turn) % len(CODES)], marks=[pytest.mark.long] if turn else []
        )
        for place, lacks in enumerate(NOT_NEEDED)
        for turn in (0, 1)
    ],
    ids=str,
)
def test_drives_do_without_objects_that_nothing_depends_on(lacks: Any, code: Abort) -> None:
    drive = behaving(lacks=frozenset([lacks]), lacking=code, defaults=INTERPOLATES)
    assert led(drive) is None


def test_a_drive_without_a_quick_stop_ramp_needs_another_one() -> None:
    drive = behaving(lacks=frozenset([0x6085]))
    refused = led(drive)
    assert refused is not None
    assert "does not take its quick-stop ramp, 6085h" in refused
    assert 'give "6084:00 u32" instead of "6085:00 u32"' in refused
    (ramp,) = drive.node.parameters
    other = Parameter(index=0x6084, sub=0, kind=T.UNSIGNED32, value=ramp.value)
    assert led(replace(drive, node=replace(drive.node, parameters=(other,)))) is None


def test_a_drive_that_nothing_of_its_own_stops_is_refused() -> None:
    refused = led(behaving(lacks=frozenset([0x1016, (0x1400, 5)])))
    assert refused is not None
    assert "would not stand within 100 ms of its master's death" in refused
    assert "1016h" in refused
    assert "140" in refused


def test_an_identity_that_is_not_told_is_not_compared() -> None:
    drive = behaving(lacks=frozenset([(0x1018, 4)]))
    asked = replace(drive.node, identity=replace(drive.node.identity, serial=7))
    refused = led(replace(drive, node=asked))
    assert refused is not None
    assert "does not tell its serial (1018h)" in refused
    assert "leave serial out of the bus file" in refused


# --- modes, bits, warnings -------------------------------------------------------------------


def test_a_mode_that_follows_after_seconds_is_waited_for_as_the_bus_file_says() -> None:
    slow = behaving(mode_lag_us=4_000_000)
    refused = led(slow)
    assert refused is not None
    assert "stays in mode 0 (6061h) for 500 ms" in refused
    assert "raise mode_patience_ms in [node.quirks]" in refused
    assert led(told(slow, mode_patience_ms=6000)) is None


@pytest.mark.parametrize(
    ("follows", "lag_us"),
    [
        *((follows, 0) for follows in (True, False)),
        (False, 3_000_000),
        pytest.param(True, 3_000_000, marks=pytest.mark.long),
        *(pytest.param(follows, 300_000, marks=pytest.mark.long) for follows in (True, False)),
    ],
)
def test_a_mode_that_is_shown_with_power_alone_is_asked_for_then(
    lag_us: int, follows: bool
) -> None:
    drive = behaving(mode_needs_power=True, mode_lag_us=lag_us, follows_bit=follows)
    refused = led(told(drive, follows_bit=follows))
    assert refused is not None
    assert 'give mode_shown = "enabled"' in refused
    quirks = {"mode_shown": ModeShown.ENABLED, "follows_bit": follows}
    assert led(told(drive, mode_patience_ms=6000, **quirks)) is None
    if lag_us > 2_500_000:
        refused = led(told(drive, mode_patience_ms=100, **quirks))
        assert refused is not None
        assert "mode 8 is not shown in 6061h within 100 ms" in refused


def test_a_drive_that_never_shows_bit_12_is_believed_when_the_bus_file_says_so() -> None:
    drive = behaving(follows_bit=False)
    refused = led(drive)
    assert refused is not None
    assert "give follows_bit = false in [node.quirks] if it never shows bit 12 of 6041h" in refused
    assert led(told(drive, follows_bit=False)) is None


def test_emergencies_that_warn_end_a_run_unless_the_bus_file_lists_them() -> None:
    drive = behaving(warnings=(0xFF01, 0x5112))
    refused = led(drive)
    assert refused is not None
    assert "EMCY FF01h" in refused
    assert "give warnings = [0xFF01] in [node.quirks]" in refused
    refused = led(told(drive, warnings=(0xFF01,)))
    assert refused is not None
    assert "EMCY 5112h" in refused
    assert led(told(drive, warnings=(0xFF01, 0x5112))) is None


# --- numbers ---------------------------------------------------------------------------------


@pytest.mark.parametrize("kind", [T.INTEGER8, T.UNSIGNED8, T.INTEGER16, T.INTEGER32, T.REAL32])
@pytest.mark.parametrize("answers", list(SdoAnswers))
def test_temperatures_have_any_type(kind: DataType, answers: SdoAnswers) -> None:
    drive = built(temperature_object=Mapped(0x3100, 1, kind), temperature_scale=1.0)
    how = replace(drive.behaviour, sdo_answers=answers)
    assert led(replace(drive, behaviour=how)) is None


@pytest.mark.parametrize("bits", [12, 13, 17, 20, 21, 24, 32])
@pytest.mark.parametrize("lowest", [0, -(1 << 11), -1000])
def test_single_turn_encoders_wrap_anywhere(bits: int, lowest: int) -> None:
    # The seam lies at -0.45 rad, between the start and the end of the way.
    per_rev = min(1 << bits, 1 << 31)
    modulus = 1 << bits
    offset = lowest + round(0.45 * per_rev / 6.283185307179586)
    units = AxisUnits(
        counts_per_rev=per_rev,
        bits=64,
        modulus_counts=modulus,
        lowest_count=lowest,
        offset_counts=offset,
    )
    ramp = Parameter(
        index=0x6085, sub=0, kind=T.UNSIGNED32, value=min(4_294_967_295, per_rev * 3000)
    )
    drive = built(
        motor=units,
        link=units,
        motor_object=Mapped(0x6064, 0, T.INTEGER64),
        target_object=Mapped(0x607A, 0, T.INTEGER64),
        link_object=Mapped(0x3000, 7, T.INTEGER64),
        parameters=(ramp,),
    )
    refused = led(drive)
    if bits == 32:
        assert refused is not None
        assert "on its quick-stop ramp" in refused  # 32 bits of 6085h do not hold one
    else:
        assert refused is None


@pytest.mark.parametrize(
    "kind", [T.INTEGER16, T.UNSIGNED16, T.INTEGER32, T.UNSIGNED32, T.INTEGER64, T.UNSIGNED64]
)
def test_positions_have_any_type(kind: DataType) -> None:
    bits = 8 * {T.INTEGER16: 2, T.UNSIGNED16: 2, T.INTEGER32: 4, T.UNSIGNED32: 4}.get(kind, 8)
    signed = kind in (T.INTEGER16, T.INTEGER32, T.INTEGER64)
    units = AxisUnits(
        counts_per_rev=1 << 12 if bits == 16 else 1 << 18,
        bits=bits,
        lowest_count=None if signed else 0,
        offset_counts=0 if signed else 1 << bits // 2,
    )
    ramp = Parameter(index=0x6085, sub=0, kind=T.UNSIGNED32, value=3000 << 18)
    drive = built(
        motor=units,
        link=replace(units, gear=1.0),
        motor_object=Mapped(0x6064, 0, kind),
        target_object=Mapped(0x607A, 0, kind),
        link_object=Mapped(0x3000, 7, kind),
        parameters=(ramp,),
    )
    if kind is T.UNSIGNED16:
        # From 0 on, 256 counts are 0.4 rad: less than the motor may go.
        refused = led(drive)
        assert refused is not None
        assert "of 16 bits hold 0 to 65535" in refused
        units = replace(units, offset_counts=1 << 15)
        drive = replace(drive, node=replace(drive.node, motor=units, link=units))
    assert led(drive) is None


def test_a_turn_that_cannot_be_known_at_power_on_is_refused() -> None:
    drive = built(
        motor=AxisUnits(counts_per_rev=4096, gear=6.0, modulus_counts=4096, lowest_count=0),
    )
    refused = led(drive)
    assert refused is not None
    assert "6064h:00 repeats every 1.047 rad" in refused
    assert "have the drive count its turns (multi-turn)" in refused


# --- process data ----------------------------------------------------------------------------


@pytest.mark.parametrize("fixed", [True, False])
@pytest.mark.parametrize(("rpdos", "tpdos"), [(1, 1), (2, 3), (4, 4), (7, 6)])
def test_any_number_of_pdos_will_do(rpdos: int, tpdos: int, fixed: bool) -> None:
    assert led(behaving(rpdos=rpdos, tpdos=tpdos, fixed_mapping=fixed)) is None


def test_a_pdo_that_is_not_there_is_named() -> None:
    drive = built(
        motor_object=Mapped(0x6064, 0, T.INTEGER64),
        target_object=Mapped(0x607A, 0, T.INTEGER64),
        motor=AxisUnits(counts_per_rev=1 << 16, bits=64),
    )
    refused = led(replace(drive, behaviour=replace(drive.behaviour, rpdos=1)))
    assert refused is not None
    assert "1401h:01" in refused
    assert "map its objects into the PDOs that the drive has" in refused


# --- one encoder -----------------------------------------------------------------------------


@pytest.mark.parametrize("torque", [None, Mapped(0x6077, 0, T.INTEGER16)])
@pytest.mark.parametrize("side", list(Side))
def test_one_encoder_leads_a_joint(side: Side, torque: Mapped | None) -> None:
    assert led(built(link=None, side=side, torque_object=torque, torque_scale=0.01)) is None


# --- together --------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "block", [0, *(pytest.param(block, marks=pytest.mark.long) for block in range(1, BLOCKS))]
)
def test_random_combinations_run_or_are_refused_in_one_line(block: int) -> None:
    chance = random.Random(f"odd drives {block}")
    ran = 0
    for _ in range(OF):
        found = trial(pair(chance))
        assert found.wrong == (), (found.wrong, [drive.quirks for drive in found.drives])
        ran += found.refused is None
    assert ran >= OF // 5
