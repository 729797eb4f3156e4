"""The emulated drive by itself, frame by frame."""

import math

import pytest
from drive_bench import OE, OFFSET, PER_RAD, SOD, Bench, counts
from drives_rig import MS, node

from legbench.drives.emulated.behaviour import Behaviour, MissingSetpoint
from legbench.drives.emulated.drive import OVER_TEMPERATURE, UNDER_VOLTAGE, EmulatedDrive
from legbench.drives.errors import SdoAbortError
from legbench.drives.protocol.cia402 import Controlword, DriveState, StatusBit, decode_state
from legbench.drives.protocol.datatypes import DataType, unpack
from legbench.drives.protocol.frame import Frame
from legbench.drives.protocol.nmt import NmtCommand, NmtState, nmt_frame
from legbench.drives.protocol.objects import OBJECTS
from legbench.drives.protocol.sdo import Abort
from legbench.drives.protocol.sdo_client import Download, Upload


def test_boot_up_comes_first_and_only_once() -> None:
    bench = Bench(configured=False)
    assert [frame for _, frame in bench.sent] == [Frame(0x701, b"\0")]
    assert bench.sent[0][0] == 5 * MS
    assert bench.axis is SOD


def test_every_object_can_be_read_and_its_access_is_kept() -> None:
    bench = Bench(configured=False)
    bench.drive.trip(OVER_TEMPERATURE, bench.now_ns)
    for (index, sub), entry in OBJECTS.items():
        bench.read(index, sub)
        if entry.access.value in ("ro", "const"):
            with pytest.raises(SdoAbortError, match="write a read only object"):
                bench._carry(Download(index, sub, b"\0"))
    for index, sub, abort in (
        (0x3000, 0, Abort.NO_OBJECT),
        (0x1018, 9, Abort.NO_SUB_INDEX),
    ):
        with pytest.raises(SdoAbortError) as caught:
            bench._carry(Upload(index, sub))
        assert caught.value.code == abort
    for data, abort in ((b"\1", Abort.TOO_SHORT), (b"\1\0\0\0", Abort.TOO_LONG)):
        with pytest.raises(SdoAbortError) as caught:
            bench._carry(Download(0x1017, 0, data))
        assert caught.value.code == abort


def test_mapping_is_refused_while_the_pdo_exists_and_when_it_cannot_be() -> None:
    bench = Bench()
    cases = (
        (0x1A00, 0, 0, Abort.DEVICE_STATE),
        (0x1600, 1, 0x60400010, Abort.DEVICE_STATE),
        (0x1601, 1, 0x10180120, Abort.NOT_MAPPABLE),
        (0x1601, 1, 0x60410010, Abort.NOT_MAPPABLE),
        (0x1601, 1, 0x607A0010, Abort.NOT_MAPPABLE),
        (0x1601, 0, 9, Abort.PDO_LENGTH),
        (0x1401, 2, 250, Abort.INVALID_VALUE),
    )
    for index, sub, value, abort in cases:
        with pytest.raises(SdoAbortError) as caught:
            bench.put(index, sub, value)
        assert caught.value.code == abort
    for sub, word in enumerate((0x607A0020, 0x60B00020, 0x60400010), start=1):
        bench.put(0x1601, sub, word)
    with pytest.raises(SdoAbortError) as caught:
        bench.put(0x1601, 0, 3)
    assert caught.value.code == Abort.PDO_LENGTH


def test_rpdos_act_at_the_next_sync_and_tpdos_sample_at_it() -> None:
    bench = Bench()
    bench.enable()
    bench.target = counts(0.1)
    bench.give(Frame(0x201, b"\x0f\0" + bench.target.to_bytes(4, "little", signed=True)))
    bench.wait(1)
    assert bench.angle == pytest.approx(0.0, abs=1e-5)
    bench.sent.clear()
    bench.give(Frame(0x80))
    assert [frame.cob_id for _, frame in bench.sent] == [0x181]
    assert bench.sent[0][0] == bench.now_ns + 50_000
    shown = int.from_bytes(bench.sent[0][1].data[2:6], "little", signed=True)
    assert shown == counts(0.0)
    bench.wait(1)
    assert bench.angle == pytest.approx(0.1, abs=1e-5)


