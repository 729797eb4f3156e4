import hashlib
import itertools
import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import can
import pytest
from drives_rig import LIMITS, MS, START, STIFFNESS, config, node, rig
from file_log import FileLog

from legbench.drives.emulated.behaviour import Behaviour
from legbench.drives.emulated.build import emulate
from legbench.drives.emulated.bus import LockstepBus
from legbench.drives.emulated.faults import FrameFault, FrameFaultKind, NodeFault, NodeFaultKind
from legbench.drives.errors import BusError, DriveError
from legbench.drives.master.bus_log import BusLog
from legbench.drives.master.link import Link, LinkState
from legbench.drives.protocol.cia402 import Controlword, DriveState, decode_state
from legbench.drives.setup.config import Identity
from legbench.drives.transport.lock import ChannelLock
from legbench.errors import ConfigError, PlantFault
from legbench.limits.safety import SafetyLimits

SO, OE = DriveState.SWITCH_ON_DISABLED, DriveState.OPERATION_ENABLED
RESOLUTION = 2.0 * math.pi / (1 << 20)


def replaced(place: int, **identity: int) -> object:
    wanted = {"vendor": 0x1234, "product": 7, "serial": 100 + place} | identity
    changed = [node(0), node(1)]
    changed[place] = (
        config()
        .nodes[place]
        .__class__(
            name=changed[place].name,
            node_id=changed[place].node_id,
            identity=Identity(**wanted),
            motor=changed[place].motor,
            link=changed[place].link,
        )
    )
    return config(nodes=tuple(changed))


def test_start_enables_both_drives_without_a_jump(tmp_path: Path) -> None:
    with rig(tmp_path) as it:
        moved = []
        original = it.network._tick

        def watched() -> None:
            original()
            moved.append(it.angles)

        it.network._tick = watched
        sample = it.link.start()
        assert it.states == [OE, OE]
        assert it.link.state is LinkState.RUNNING
        assert len(moved) > 100
        for angles in moved:
            assert angles == pytest.approx(START, abs=2 * RESOLUTION)
        assert sample.motor_pos == pytest.approx(START, abs=RESOLUTION)
        assert sample.applied_pos == sample.motor_pos
        assert all(decode_state(word) is OE for word in sample.statusword)


def test_every_target_sent_before_enabling_is_the_actual_position(tmp_path: Path) -> None:
    with rig(tmp_path) as it:
        it.link.start()
        targets = {
            (frame.cob_id, frame.data[2:])
            for _, frame in it.network.log or []
            if 0x200 < frame.cob_id <= 0x27F
        }
        assert len(targets) == 2


def test_ladder_goes_up_rung_by_rung_and_every_word_stands_two_cycles(tmp_path: Path) -> None:
    with rig(tmp_path) as it:
        it.link.start()
        for node_id in (1, 2):
            words = [word for _, sender, word in it.words() if sender == node_id]
            changes = [words[0]]
            for word in words:
                if word != changes[-1]:
                    changes.append(word)
            assert changes == [0x00, 0x06, 0x07, 0x0F]
            assert all(words.count(word) >= 2 for word in changes)


def test_command_is_shown_two_syncs_later(tmp_path: Path) -> None:
    behaviours = [Behaviour.ideal(pos) for pos in START]
    with rig(tmp_path, behaviours=behaviours, limits=SafetyLimits()) as it:
        it.link.start()
        shown = []
        for cycle in range(8):
            it.link.command([START[0] + 0.1 * (cycle >= 3), START[1]])
            shown.append(it.link.exchange().motor_pos[0])
        # Commanded after sample k it is shown by sample k + 2; `shown[j]` is sample j + 1.
        for cycle, value in enumerate(shown):
            wanted = START[0] + 0.1 * (cycle >= 4)
            assert value == pytest.approx(wanted, abs=RESOLUTION)


def test_spring_torque_is_the_encoders_difference(tmp_path: Path) -> None:
    def body(motor: tuple[float, ...]) -> tuple[list[float], list[float]]:
        return [motor[0] - 0.2, motor[1] + 0.1], [0.8, -0.5]

    with rig(tmp_path, body=body) as it:
        sample = it.link.start()
        assert sample.spring_torque == pytest.approx((0.8, -0.5), abs=1e-3)
        assert sample.link_pos == pytest.approx((START[0] - 0.2, START[1] + 0.1), abs=1e-4)


