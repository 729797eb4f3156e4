"""Details of an emulated drive in which a wrong one would still move: once, in place, in order."""

import pytest
from drive_bench import OE, Bench, counts
from drives_rig import MS, config

from legbench.drives.emulated.behaviour import Behaviour
from legbench.drives.emulated.build import emulate
from legbench.drives.emulated.homing import START, Homing, HomingState
from legbench.drives.emulated.motion import Motion
from legbench.drives.emulated.switches import Switches
from legbench.drives.errors import SdoAbortError
from legbench.drives.protocol.frame import Frame
from legbench.drives.protocol.objects import Key
from legbench.drives.protocol.sdo import Abort
from legbench.drives.setup.units import AxisUnits


def refusal(bench: Bench, index: int, sub: int, value: int) -> int | None:
    """Abort code that a drive answers a write with, if it does."""
    try:
        bench.put(index, sub, value)
    except SdoAbortError as error:
        return error.code
    return None


# --- power and motion ------------------------------------------------------------------------


def test_a_drive_warns_when_it_is_enabled_and_at_no_other_command() -> None:
    bench = Bench(warnings=(0xFF42, 0xFF43))
    assert bench.emergencies() == []
    for word in (0x06, 0x07):
        bench.word = word
        bench.cycle(3)
    assert bench.emergencies() == []
    bench.word = 0x0F
    bench.cycle(5)
    assert bench.axis is OE
    assert bench.emergencies() == [0xFF42, 0xFF43]
    bench.word = 0x07
    bench.cycle(2)
    bench.word = 0x0F
    bench.cycle(2)
    assert bench.emergencies() == [0xFF42, 0xFF43] * 2


def test_a_drive_without_power_wants_to_be_where_it_is() -> None:
    bench = Bench()
    bench.enable()
    bench.target = counts(0.02)
    bench.cycle(2)
    bench.word = 0x00
    bench.cycle(1)
    bench.drive.axis.motion.demand += 500.0
    bench.cycle(1)
    motion = bench.drive.axis.motion
    assert motion.demand == motion.actual
    assert bench.get(0x6062) == bench.get(0x6064)


def test_a_mode_that_was_stored_is_entered_at_power_on() -> None:
    bench = Bench(configured=False)
    for stored, shown in ((8, 8), (6, 6), (0, 0)):
        axis = bench.drive.axis
        axis._values[0x6060, 0], axis._values[0x6061, 0] = stored, 0
        axis.restart()
        axis.boot(bench.now_ns)
        bench.wait(20)
        assert bench.get(0x6061) == shown


# --- homing ----------------------------------------------------------------------------------


def test_an_index_pulse_of_an_interrupted_search_is_forgotten() -> None:
    units = AxisUnits(counts_per_rev=1000)
    behaviour = Behaviour(start_pos=0.1)
    values: dict[Key, int] = {
        (0x6098, 0): 34,
        (0x607C, 0): 0,
        (0x6099, 1): 500,
        (0x6099, 2): 500,
        (0x6080, 0): 0,
        (0x607E, 0): 0,
    }
    motion, homing = Motion(units, behaviour, values), Homing(values, Switches(units, behaviour))
    homing.command(START)
    for _ in range(3):
        homing.step(motion, 1_000_000)
        motion.drive(1_000_000)
    homing.command(0)
    assert homing.state is HomingState.IDLE
    # Turned on by hand beyond that pulse: the next one is another.
    motion.actual = motion.demand = 1200.0
    homing.command(START)
    for _ in range(5000):
        if homing.state is not HomingState.SEARCHING:
            break
        homing.step(motion, 1_000_000)
        motion.drive(1_000_000)
    assert homing.state is HomingState.ATTAINED
    assert motion.travel == pytest.approx(2000.0, abs=1e-2)


# --- process data ----------------------------------------------------------------------------


def test_a_pdo_that_exists_keeps_its_identifier_and_may_be_told_it_again() -> None:
    bench = Bench()
    there = bench.get(0x1800, 1)
    assert refusal(bench, 0x1800, 1, there) is None
    assert refusal(bench, 0x1800, 1, there ^ 0x100) == Abort.INVALID_VALUE
    assert bench.get(0x1800, 1) == there
    for value, code in ((240, None), (241, Abort.INVALID_VALUE), (253, Abort.INVALID_VALUE)):
        assert refusal(bench, 0x1800, 2, value) == code
    for value in (254, 255, 1):
        assert refusal(bench, 0x1800, 2, value) is None
    # An event timer or an inhibit time of such a number is none of these types.
    assert refusal(bench, 0x1800, 5, 245) is None
    assert refusal(bench, 0x1800, 3, 245) == Abort.DEVICE_STATE
    bench.put(0x1800, 1, there | 1 << 31)
    assert refusal(bench, 0x1800, 3, 245) is None


def test_a_mapping_is_as_long_as_its_count_whatever_stands_behind_it() -> None:
    bench = Bench(configured=False)
    words = (0x60640020, 0x60620020, 0x60F40020)
    for sub, word in enumerate(words, start=1):
        bench.put(0x1A00, sub, word)
    assert refusal(bench, 0x1A00, 0, 3) == Abort.PDO_LENGTH
    assert refusal(bench, 0x1A00, 0, 2) is None
    assert bench.get(0x1A00, 0) == 2


# --- times -----------------------------------------------------------------------------------


def test_an_answer_leaves_after_the_delay_of_its_drive_to_the_microsecond() -> None:
    for delay_us in (1, 120, 250):
        bench = Bench(reply_delay_us=(delay_us, delay_us))
        bench.cycle(3)
        bench.sent.clear()
        began_ns = bench.now_ns
        bench.give(Frame(0x80))
        answers = [at_ns - began_ns for at_ns, frame in bench.sent if frame.cob_id == 0x181]
        assert answers == [1000 * delay_us]


def test_every_drive_of_a_bus_is_heard_in_the_tick_in_which_it_sends() -> None:
    network = emulate(config(), [Behaviour(boot_us=3000), Behaviour(boot_us=3000)], keep_log=True)
    network.advance(3 * MS + MS // 2)
    heard = [(frame.cob_id, frame.data) for _, frame in network.log or []]
    assert heard == [(0x701, b"\0"), (0x702, b"\0")]
