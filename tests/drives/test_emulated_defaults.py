"""An emulated drive of which nothing is said, and what it shows of its motor in each period."""

import random
from dataclasses import replace
from types import SimpleNamespace
from typing import Any, cast

import pytest
from drives_rig import MS, config, node

from legbench.drives.emulated.actual_values import ActualValues
from legbench.drives.emulated.behaviour import Behaviour, MissingSetpoint
from legbench.drives.emulated.build import emulate
from legbench.drives.emulated.drive import UNDER_VOLTAGE, EmulatedDrive
from legbench.drives.emulated.sensors import Encoder, SensorFault
from legbench.drives.protocol.datatypes import DataType
from legbench.drives.protocol.frame import Frame
from legbench.drives.protocol.objects import Key
from legbench.drives.protocol.pdo import Mapped
from legbench.drives.protocol.sdo import Abort
from legbench.drives.setup.units import AxisUnits

ASKED = {
    "reply_delay_us": (50, 250),
    "seed": 0,
    "interpolate": True,
    "missing_setpoint": MissingSetpoint.HOLD,
    "missing_limit": 3,
    "sync_loss_periods": 5,
    "slow_loop": False,
    "ignores": frozenset(),
    "status_lag_us": 0,
    "bandwidth": None,
    "slew_rate": None,
    "setpoint_delay": 0,
    "motor_noise": None,
    "mode_lag_us": 2000,
    "mode_needs_power": False,
    "follows_bit": True,
    "lacks": frozenset(),
    "lacking": Abort.NO_OBJECT,
    "defaults": (),
    "rpdos": 4,
    "tpdos": 4,
    "fixed_mapping": False,
    "warnings": (),
    "halt_blocks_mode": True,
    "boot_us": 5000,
    "hard_stop": None,
    "home_switch": None,
    "start_pos": 0.0,
    "rated_torque": 10.0,
}
IDEAL = {"reply_delay_us": (0, 0), "interpolate": False}


def test_a_drive_of_which_nothing_is_said_is_the_usual_one() -> None:
    usual, ideal = Behaviour(), Behaviour.ideal()
    for name, value in ASKED.items():
        assert getattr(usual, name) == value
        assert getattr(ideal, name) == IDEAL.get(name, value)
    assert Behaviour.ideal(0.25) == Behaviour(start_pos=0.25, **cast(Any, IDEAL))


@pytest.mark.parametrize(("polarity", "sign"), [(0x00, 1), (0x80, -1)])
def test_a_drive_shows_its_demand_its_error_and_its_limit_switches(
    polarity: int, sign: int
) -> None:
    """The hip, whose counts grow forward, 100 counts behind its demand."""
    behaviours = [Behaviour(hard_stop=(-1.0, 1.0)), Behaviour()]
    axis = emulate(config(), behaviours).drives[0].axis
    values, motion = axis._values, axis.motion
    values[0x607E, 0] = polarity
    for angle, switches in ((0.0, 0b00), (-1.0, 0b01), (1.0, 0b10)):
        motion.actual = float(round(777 + angle * (1 << 20) / 6.283185307179586))
        motion.demand = motion.actual + 100.0
        axis.publish()
        # CiA 402: demand 6062h, error 60F4h, digital inputs 60FDh, all in the drive's own sign.
        assert values[0x6062, 0] == sign * motion.demand
        assert values[0x60F4, 0] == sign * 100
        if sign < 0:
            switches = {0b01: 0b10, 0b10: 0b01}.get(switches, 0)
        assert values[0x60FD, 0] == switches
    # A drive without stops has no switches, and shows none.
    other = emulate(config()).drives[0].axis
    other.publish()
    assert other._values[0x60FD, 0] == 0


