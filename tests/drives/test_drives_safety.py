"""What must not move a motor: old settings of a drive, other masters, bad drivers, missing data."""

import math
import struct
from dataclasses import replace
from pathlib import Path
from typing import Any

import can
import pytest
from drives_rig import LIMITS, MS, START, Rig, config, rig

from legbench.drives.emulated.faults import FrameFault, FrameFaultKind
from legbench.drives.errors import BusError, DriveError
from legbench.drives.master.link import Link, LinkState
from legbench.drives.master.port import Port
from legbench.drives.master.sdo_port import SdoPort
from legbench.drives.protocol.cia402 import (
    Controlword,
    DriveState,
    Goal,
    PowerMachine,
    decode_state,
)
from legbench.drives.protocol.datatypes import DataType
from legbench.drives.protocol.frame import Frame
from legbench.drives.protocol.pdo import Mapped
from legbench.drives.setup.bus_file import bus_from_mapping
from legbench.drives.setup.config import BusConfig, Parameter
from legbench.drives.setup.stopping import check_stopping
from legbench.drives.transport.lock import ChannelLock
from legbench.errors import ConfigError, PlantFault
from legbench.limits.safety import SafetyLimits

SO, OE = DriveState.SWITCH_ON_DISABLED, DriveState.OPERATION_ENABLED
HIP = 0x201
FORGOTTEN = 15_000
"""Position offset that another program left in a drive [counts]."""


def with_nodes(**changes: Any) -> BusConfig:
    """The rig's bus with the same changes to both drives."""
    return config(nodes=tuple(replace(node, **changes) for node in config().nodes))


def parameter(index: int, value: int, sub: int = 0) -> Parameter:
    return Parameter(index=index, sub=sub, kind=DataType.INTEGER32, value=value)


def observe(link: Link, cycles: int) -> None:
    """Look only."""
    for _ in range(cycles):
        link.exchange()


def powered_up(it: Rig) -> bool:
    """Whether any drive was ever led up."""
    return any(word & 0x06 == 0x06 for _, _, word in it.words())


def test_soft_limits_move_with_the_zero_of_the_encoder(tmp_path: Path) -> None:
    bus = with_nodes(soft_limits=(-2.0, 3.0))
    moved = [replace(n.motor, offset_counts=n.motor.offset_counts + 100_000) for n in bus.nodes]
    bus = replace(
        bus, nodes=tuple(replace(n, motor=m) for n, m in zip(bus.nodes, moved, strict=True))
    )
    with rig(tmp_path, bus_config=bus) as it:
        it.link.start()
        for drive, node in zip(it.network.drives, bus.nodes, strict=True):
            ends = sorted(map(node.motor.to_rad, (drive._values[0x607D, i] for i in (1, 2))))
            assert ends == pytest.approx([-2.0, 3.0], abs=1e-5)
        it.run(20)
        assert it.angles == pytest.approx(START, abs=1e-4)


def test_a_motor_outside_the_drives_own_limits_is_not_enabled(tmp_path: Path) -> None:
    bus = with_nodes(soft_limits=(-0.4, 3.0))
    with rig(tmp_path, bus_config=bus) as it:
        words = r"'hip'\) stands at -0\.500 rad .*607Dh of \[-0\.400, 3\.000\] rad"
        with pytest.raises(DriveError, match=words):
            it.link.start()
        assert not powered_up(it)
        assert it.angles == pytest.approx(START)


def test_a_motor_that_is_pulled_away_while_it_is_enabled_is_stopped_at_once(
    tmp_path: Path,
) -> None:
    with rig(tmp_path) as it:
        it.link.open()
        units = it.config.nodes[0].motor
        values = it.network.drives[0]._values
        ends = sorted((units.to_counts(0.1), units.to_counts(0.9)))
        values[0x607D, 1], values[0x607D, 2] = ends
        with pytest.raises(PlantFault, match=r"'hip' .*(moved by|does not follow)"):
            it.link.start()
        up = [at_ns for at_ns, node, word in it.words() if (node, word) == (1, 0x0F)]
        down = [at_ns for at_ns, node, word in it.words() if (node, word) == (1, 0x02)]
        assert down[0] - up[0] < 5 * MS
        assert OE not in it.states


@pytest.mark.parametrize("soft", [(1.0, -1.0), (0.0, math.inf), (0.0, 30_000.0)])
def test_soft_limits_that_no_drive_holds_are_refused(soft: tuple[float, float]) -> None:
    with pytest.raises(ConfigError, match="node 'hip': soft_limits"):
        with_nodes(soft_limits=soft)