def test_two_rpdos_before_a_sync_leave_the_last() -> None:
    bench = Bench()
    bench.enable()
    for angle in (0.3, 0.1):
        data = b"\x0f\0" + counts(angle).to_bytes(4, "little", signed=True)
        bench.give(Frame(0x201, data))
    bench.target = None
    bench.cycle()
    assert bench.angle == pytest.approx(0.1, abs=1e-5)


def test_the_target_is_reached_linearly_over_the_interpolation_time() -> None:
    bench = Bench(interpolate=True)
    bench.put(0x60C2, 1, 4)
    bench.enable()
    bench.target = counts(0.4)
    bench.cycle(rpdo=True)
    bench.give(Frame(0x80))
    path = []
    for _ in range(5):
        bench.wait(1)
        path.append(bench.angle)
    assert path == pytest.approx([0.1, 0.2, 0.3, 0.4, 0.4], abs=1e-5)


def test_a_stale_target_of_zero_makes_the_drive_jump() -> None:
    # What the start-up of a master has to prevent.
    bench = Bench(start_pos=0.5)
    bench.target = 0
    bench.enable()
    assert bench.angle == pytest.approx(-OFFSET / PER_RAD, abs=1e-5)


@pytest.mark.parametrize("kind", list(MissingSetpoint))
def test_missing_set_points_are_held_or_extrapolated_then_a_fault(kind: MissingSetpoint) -> None:
    bench = Bench(interpolate=True, missing_setpoint=kind, missing_limit=3)
    bench.enable()
    for step in range(1, 6):
        bench.target = counts(0.01 * step)
        bench.cycle()
    bench.cycle(rpdo=False)
    bench.cycle(rpdo=False)
    extra = 0.0 if kind is MissingSetpoint.HOLD else 0.01
    assert bench.angle == pytest.approx(0.05 + extra, abs=2e-4)
    bench.cycle(3, rpdo=False)
    assert bench.axis is DriveState.FAULT
    assert bench.emergencies() == [0xFF10]


def test_following_error_is_a_fault_after_its_time() -> None:
    bench = Bench(bandwidth=5.0)
    bench.put(0x6065, 0, round(0.2 * PER_RAD))
    bench.put(0x6066, 0, 5)
    bench.enable()
    bench.target = counts(1.0)
    bench.cycle(6)
    assert bench.axis is OE
    bench.cycle(4)
    assert bench.axis is DriveState.FAULT
    assert bench.emergencies() == [0x8611]
    assert bench.status & StatusBit.FOLLOWING_ERROR
    assert bench.get(0x603F) == 0x8611
    assert bench.get(0x1001) == 0b0010_0001
    assert bench.get(0x1003, 1) == 0x8611


def test_soft_limits_clamp_silently_with_bit_11() -> None:
    bench = Bench()
    bench.put(0x607D, 1, counts(-0.2))
    bench.put(0x607D, 2, counts(0.2))
    bench.enable()
    assert not bench.status & StatusBit.INTERNAL_LIMIT
    bench.target = counts(0.5)
    bench.cycle(3)
    assert bench.angle == pytest.approx(0.2, abs=1e-5)
    assert bench.status & StatusBit.INTERNAL_LIMIT
    assert not bench.status & StatusBit.FOLLOWS_COMMAND
    bench.target = counts(0.1)
    bench.cycle(3)
    assert not bench.status & StatusBit.INTERNAL_LIMIT
    assert bench.status & StatusBit.FOLLOWS_COMMAND