def test_an_encoder_that_jumps_is_found_before_a_command_is_made_of_it(tmp_path: Path) -> None:
    with rig(tmp_path, limits=replace(LIMITS, joint_speed=60.0)) as it:
        it.link.start()
        it.run(3)
        jumps_ns = it.network.now_ns
        it.network.inject(
            NodeFault(kind=NodeFaultKind.LINK_STEP, node_id=1, start_ns=jumps_ns, size=0.1)
        )
        with pytest.raises(PlantFault, match="joint 1 moved by 0") as caught:
            it.run(5)
        assert caught.value.cause == "joint speed"
        words = [word for at_ns, _, word in it.words() if at_ns >= jumps_ns]
        stopped = next(place for place, word in enumerate(words) if word != 0x0F)
        # The command before the jump, to two drives; then quick stop.
        assert stopped == 2


def test_a_fast_command_is_slewed_and_a_far_one_clamped(tmp_path: Path) -> None:
    with rig(tmp_path) as it:
        it.link.start()
        previous = it.link._guard.applied
        for _ in range(200):
            applied = it.link.command((5.0, 1.9))
            assert abs(applied[0] - previous[0]) <= 20.0 * 1e-3 + 1e-12
            previous = applied
            it.link.exchange()
        assert previous == (1.0, 1.9)


def test_stop_tells_both_drives_in_the_same_cycle(tmp_path: Path) -> None:
    with rig(tmp_path) as it:
        it.link.start()
        it.run(20)
        it.link.stop()
        first = {}
        for at_ns, sender, word in it.words():
            if word == Controlword.QUICK_STOP:
                first.setdefault(sender, at_ns)
        assert set(first) == {1, 2}
        assert abs(first[1] - first[2]) < MS
        assert it.states == [SO, SO]
        assert all(drive.axis.motion.speed == 0.0 for drive in it.network.drives)


def test_close_leaves_the_drives_without_power_and_may_be_called_twice(tmp_path: Path) -> None:
    with rig(tmp_path) as it:
        it.link.start()
        it.run(5)
        it.link.close()
        it.link.close()
        assert it.states == [SO, SO]
        with pytest.raises(DriveError, match="the link is stopped; start it first"):
            it.link.exchange()


def test_the_same_run_gives_the_same_bytes(tmp_path: Path) -> None:
    digests = []
    for attempt in range(2):
        log = tmp_path / f"{attempt}.log"
        network = emulate(config(), [Behaviour(start_pos=pos, seed=9) for pos in START])
        bus = LockstepBus("rig", network=network)
        with BusLog(FileLog(log), "can0") as lines:
            lock = ChannelLock("same", tmp_path)
            link = Link(bus, config(), LIMITS, stiffness=STIFFNESS, listener=lines, lock=lock)
            with link:
                link.start()
                for cycle in range(1500):
                    link.command([START[0] + 0.3 * math.sin(0.01 * cycle), START[1]])
                    link.exchange()
        bus.shutdown()
        digests.append(hashlib.sha256(log.read_bytes()).hexdigest())
        assert list(can.CanutilsLogReader(log))[-1].arbitration_id == 0x582
    assert digests[0] == digests[1]


def test_a_second_master_is_refused(tmp_path: Path) -> None:
    with rig(tmp_path) as it:
        it.link.start()
        other = LockstepBus("rig", network=it.network)
        second = Link(other, it.config, stiffness=STIFFNESS, lock=ChannelLock("rig", tmp_path))
        with pytest.raises(BusError, match=r"rig already has a master, process \d+"):
            second.start()
        other.shutdown()
        it.run(5)


def test_a_leg_beyond_its_limits_is_not_enabled(tmp_path: Path) -> None:
    limits = SafetyLimits(joint_range=((-0.4, 1.0), (0.0, 3.0)))
    with rig(tmp_path, limits=limits) as it:
        with pytest.raises(PlantFault, match=r"joint 1 is at -0\.500 rad, the limits are"):
            it.link.start()
        assert all(word in (0x00, 0x02) for _, _, word in it.words())