def test_a_motor_outside_its_range_is_not_enabled(tmp_path: Path) -> None:
    limits = replace(LIMITS, motor_range=((-0.3, 1.0), (0.0, 3.0)))
    with rig(tmp_path, limits=limits) as it:
        words = r"motor 1 stands at -0\.500 rad, the limits are \[-0\.3, 1\] rad; move it back"
        with pytest.raises(PlantFault, match=words) as caught:
            it.link.start()
        assert caught.value.cause == "motor range"
        assert not powered_up(it)


def test_an_offset_that_was_left_in_a_drive_is_taken_out(tmp_path: Path) -> None:
    with rig(tmp_path) as it:
        it.network.advance(10 * MS)
        for drive in it.network.drives:
            drive._values[0x60B0, 0] = FORGOTTEN
        it.link.start()
        it.run(20)
        assert it.angles == pytest.approx(START, abs=1e-5)
        assert [drive._values[0x60B0, 0] for drive in it.network.drives] == [0, 0]


def test_the_first_command_continues_what_the_drives_hold(tmp_path: Path) -> None:
    with rig(tmp_path) as it:
        sample = it.link.start()
        held = tuple(axis.target_pos for axis in it.link.cycle.axes)
        assert sample.applied_pos == held


def test_a_stop_is_sent_whatever_a_drive_shows() -> None:
    unknown = [word for word in range(256) if decode_state(word) is None]
    for goal, wanted in (
        (Goal.QUICK_STOP, Controlword.QUICK_STOP),
        (Goal.DISABLED, Controlword.DISABLE_VOLTAGE),
    ):
        for word in unknown:
            machine = PowerMachine()
            machine.seek(Goal.ENABLED)
            for known in (0x40, 0x40, 0x21, 0x21, 0x23, 0x23, 0x27, 0x27):
                machine.step(known)
            assert machine.controlword == Controlword.ENABLE_OPERATION
            assert machine.step(word).controlword == Controlword.ENABLE_OPERATION
            machine.seek(goal)
            assert machine.step(word).controlword == wanted


def test_a_drive_whose_state_cannot_be_read_is_stopped_and_cut_off(tmp_path: Path) -> None:
    with rig(tmp_path) as it:
        it.link.start()
        it.run(5)
        axis = it.network.drives[1].axis
        original = axis._status

        def nonsense() -> None:
            original()
            axis._values[0x6041, 0] = axis._values[0x6041, 0] & ~0xFF | 0x77

        axis._status = nonsense
        began = it.network.now_ns
        with pytest.raises(PlantFault, match="unknown state"):
            it.run(5)
        words = [(at_ns, word) for at_ns, node, word in it.words() if node == 2 and at_ns > began]
        stop = next(at_ns for at_ns, word in words if word == Controlword.QUICK_STOP)
        assert stop - began < 4 * MS
        assert all(word != Controlword.ENABLE_OPERATION for at_ns, word in words if at_ns >= stop)
        assert words[-1][1] == Controlword.DISABLE_VOLTAGE
        assert it.states == [SO, SO]


def test_a_driver_that_raises_anything_is_a_bus_error_and_stops_both_drives(
    tmp_path: Path,
) -> None:
    with rig(tmp_path) as it:
        it.link.start()
        it.run(5)
        original = it.bus.recv

        def garbled(timeout: float | None = None) -> can.Message | None:
            if original(timeout) is not None:
                raise ValueError("invalid literal for int() with base 16: '18x'")
            return None

        it.bus.recv = garbled
        with pytest.raises(PlantFault, match="invalid literal"):
            it.run(10)
        assert {node for _, node, word in it.words() if word == Controlword.QUICK_STOP} == {1, 2}
        it.link.close()
        assert it.states == [SO, SO]
        ChannelLock("rig", tmp_path).acquire()


@pytest.mark.parametrize("kind", [KeyboardInterrupt, ZeroDivisionError])
def test_whatever_breaks_a_cycle_the_drives_are_stopped(
    tmp_path: Path, kind: type[BaseException]
) -> None:
    with rig(tmp_path) as it:
        it.link.start()
        it.run(5)

        def broken(now_ns: int) -> None:
            raise kind

        it.link._supervisor.states = broken
        with pytest.raises(kind):
            it.run(1)
        assert it.link.state is LinkState.STOPPED
        assert it.states == [SO, SO]