@pytest.mark.parametrize(
    ("option", "final"),
    [(0, SOD), (1, SOD), (2, SOD), (3, SOD), (4, SOD)]
    + [(option, DriveState.QUICK_STOP_ACTIVE) for option in (5, 6, 7, 8)],
)
def test_quick_stop_brakes_on_its_ramp_and_ends_where_605a_says(
    option: int, final: DriveState
) -> None:
    bench = Bench()
    speed, deceleration = 2.0, 100.0
    for index in (0x6084, 0x6085):
        bench.put(index, 0, round(deceleration * PER_RAD))
    bench.put(0x605A, 0, option)
    bench.enable()
    for step in range(1, 21):
        bench.target = counts(speed * 1e-3 * step)
        bench.cycle()
    bench.word = Controlword.QUICK_STOP
    bench.cycle()
    before = bench.angle
    states = []
    for _ in range(60):
        bench.cycle()
        states.append(bench.axis)
    assert states[-1] is final
    way = bench.angle - before
    if option in (1, 2, 5, 6):
        assert way == pytest.approx(speed**2 / (2.0 * deceleration), abs=2.5e-3)
        assert DriveState.QUICK_STOP_ACTIVE in states
    else:
        assert way == pytest.approx(0.0, abs=2.1e-3)
    bench.word = Controlword.ENABLE_OPERATION
    bench.cycle(3)
    assert (bench.axis is OE) == (option >= 5)


@pytest.mark.parametrize(("option", "final"), [(0, 0), (1, 1), (2, 2), (3, 3)])
def test_losing_the_master_acts_as_6007_says(option: int, final: int) -> None:
    bench = Bench()
    bench.put(0x6007, 0, option)
    bench.enable()
    bench.beat = False
    bench.put(0x1029, 1, 1)
    bench.cycle(40)
    assert bench.emergencies() == [0x8130]
    wanted = (OE, DriveState.FAULT, SOD, SOD)[final]
    assert bench.axis is wanted
    assert bench.drive.state is NmtState.OPERATIONAL
    bench.beat = True
    bench.cycle(2)
    # A fault keeps its reason until it is reset.
    assert bench.emergencies() == [0x8130] + [0x0000] * (wanted is not DriveState.FAULT)


@pytest.mark.parametrize(
    ("behaviour", "state"),
    [(0, NmtState.PRE_OPERATIONAL), (1, NmtState.OPERATIONAL), (2, NmtState.STOPPED)],
)
def test_a_communication_error_leads_where_1029_says(behaviour: int, state: NmtState) -> None:
    bench = Bench()
    bench.put(0x1029, 1, behaviour)
    bench.enable()
    bench.beat = False
    bench.cycle(40)
    assert bench.drive.state is state


def test_rpdo_deadline_and_sync_loss() -> None:
    bench = Bench(missing_limit=1000)
    bench.enable()
    bench.cycle(25, rpdo=False)
    assert bench.emergencies() == [0x8250]
    assert bench.axis is SOD
    bench = Bench()
    bench.enable()
    bench.cycle(8, sync=False)
    assert bench.emergencies() == [0xFF11]
    assert bench.axis is DriveState.FAULT


def test_frames_of_wrong_length_are_reported_and_change_nothing() -> None:
    bench = Bench()
    bench.enable()
    bench.give(Frame(0x201, b"\0\0\0\0\0"))
    bench.give(Frame(0x80, b"\1"))
    bench.cycle(1)
    assert bench.emergencies() == [0x8210, 0x8240]
    assert bench.axis is OE


def test_fault_reset_needs_an_edge_and_a_cause_that_has_gone() -> None:
    bench = Bench()
    bench.enable()
    bench.drive.trip(UNDER_VOLTAGE, bench.now_ns)
    bench.word = 0x80
    bench.cycle(5)
    assert bench.axis is DriveState.FAULT
    bench.drive.clear_trip(UNDER_VOLTAGE)
    bench.cycle(5)
    assert bench.axis is DriveState.FAULT
    bench.word = 0x00
    bench.cycle(2)
    bench.word = 0x80
    bench.cycle(2)
    assert bench.axis is SOD
    assert bench.emergencies() == [0x3220, 0x0000]
    bench.word = 0x0F
    bench.cycle(5)
    assert bench.axis is SOD


def test_over_temperature_shows_in_its_object() -> None:
    bench = Bench()
    bench.enable()
    bench.drive.trip(OVER_TEMPERATURE, bench.now_ns)
    assert bench.get(0x2070) == 900
    assert bench.emergencies() == [0x4310]