def test_a_mode_that_is_set_already_is_taken_while_the_drive_is_halted() -> None:
    for blocks in (True, False):
        behaviours = [Behaviour(halt_blocks_mode=blocks)] * 2
        axis = emulate(config(), behaviours).drives[0].axis
        # 6061h still shows another mode than 6060h holds; bit 8 of 6040h is the halt.
        axis._values[0x6060, 0], axis._values[0x6061, 0] = 8, 6
        for halt, other in ((0x000, None), (0x100, Abort.DEVICE_STATE if blocks else None)):
            axis._values[0x6040, 0] = halt
            assert axis.check((0x6060, 0), 8) is None
            assert axis.check((0x6060, 0), 6) is other
            assert axis.check((0x6060, 0), 99) is Abort.INVALID_VALUE


def test_each_object_shows_the_link_in_its_own_bits_and_the_torque_in_its_own_scale() -> None:
    torque = Mapped(0x2065, 0, DataType.INTEGER16)
    own = AxisUnits(counts_per_rev=4096, bits=16, modulus_counts=4096)
    one = replace(node(0), link=own)
    assert one.link_object.key == (0x2064, 0)
    values: dict[Key, int] = {}
    how = SimpleNamespace(
        link=own,
        link_units=own,
        link_object=one.link_object,
        motor=one.motor,
        motor_object=one.motor_object,
        torque_object=torque,
        torque_scale=0.01,
    )
    links = ((0x60E4, 1), (0x2064, 0))
    shown = ActualValues(cast(Any, how), 10.0, values, links)
    same = SimpleNamespace(show=lambda counts: counts)
    sensors = cast(Any, SimpleNamespace(motor=same, link=same))
    motion = cast(Any, SimpleNamespace(sign=1, actual=500.0, demand=700.0, beside=100.0))
    for counts, long, short in ((5000, 5000, 904), (-1, -1, 4095), (1 << 31, -1 << 31, 0)):
        shown.update(motion, sensors, counts, 2.5)
        assert (values[0x60E4, 1], values[0x2064, 0]) == (long, short)
    # What stands beside the motor is shown with it: the link's encoder leads the loop.
    assert (values[0x6064, 0], values[0x6062, 0], values[0x60F4, 0]) == (600, 700, 100)
    assert (values[0x6077, 0], values[0x2065, 0]) == (250, 250)
    shown.update(motion, sensors, 0, 400.0)
    assert (values[0x6077, 0], values[0x2065, 0]) == (32767, 32767)
    # The usual drive shows the same link in 16 bits besides, which repeat.
    how.link_object = Mapped(0x60E4, 1, DataType.INTEGER32)
    how.link_units = AxisUnits(counts_per_rev=4096)
    ActualValues(cast(Any, how), 10.0, values, links).update(motion, sensors, 40_000, 0.0)
    assert (values[0x60E4, 1], values[0x2064, 0]) == (40_000, 40_000 - 65_536)


# --- the drive by itself ---------------------------------------------------------------------


def booted(**how: Any) -> EmulatedDrive:
    """A drive that has booted after 5 ms, and whose message of it is sent."""
    drive = EmulatedDrive(node(0), Behaviour(**how))
    drive.tick(5 * MS)
    assert drive.take() == [(5 * MS, Frame(0x701, b"\0"))]
    return drive


@pytest.mark.parametrize("seed", [0, 3])
def test_replies_are_as_late_as_the_dice_of_their_seed_and_node_say(seed: int) -> None:
    drive = booted(seed=seed)
    # 127 nodes have dice of their own, and so has each seed.
    dice = random.Random(127 * seed + 1)
    for number in range(4):
        now_ns = (6 + number) * MS
        drive.receive(Frame(0x601, bytes.fromhex("4000100000000000")), now_ns)
        ((at_ns, frame),) = drive.take()
        assert at_ns == now_ns + 1000 * dice.randint(50, 250)
        assert frame.cob_id == 0x581