def test_a_listener_that_fails_hears_nothing_more_and_stops_nothing(tmp_path: Path) -> None:
    with rig(tmp_path) as it:
        it.link.start()
        it.run(5)

        def full(_message: can.Message) -> None:
            raise RuntimeError("no more room")

        it.link.show_frames_to(full)
        it.run(20)
        assert it.link.listener_error == "RuntimeError: no more room"
        assert [watch.lost_total for watch in it.link.cycle.watches] == [0, 0]
        it.link.stop()
        assert it.states == [SO, SO]


@pytest.mark.parametrize("touch", ["replaces", "cuts", "pads"])
def test_a_listener_that_touches_commands_keeps_no_drive_from_its_stop(
    tmp_path: Path, touch: str
) -> None:
    with rig(tmp_path) as it:
        it.link.start()
        it.run(5)

        def touching(message: can.Message) -> None:
            if message.arbitration_id not in (0x201, 0x202):
                return
            if touch == "replaces":
                message.data = bytearray(message.data)
            elif touch == "cuts":
                del message.data[2:]
            else:
                message.data.extend(bytes(2))

        it.link.show_frames_to(touching)
        it.run(20)
        it.link.stop()
        assert it.states == [SO, SO]
        assert it.link.stopped is not None
        assert it.link.stopped.verified


def test_every_node_is_sent_to_pre_operational_and_the_lock_is_released(tmp_path: Path) -> None:
    with rig(tmp_path) as it:
        it.link.start()
        it.run(5)
        original, tried = it.bus.send, []

        def refusing(msg: can.Message, timeout: float | None = None) -> None:
            if msg.arbitration_id == 0x000:
                tried.append(msg.data[1])
                raise can.CanOperationError("No buffer space available")
            original(msg, timeout)

        it.bus.send = refusing
        it.link.close()
        assert tried == [1, 2]
        ChannelLock("rig", tmp_path).acquire()


@pytest.mark.parametrize("speed", [0.0, -0.5, math.inf, math.nan, 500.0])
def test_a_speed_that_is_none_is_refused_before_anything_moves(
    tmp_path: Path, speed: float
) -> None:
    with pytest.raises(ConfigError, match=r"start_speed is .* rad/s; it must be above 0"):
        config(start_speed=speed)
    with rig(tmp_path) as it:
        it.link.start()
        with pytest.raises(ConfigError, match="it must be above 0 and at most 5"):
            it.link.move_to((0.0, 1.0), speed)
        assert it.angles == pytest.approx(START, abs=1e-5)
        it.run(3)


def test_a_move_that_ends_short_of_its_posture_is_a_fault(tmp_path: Path) -> None:
    with rig(tmp_path) as it:
        it.link.start()
        guard = it.link._guard
        it.link.command = lambda motor_pos: guard.applied if motor_pos else ()
        with pytest.raises(PlantFault, match=r"the motors were led to .*, not to"):
            it.link.move_to((0.0, 1.0))
        assert it.states == [SO, SO]


@pytest.mark.parametrize(
    "frame",
    [
        Frame(HIP, struct.pack("<Hi", 0x00, 1000)),
        Frame(0x080),
        Frame(0x000, b"\x80\x01"),
        Frame(0x77E, b"\x05"),
    ],
)
@pytest.mark.parametrize("enabled", [False, True])
def test_a_second_master_on_the_wire_is_a_fault(
    tmp_path: Path, frame: Frame, enabled: bool
) -> None:
    with rig(tmp_path) as it:
        other = it.network.attach(64)
        if enabled:
            it.link.start()
            it.run(5)
            it.network.send(other, frame)
            with pytest.raises(PlantFault, match="the master of these drives") as caught:
                it.run(2)
        else:
            it.link.open()
            it.network.send(other, frame)
            with pytest.raises(PlantFault, match="the master of these drives") as caught:
                it.link.start()
            assert not powered_up(it)
        assert caught.value.cause == "second master"
        assert OE not in it.states