def test_a_drive_that_ignores_quick_stop_loses_its_voltage(tmp_path: Path) -> None:
    with rig(tmp_path) as it:
        it.link.start()
        it.run(10)
        stubborn = it.network.drives[0].axis.power
        stubborn._from_enabled = lambda **_: None
        began = it.network.now_ns
        it.link.stop()
        assert it.states == [SO, SO]
        words = [(at_ns, word) for at_ns, sender, word in it.words() if sender == 1]
        after = [(at_ns - began, word) for at_ns, word in words if at_ns > began]
        assert after[0][1] == Controlword.QUICK_STOP
        first_off = next(at_ns for at_ns, word in after if word == Controlword.DISABLE_VOLTAGE)
        assert first_off == pytest.approx(40 * MS, abs=2 * MS)
        assert it.link.stopped is not None
        assert it.link.stopped.verified
        assert it.link.stopped.cut_off == ("hip",)


def test_a_missing_node_is_named(tmp_path: Path) -> None:
    with rig(tmp_path) as it:
        it.network.inject(NodeFault(kind=NodeFaultKind.SILENT, node_id=2, start_ns=0))
        with pytest.raises(DriveError, match=r"node 2 on emulated bus rig does not answer"):
            it.link.start()
        assert it.words() == []
        # The channel is free again.
        ChannelLock("rig", tmp_path).acquire()


@pytest.mark.parametrize(
    ("name", "value", "words"),
    [
        ("vendor", 0x99, "has vendor 0x1234, expected is 0x99"),
        ("product", 8, "has product 0x7, expected is 0x8"),
        ("serial", 5, "has serial 0x64, expected is 0x5; correct the bus file"),
        ("serial", 101, "that one is node 2: 'hip' and 'knee' are swapped"),
    ],
)
def test_another_drive_is_named_before_anything_is_enabled(
    tmp_path: Path, name: str, value: int, words: str
) -> None:
    network = emulate(config())
    bus = LockstepBus("rig", network=network)
    wanted = replaced(0, **{name: value})
    # pyrefly: ignore[bad-argument-type]
    link = Link(bus, wanted, stiffness=STIFFNESS, lock=ChannelLock("rig", tmp_path))
    with pytest.raises(DriveError, match=words):
        link.start()
    assert all(drive.axis.power.state is SO for drive in network.drives)
    bus.shutdown()


def test_too_much_for_the_wire_is_refused(tmp_path: Path) -> None:
    bus = LockstepBus("rig", network=emulate(config()))
    with pytest.raises(ConfigError, match=r"takes 11\d % of 500000 bit/s"):
        Link(bus, config(bitrate=500_000), stiffness=STIFFNESS)
    bus.shutdown()


def test_missed_ticks_are_skipped_counted_and_never_made_up(tmp_path: Path) -> None:
    with rig(tmp_path) as it:
        it.link.start()
        it.run(10)
        before = it.link.cycle._due_ns
        it.network.advance(it.network.now_ns + 2 * MS + 300_000)
        it.link.command(START)
        sample = it.link.exchange()
        assert sample.skipped == 2
        assert it.link.cycle._due_ns == before + 3 * MS
        assert (it.link.cycle._due_ns - before) % MS == 0
        it.run(10)
        assert it.link.skipped_total == 2
        syncs = [at_ns for at_ns, frame in it.network.log or [] if frame.cob_id == 0x080]
        assert min(b - a for a, b in itertools.pairwise(syncs)) > 0.6 * MS


def test_too_many_missed_ticks_stop_the_leg(tmp_path: Path) -> None:
    with rig(tmp_path) as it:
        it.link.start()
        it.run(10)
        it.network.advance(it.network.now_ns + 4 * MS)
        it.link.command(START)
        with pytest.raises(PlantFault, match=r"\d ticks of 1000 us missed in a row") as caught:
            it.link.exchange()
        assert caught.value.cause == "cycle overruns"
        assert it.states == [SO, SO]


@pytest.mark.parametrize("call", [Link.command, Link.move_to])
def test_the_first_cause_is_kept(
    tmp_path: Path, call: Callable[[Link, tuple[float, float]], object]
) -> None:
    with rig(tmp_path) as it:
        with pytest.raises(DriveError, match="the link is new; start it first"):
            it.link.command(START)
        it.link.start()
        with pytest.raises(PlantFault, match="command of motor 1 is nan"):
            call(it.link, (math.nan, 1.9))
        first = it.link.fault
        assert first is not None
        assert first.cause == "command not finite"
        assert it.states == [SO, SO]
        for again in (it.link.exchange, it.link.look, lambda: it.link.command(START)):
            with pytest.raises(PlantFault) as caught:
                again()
            assert caught.value is first
        assert it.link.fault is first


