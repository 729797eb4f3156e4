"""What a master may send that only looks, what one cycle showed, what a silent bus is told by."""

import itertools
from types import SimpleNamespace
from typing import Any, cast

import can
import pytest
from drives_rig import config

from legbench.drives.errors import BusError, NoAnswerError
from legbench.drives.master.cycle import Tick
from legbench.drives.master.first_contact import first_contact
from legbench.drives.master.read_only import may_pace, may_read
from legbench.drives.master.sample import sample_of
from legbench.drives.protocol.slcan import BITRATES, bitrate_of_registers


def test_of_all_frames_only_questions_may_be_sent() -> None:
    # Client command specifiers (CiA 301, 7.2.4.3): 2 upload, 3 upload segment, 4 abort.
    for cob_id, specifier in itertools.product(range(1 << 11), range(8)):
        asks = 0x601 <= cob_id <= 0x67F and specifier in (2, 3, 4)
        assert may_read(cob_id, bytes((specifier << 5 | 0x1F,))) == asks
        assert not may_read(cob_id, b"")


@pytest.mark.parametrize("master_id", [1, 126])
def test_to_pace_drives_takes_start_sync_heartbeat_and_the_way_back(master_id: int) -> None:
    allowed = may_pace(master_id)
    for cob_id, first in itertools.product(range(1 << 11), (0, 1, 2, 0x40, 0x80, 0x81, 0x82)):
        wanted = cob_id in (0x080, 0x700 + master_id) or may_read(cob_id, bytes((first,)))
        if cob_id == 0x000:
            wanted = first in (1, 128)
        assert allowed(cob_id, bytes((first, 1))) == wanted, f"{cob_id:03X}#{first:02X}"
    assert not allowed(0x000, b"")


def test_a_sample_is_what_each_drive_showed_and_the_springs_between() -> None:
    axes = [
        SimpleNamespace(motor_pos=0.5, link_pos=0.2, statusword=0x1237, fresh=True),
        SimpleNamespace(motor_pos=-1.0, link_pos=-0.4, statusword=0x0250, fresh=False),
    ]
    polls = [SimpleNamespace(celsius=36.9), SimpleNamespace(celsius=None)]
    cycle = cast(Any, SimpleNamespace(axes=axes, polls=polls))
    sample = sample_of(cycle, Tick(7_000, 30, 2, 1, True), (4.0, 5.0), (0.1, 0.2))
    assert sample.spring_torque == pytest.approx((4.0 * 0.3, 5.0 * -0.6))
    assert sample._replace(spring_torque=()) == (
        *(7_000, 30, 2),
        *((0.5, -1.0), (0.2, -0.4), (), (0.1, 0.2)),
        *((0x1237, 0x0250), (True, False), (36.9, None)),
    )


@pytest.mark.parametrize("error_frames", [0, 3])
@pytest.mark.parametrize("off_bus", [False, True])
@pytest.mark.parametrize("kind", [NoAnswerError, BusError])
def test_a_bus_that_carries_only_errors_is_told_apart_from_one_that_is_silent(
    kind: type[Exception], off_bus: bool, error_frames: int
) -> None:
    bus = cast(can.BusABC, SimpleNamespace(channel_info="slcan0"))
    port = cast(Any, SimpleNamespace(bus=bus, off_bus=off_bus, error_frames=error_frames))
    with pytest.raises((BusError, NoAnswerError)) as caught, first_contact(port, config()):
        raise kind("no word")
    wrong = f"slcan0: {error_frames} error frames and no answer"
    wrong += ", the controller has gone bus-off" if off_bus else ""
    wrong += "; another bitrate than the drives', or a fault of the wiring: "
    text, rate = str(caught.value), config().bitrate_text
    if error_frames or off_bus:
        assert type(caught.value) is BusError
        assert text == ("no word; " if kind is NoAnswerError else "") + wrong + rate
    else:
        assert type(caught.value) is kind
        assert text == ("no word" if kind is BusError else f"no word; {rate}")


def test_bitrates_of_serial_adapters_are_those_of_the_manual() -> None:
    assert BITRATES == {
        "S0": 10_000,
        "S1": 20_000,
        "S2": 50_000,
        "S3": 100_000,
        "S4": 125_000,
        "S5": 250_000,
        "S6": 500_000,
        "S7": 750_000,
        "S8": 1_000_000,
        "S9": 83_300,
    }
    # SJA1000: 16 MHz crystal, two periods times 1 + BRP a quantum; 1 + TSEG1 + 1 and TSEG2 + 1.
    for prescaler, first, second in itertools.product(range(64), range(16), range(8)):
        quantum = 2 * (prescaler + 1) / 16e6
        bit = quantum * (1 + (first + 1) + (second + 1))
        for jump, thrice in itertools.product((0, 3), (0, 1)):
            registers = bytes((jump << 6 | prescaler, thrice << 7 | second << 4 | first))
            assert bitrate_of_registers(registers.hex()) == round(1.0 / bit)