def test_a_drive_that_is_found_enabled_is_stopped_before_anything_is_written(
    tmp_path: Path,
) -> None:
    with rig(tmp_path) as it:
        time = it.bus.timebase
        time.wait_until(20 * MS)
        for node_id in (1, 2):
            sdo = SdoPort(Port(it.bus, time), node_id)
            sdo.put(0x6007, 0, DataType.INTEGER16, 0)
            sdo.put(0x6060, 0, DataType.INTEGER8, 8)
            for word in (0x06, 0x07, 0x0F):
                time.wait_until(time.now_ns() + 5 * MS)
                sdo.put(0x6040, 0, DataType.UNSIGNED16, word)
        time.wait_until(time.now_ns() + 5 * MS)
        assert it.states == [OE, OE]
        began = it.network.now_ns
        it.link.open()
        assert it.states == [SO, SO]
        written = [
            struct.unpack("<H", frame.data[1:3])[0]
            for at_ns, frame in it.network.log or []
            if at_ns > began and frame.cob_id in (0x601, 0x602) and frame.data[0] & 0xE0 == 0x20
        ]
        assert written[:2] == [0x6040, 0x6040]
        it.link.start()
        assert it.angles == pytest.approx(START, abs=1e-4)


def test_no_target_is_sent_before_a_drive_has_said_where_its_motor_is(tmp_path: Path) -> None:
    with rig(tmp_path) as it:
        it.link.open()
        now_ns = it.network.now_ns
        it.network.inject(
            FrameFault(kind=FrameFaultKind.DROP, cob_id=0x181, end_ns=now_ns + 10 * MS)
        )
        it.link.start()
        sent = [struct.unpack("<Hi", f.data) for _, f in it.network.log or [] if f.cob_id == HIP]
        assert {target for _, target in sent} == {it.config.nodes[0].motor.to_counts(START[0])}


def test_a_frame_that_is_refused_keeps_no_other_drive_from_its_own(tmp_path: Path) -> None:
    with rig(tmp_path) as it:
        it.link.start()
        it.run(5)
        original, told = it.bus.send, []

        def refusing(msg: can.Message, timeout: float | None = None) -> None:
            if msg.arbitration_id == HIP and len(told) < 3:
                raise can.CanOperationError("No buffer space available")
            if msg.arbitration_id == HIP + 1:
                told.append(int.from_bytes(msg.data[:2], "little"))
            original(msg, timeout)

        it.bus.send = refusing
        it.link.stop()
        assert told[0] == Controlword.QUICK_STOP
        assert it.states == [SO, SO]


def test_commands_that_cannot_be_sent_end_the_run(tmp_path: Path) -> None:
    with rig(tmp_path) as it:
        it.link.start()
        it.run(5)
        original = it.bus.send

        def refusing(msg: can.Message, timeout: float | None = None) -> None:
            if msg.arbitration_id == HIP:
                raise can.CanOperationError("No buffer space available")
            original(msg, timeout)

        it.bus.send = refusing
        with pytest.raises(PlantFault, match="could not be sent for 3 cycles") as caught:
            it.run(5)
        assert caught.value.cause == "command not sent"


def test_a_doubled_answer_makes_no_later_one_old(tmp_path: Path) -> None:
    seen = []
    for doubled in (False, True):
        with rig(tmp_path) as it:
            it.link.start()
            now_ns = it.network.now_ns // MS * MS
            if doubled:
                it.network.inject(
                    FrameFault(
                        kind=FrameFaultKind.DUPLICATE,
                        cob_id=0x182,
                        delay_ns=10_000,
                        start_ns=now_ns + 10 * MS,
                        end_ns=now_ns + 11 * MS,
                    )
                )
            counts = []
            for cycle in range(60):
                it.link.command((START[0], START[1] - 0.0005 * cycle))
                it.link.exchange()
                counts.append(it.link.cycle.axes[1].motor_counts)
            seen.append(counts)
    assert seen[0] == seen[1]


@pytest.mark.parametrize(
    ("index", "value", "words"),
    [
        (0x6007, 0, "6007h:00 .* is written by itself"),
        (0x1016, 0, "1016h.* is written by itself"),
        (0x605A, 0, "605Ah:00 .* is written by itself"),
        (0x605B, 0, "605Bh:00 .* is 0, which lets the leg drop"),
        (0x605C, 0, "605Ch:00 .* is 0, which lets the leg drop"),
        (0x605E, 0, "605Eh:00 .* is 0, which lets the leg drop"),
        (0x1400, 0, "1400h.* is written by itself"),
        (0x607D, -75_000, "607Dh.* give soft_limits = .* in rad"),
        (0x60B0, 5, "60B0h:00 .* is written by itself"),
        (0x6065, 0xFFFFFFFF, "6065h:00 .* switches the following error off"),
    ],
)
def test_a_parameter_that_takes_a_protection_away_is_refused(
    index: int, value: int, words: str
) -> None:
    with pytest.raises(ConfigError, match=f"node 'hip': parameter {words}"):
        with_nodes(parameters=(parameter(index, value),))