def test_a_slow_loop_misses_the_first_of_two_controlwords() -> None:
    for slow, expected in ((False, DriveState.READY_TO_SWITCH_ON), (True, SOD)):
        bench = Bench(slow_loop=slow)
        bench.give(nmt_frame(NmtCommand.ENTER_PRE_OPERATIONAL))
        bench.put(0x6040, 0, 0x06)
        bench.put(0x6040, 0, 0x04)
        bench.put(0x6040, 0, 0x06 if not slow else 0x04)
        bench.wait(2)
        assert bench.axis is expected


def test_mode_display_lags_and_halt_blocks_the_mode() -> None:
    bench = Bench(configured=False)
    bench.put(0x6060, 0, 8)
    assert bench.get(0x6061) == 0
    bench.wait(3)
    assert bench.get(0x6061) == 8
    bench.put(0x6040, 0, 0x100)
    with pytest.raises(SdoAbortError, match="present device state"):
        bench.put(0x6060, 0, 6)
    with pytest.raises(SdoAbortError, match="invalid value"):
        bench.put(0x6060, 0, 5)


def home(bench: Bench, method: int, speed: float = 1.0) -> None:
    bench.put(0x6098, 0, method)
    bench.put(0x607C, 0, 5000)
    bench.put(0x6099, 1, round(speed * PER_RAD))
    bench.put(0x6099, 2, round(0.5 * speed * PER_RAD))
    bench.enable()
    bench.put(0x6060, 0, 6)
    bench.cycle(5)
    bench.word = 0x1F
    bench.cycle(4000)


@pytest.mark.parametrize(
    ("method", "where"), [(35, 0.3), (37, 0.3), (-3, -0.5), (-4, 0.7), (-1, 0.0), (-2, 0.0)]
)
def test_homing_finds_its_place(method: int, where: float) -> None:
    bench = Bench(start_pos=0.3, hard_stop=(-0.5, 0.7))
    home(bench, method)
    status = bench.status
    assert status & StatusBit.TARGET_REACHED
    assert status & StatusBit.FOLLOWS_COMMAND
    assert not status & StatusBit.FOLLOWING_ERROR
    index = -OFFSET / PER_RAD
    true = index if method in (-1, -2) else where
    # The motor stands there, and the object says 607Ch.
    assert bench.get(0x6064) == pytest.approx(5000, abs=1)
    assert bench.angle == pytest.approx(true, abs=1e-3)


@pytest.mark.parametrize("method", [15, 16, 31, 32, 36, 38, -5, -128])
def test_a_homing_method_that_it_lacks_is_refused(method: int) -> None:
    bench = Bench(hard_stop=(-0.5, 0.7))
    with pytest.raises(SdoAbortError, match="06090030h"):
        bench.put(0x6098, 0, method)


def test_a_search_for_a_switch_that_is_not_there_fails() -> None:
    bench = Bench(hard_stop=(-0.5, 0.7))
    home(bench, 23)
    assert bench.status & StatusBit.FOLLOWING_ERROR
    assert bench.status & StatusBit.TARGET_REACHED
    assert not bench.status & StatusBit.FOLLOWS_COMMAND


def test_a_search_without_a_speed_fails_instead_of_lasting_for_ever() -> None:
    for method in (-3, 17, 33):
        bench = Bench(start_pos=0.3, hard_stop=(-0.5, 0.7))
        home(bench, method, speed=0)
        assert bench.status & StatusBit.FOLLOWING_ERROR
        assert bench.angle == pytest.approx(0.3, abs=1e-5)


def test_event_driven_pdos_are_sent_on_change_and_by_their_timer() -> None:
    bench = Bench(configured=False)
    bench.put(0x1A00, 1, 0x60410010)
    bench.put(0x1A00, 0, 1)
    bench.put(0x1800, 2, 255)
    bench.put(0x1800, 5, 10)
    bench.put(0x1800, 1, 0x181)
    bench.give(nmt_frame(NmtCommand.START))
    bench.sent.clear()
    bench.wait(25)
    assert [frame.cob_id for _, frame in bench.sent] == [0x181] * 3
    bench.put(0x6040, 0, 0x06)
    bench.wait(1)
    assert decode_state(int.from_bytes(bench.sent[-1][1].data, "little")) is (
        DriveState.READY_TO_SWITCH_ON
    )