def test_a_reset_takes_back_what_was_not_sent_yet() -> None:
    drive = booted()
    drive.receive(Frame(0x601, bytes.fromhex("4000100000000000")), 6 * MS)
    drive.reset(7 * MS)
    assert drive.take() == []
    drive.tick(12 * MS)
    assert drive.take() == [(12 * MS, Frame(0x701, b"\0"))]


def test_a_drive_takes_over_where_its_link_is_and_what_its_spring_carries() -> None:
    drive = booted()
    values = drive.axis._values
    drive.sense(0.5, 2.5)
    # 65536 counts a turn from -55 on; 2.5 of 10 N m in permille.
    link = round(-55 + 0.5 * 65536 / 6.283185307179586)
    assert (values[0x2064, 0], values[0x60E4, 1], values[0x6077, 0]) == (link, link, 250)


def test_a_consumer_that_is_told_anew_waits_for_its_producer_once_more() -> None:
    for told_anew in (True, False):
        drive = booted()
        watched = (126 << 16 | 30).to_bytes(4, "little")
        drive._store.write(0x1016, 1, watched)
        drive.receive(Frame(0x000, b"\x01\x01"), 6 * MS)
        drive.receive(Frame(0x77E, b"\x05"), 7 * MS)
        if told_anew:
            drive._store.write(0x1016, 1, watched)
        drive.tick(60 * MS)
        # 8130h: life guard or heartbeat error (CiA 301).
        lost = [frame for _, frame in drive.take() if frame.cob_id == 0x081]
        assert [frame.data[:2] for frame in lost] == ([] if told_anew else [b"\x30\x81"])


def test_an_encoder_that_fails_by_nothing_shows_what_is_and_one_that_froze_at_once_zero() -> None:
    for ailment in (SensorFault.STEP, SensorFault.DRIFT):
        encoder = Encoder(1000.0)
        encoder.fail(ailment)
        encoder.tick(1_000_000_000)
        assert encoder.show(5) == 5
        encoder.fail(ailment, 0.25)
        encoder.tick(1_000_000_000)
        assert encoder.show(5) == 255
    encoder = Encoder(1000.0)
    encoder.fail(SensorFault.FROZEN)
    assert encoder.show(5) == 0
    encoder.fail(None)
    assert encoder.show(5) == 5
    encoder.fail(SensorFault.FROZEN)
    assert encoder.show(9) == 5


def test_what_strikes_a_drive_is_reported_in_the_instant_in_which_it_strikes() -> None:
    drive = booted()
    drive.trip(UNDER_VOLTAGE, 9 * MS)
    ((at_ns, frame),) = drive.take()
    # Emergencies of node 1 begin with their code, 3220h (CiA 301, CiA 402).
    assert (at_ns, frame.cob_id, frame.data[:2]) == (9 * MS, 0x081, b"\x20\x32")
    drive = booted()
    drive.receive(Frame(0x000, b"\x01\x01"), 10 * MS)
    # The first RPDO of the usual drive has six bytes; 8210h: too short to be processed.
    drive._store.values[0x1600, 0], drive._store.values[0x1600, 1] = 1, 0x607A0020
    drive._store.values[0x1400, 1] = 0x201
    drive._pdos.rebuild()
    drive.receive(Frame(0x201, b"\1"), 11 * MS)
    ((at_ns, frame),) = drive.take()
    assert (at_ns, frame.cob_id, frame.data[:2]) == (11 * MS, 0x081, b"\x10\x82")


def test_what_is_not_sent_when_a_drive_leaves_the_bus_is_never_sent() -> None:
    drive = booted()
    drive.receive(Frame(0x601, bytes.fromhex("4000100000000000")), 6 * MS)
    drive.bus_off(7 * MS)
    assert [frame.cob_id for _, frame in drive.take()] == []


def test_a_target_alone_is_a_fresh_set_point() -> None:
    drive = booted()
    for key, value, fresh in (((0x6060, 0), b"\x08", False), ((0x607A, 0), bytes(4), True)):
        drive._store.write(*key, value)
        assert drive._reception.fresh is fresh