def test_every_stop_of_a_drive_is_on_a_ramp_by_default(tmp_path: Path) -> None:
    with rig(tmp_path) as it:
        it.link.open()
        for drive in it.network.drives:
            assert [drive._values[index, 0] for index in range(0x605B, 0x605F)] == [1, 1, 2, 2]


def test_commands_of_ones_own_mapping_are_watched_by_the_drive_too() -> None:
    objects = ["6040:00 u16", "607A:00 i32"]
    bus = bus_from_mapping(
        {
            "node": [
                {
                    "name": "hip",
                    "id": 1,
                    "vendor": 1,
                    "product": 2,
                    "motor": {"counts_per_rev": 4096},
                    "link": {"counts_per_rev": 4096, "bits": 16},
                    "soft_limits": [-1, 1.5],
                    "rpdo": [{"number": 1, "objects": objects}],
                }
            ]
        }
    )
    assert bus.nodes[0].rpdos[0].deadline_ms == 20
    assert bus.nodes[0].soft_limits == (-1.0, 1.5)


def hot(bus: BusConfig) -> BusConfig:
    sensor = Mapped(0x2070, 0, DataType.INTEGER16)
    return replace(bus, nodes=tuple(replace(n, temperature_object=sensor) for n in bus.nodes))


def test_a_temperature_that_is_no_longer_reported_ends_the_run(tmp_path: Path) -> None:
    limits = replace(LIMITS, temperature=70.0)
    with rig(tmp_path, bus_config=hot(config()), limits=limits) as it:
        it.link.start()
        it.run(5)
        it.network.inject(
            FrameFault(kind=FrameFaultKind.DROP, cob_id=0x581, start_ns=it.network.now_ns)
        )
        words = r"'hip' \(node 1\) has not reported its temperature for 3 requests"
        with pytest.raises(PlantFault, match=words):
            it.run(1000)


def test_too_hot_a_drive_is_not_enabled(tmp_path: Path) -> None:
    limits = replace(LIMITS, temperature=70.0)
    with rig(tmp_path, bus_config=hot(config()), limits=limits) as it:
        it.network.drives[0]._values[0x2070, 0] = 801
        with pytest.raises(PlantFault, match=r"drive 1 is at 80\.1 deg C, the limit is 70"):
            it.link.start()
        assert not powered_up(it)


@pytest.mark.parametrize("ramp", [(), (parameter(0x6085, 0),)])
def test_a_drive_without_a_quick_stop_ramp_is_refused(ramp: tuple[Parameter, ...]) -> None:
    with pytest.raises(ConfigError, match="drive 'hip' has no quick-stop ramp"):
        check_stopping(with_nodes(parameters=ramp), SafetyLimits(command_speed=1.0))


def test_a_second_name_of_a_device_does_not_get_past_its_lock(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    device = tmp_path / "ttyACM0"
    device.touch()
    alias = tmp_path / "by-id"
    alias.symlink_to(device)
    first = ChannelLock.of_channel("slcan", str(device), tmp_path)
    first.acquire()
    with pytest.raises(BusError, match=r"slcan .*ttyACM0 already has a master, process"):
        ChannelLock.of_channel("slcan", str(alias), tmp_path).acquire()
    monkeypatch.chdir(tmp_path)
    with pytest.raises(BusError, match="already has a master"):
        ChannelLock.of_channel("slcan", "by-id", tmp_path).acquire()
    # python-can takes the speed of the line behind the name.
    for channel in (f"{device}@115200", "by-id@9600"):
        with pytest.raises(BusError, match="already has a master"):
            ChannelLock.of_channel("slcan", channel, tmp_path).acquire()
    # A file that happens to bear the name of an interface is not that interface.
    (tmp_path / "can0").touch()
    assert ChannelLock.of_channel("socketcan", "can0").address == b"\0legbench socketcan can0"
    ChannelLock.of_channel("socketcan", "can0", tmp_path).acquire()
    first.release()


def test_an_address_is_no_path_and_the_same_from_everywhere(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    where = "socket://10.0.0.7:3333"
    first = ChannelLock.of_channel("slcan", where, tmp_path)
    monkeypatch.chdir(tmp_path)
    assert ChannelLock.of_channel("slcan", where, tmp_path).address == first.address