def test_a_drive_in_fault_is_refused_and_reset_only_when_asked(tmp_path: Path) -> None:
    for clear in (False, True):
        with rig(tmp_path) as it:
            it.network.advance(10 * MS)
            it.network.drives[1].trip(0x3220, it.network.now_ns)
            it.network.drives[1].clear_trip(0x3220)
            if clear:
                it.link.start(clear_faults=True)
                assert it.states == [OE, OE]
            else:
                words = r"drive 'knee' \(node 2\) is in fault: 3220h under-voltage"
                with pytest.raises(DriveError, match=words):
                    it.link.start()
                assert it.states == [SO, DriveState.FAULT]


def test_a_fault_whose_cause_stands_cannot_be_reset(tmp_path: Path) -> None:
    with rig(tmp_path) as it:
        it.network.advance(10 * MS)
        it.network.drives[0].trip(0x4310, it.network.now_ns)
        with pytest.raises(DriveError, match="does not leave its fault, whose cause still stands"):
            it.link.start(clear_faults=True)


def test_move_to_goes_there_at_its_speed(tmp_path: Path) -> None:
    with rig(tmp_path) as it:
        it.link.start()
        began = it.network.now_ns
        sample = it.link.move_to((-0.4, 1.7), speed=1.0)
        took = 1e-9 * (it.network.now_ns - began)
        assert took == pytest.approx(0.2, abs=0.01)
        assert sample.motor_pos == pytest.approx((-0.4, 1.7), abs=2 * RESOLUTION)


def test_the_plugin_is_found_by_its_name(tmp_path: Path) -> None:
    with pytest.raises(can.CanInitializationError, match=r"nowhere\.toml: no such file"):
        can.Bus(interface="legbench", channel=str(tmp_path / "nowhere.toml"))
    bus = can.Bus(interface="legbench", channel="any", network=emulate(config()))
    assert isinstance(bus, LockstepBus)
    booted = [bus.recv(0.1) for _ in range(2)]
    assert [message.arbitration_id for message in booted if message] == [0x701, 0x702]
    bus.shutdown()


def test_filters_and_a_full_queue(tmp_path: Path) -> None:
    bus = LockstepBus(
        "rig",
        [{"can_id": 0x702, "can_mask": 0x7FF}],
        network=emulate(config()),
        tx_queue=2,
    )
    message = bus.recv(0.1)
    assert message is not None
    assert message.arbitration_id == 0x702
    assert bus.recv(0.1) is None
    for _ in range(2):
        bus.send(can.Message(arbitration_id=0x80, is_extended_id=False))
    with pytest.raises(can.CanOperationError, match="transmit queue is full"):
        bus.send(can.Message(arbitration_id=0x80, is_extended_id=False))
    bus.shutdown()


def test_a_full_queue_is_a_lost_cycle_not_a_crash(tmp_path: Path) -> None:
    with rig(tmp_path, tx_queue=10) as it:
        it.link.start()
        it.run(5)
        for _ in range(10):
            it.bus.send(can.Message(arbitration_id=0x7DF, is_extended_id=False, data=bytes(8)))
        it.link.command(START)
        assert isinstance(it.link.cycle.bus_error, BusError)
        it.run(20)
        assert it.states == [OE, OE]


def test_dropped_frames_below_the_limit_are_bridged(tmp_path: Path) -> None:
    with rig(tmp_path) as it:
        it.link.start()
        now_ns = it.network.now_ns // MS * MS
        for cob_id, cycle in ((0x181, 10), (0x182, 30), (0x201, 50), (0x080, 70)):
            it.network.inject(
                FrameFault(
                    kind=FrameFaultKind.DROP,
                    cob_id=cob_id,
                    start_ns=now_ns + cycle * MS,
                    end_ns=now_ns + (cycle + 1) * MS,
                )
            )
        it.run(120)
        # One cycle each, and the silent one after it.
        assert [watch.lost_total for watch in it.link.cycle.watches] == [4, 4]
        assert it.link.cycle.silent_total == it.link.skipped_total == 3
        assert it.states == [OE, OE]