def test_positions_wrap_and_the_motor_goes_the_short_way() -> None:
    turn = 2.0 * math.pi
    start = turn * (2**31 - 1000) / (1 << 20)
    bench = Bench(start_pos=start)
    bench.enable()
    shown = bench.get(0x6064)
    for _ in range(30):
        shown += 100
        bench.target = (shown + 2**31) % 2**32 - 2**31
        bench.cycle()
    assert bench.get(0x6064) < 0
    assert bench.angle == pytest.approx(start + 2900 / PER_RAD, abs=2e-5)


def test_a_mirrored_axis_counts_backwards() -> None:
    drive = EmulatedDrive(node(1), Behaviour.ideal(0.5))
    drive.tick(10 * MS)
    drive.sense(0.5, 1.0)
    content = drive._store.read(0x6064, 0)
    value = unpack(DataType.INTEGER32, content)
    assert value == 777 - round(0.5 * PER_RAD)


def test_nmt_stop_and_reset() -> None:
    bench = Bench()
    bench.enable()
    bench.give(nmt_frame(NmtCommand.STOP, 1))
    assert bench.drive.state is NmtState.STOPPED
    bench.wait(3)
    assert bench.axis is SOD
    bench.sent.clear()
    bench.give(Frame(0x601, Upload(0x1000, 0).request))
    assert bench.sent == []
    bench.give(nmt_frame(NmtCommand.RESET_NODE))
    bench.wait(10)
    assert bench.drive.state is NmtState.PRE_OPERATIONAL
    assert bench.get(0x1017) == 0
    assert [frame for _, frame in bench.sent if frame.cob_id == 0x701] == [Frame(0x701, b"\0")]


@pytest.mark.parametrize(
    ("index", "option", "word", "final"),
    [
        (0x605B, 0, 0x06, DriveState.READY_TO_SWITCH_ON),
        (0x605B, 1, 0x06, DriveState.READY_TO_SWITCH_ON),
        (0x605C, 0, 0x07, DriveState.SWITCHED_ON),
        (0x605C, 1, 0x07, DriveState.SWITCHED_ON),
        (0x605D, 1, 0x10F, OE),
        (0x605D, 2, 0x10F, OE),
        (0x605E, 0, None, DriveState.FAULT),
        (0x605E, 1, None, DriveState.FAULT),
        (0x605E, 2, None, DriveState.FAULT),
    ],
)
def test_every_stop_brakes_as_its_option_says(
    index: int, option: int, word: int | None, final: DriveState
) -> None:
    bench, speed, deceleration = Bench(), 2.0, 100.0
    for ramp in (0x6084, 0x6085):
        bench.put(ramp, 0, round(deceleration * PER_RAD))
    bench.put(index, 0, option)
    bench.enable()
    for step in range(1, 21):
        bench.target = counts(speed * 1e-3 * step)
        bench.cycle()
    if word is None:
        bench.drive.trip(UNDER_VOLTAGE, bench.now_ns)
    else:
        bench.word = word
        bench.cycle()
    before = bench.angle
    bench.cycle(60)
    way = speed**2 / (2.0 * deceleration) if option else 0.0
    assert bench.angle - before == pytest.approx(way, abs=2.5e-3)
    assert bench.axis is final


def test_an_rpdo_from_before_leaving_operational_is_forgotten() -> None:
    bench = Bench()
    bench.give(Frame(0x201, b"\x06\0" + bytes(4)))
    bench.give(nmt_frame(NmtCommand.ENTER_PRE_OPERATIONAL))
    bench.give(nmt_frame(NmtCommand.START))
    bench.cycle(2, rpdo=False)
    assert bench.axis is SOD
    bench.give(Frame(0x201, b"\x06\0" + bytes(4)))
    bench.cycle(2, rpdo=False)
    assert bench.axis is DriveState.READY_TO_SWITCH_ON
