"""The master's smaller parts."""

import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import can
import pytest
from drives_rig import LIMITS, START, STIFFNESS, config, node, rig
from file_log import FileLog

from legbench.drives.emulated.behaviour import Behaviour
from legbench.drives.emulated.build import emulate
from legbench.drives.emulated.bus import LockstepBus
from legbench.drives.emulated.faults import NodeFault, NodeFaultKind
from legbench.drives.emulated.network_time import NetworkTime
from legbench.drives.errors import BusError, DriveError
from legbench.drives.master.bus_log import BusLog
from legbench.drives.master.link import Link
from legbench.drives.master.port import Port
from legbench.drives.protocol.datatypes import DataType
from legbench.drives.protocol.pdo import Mapped
from legbench.drives.setup.bus_file import parse_object
from legbench.drives.setup.config import (
    LINK_POSITION,
    POSITION_ACTUAL,
    STATUSWORD,
    BusConfig,
    PdoConfig,
)
from legbench.drives.transport.lock import ChannelLock
from legbench.drives.transport.open_bus import adapter_of, open_bus, timebase_of
from legbench.drives.transport.timebase import SystemTime
from legbench.errors import ConfigError, PlantFault


def wide() -> object:
    """Two TPDOs a drive, the link's encoder in 32 bits, and a temperature."""
    nodes = []
    for place in (0, 1):
        usual = node(place)
        nodes.append(
            replace(
                usual,
                link=replace(usual.link_units, bits=32, counts_per_rev=1 << 24),
                link_object=LINK_POSITION,
                tpdos=(
                    PdoConfig(number=1, objects=(STATUSWORD, POSITION_ACTUAL)),
                    PdoConfig(
                        number=3, objects=(LINK_POSITION, Mapped(0x6077, 0, DataType.INTEGER16))
                    ),
                ),
                temperature_object=parse_object("2070:00 i16"),
            )
        )
    return config(nodes=tuple(nodes), tpdo_deadline_us=720, reply_delay_us=60)


QUICK = [Behaviour(start_pos=pos, reply_delay_us=(50, 60)) for pos in START]
"""Drives that answer soon enough for four frames."""


def test_two_tpdos_a_drive_and_a_temperature(tmp_path: Path) -> None:
    chosen = wide()
    # pyrefly: ignore[bad-argument-type]
    with rig(tmp_path, bus_config=chosen, behaviours=QUICK) as it:
        it.link.start()
        it.run(450)
        it.link.command(START)
        sample = it.link.exchange()
        assert sample.link_pos == pytest.approx(START, abs=6e-6)
        assert sample.temperature == (25.0, 25.0)


def test_too_hot_a_drive_ends_the_run(tmp_path: Path) -> None:
    chosen = wide()
    limits = replace(LIMITS, temperature=60.0)
    # pyrefly: ignore[bad-argument-type]
    with rig(tmp_path, bus_config=chosen, limits=limits, behaviours=QUICK) as it:
        it.link.start()
        # The sensor alone: the drive itself has not tripped yet.
        it.network.drives[0]._values[0x2070, 0] = 701
        with pytest.raises(PlantFault, match=r"drive 1 is at 70\.1 deg C, the limit is 60"):
            it.run(450)


def test_configuration_differences_are_found_and_gone_after_configuring(tmp_path: Path) -> None:
    with rig(tmp_path) as it:
        up, hip = it.link.bring_up, it.config.nodes[0]
        different = {entry.parameter.index for entry in up.differences(hip)}
        assert {0x1006, 0x1017, 0x6060, 0x60C2, 0x1600, 0x1A00} <= different
        assert len(up.configure(hip)) > 30
        assert up.differences(hip) == []


def test_a_drive_that_does_not_keep_a_value_is_named(tmp_path: Path) -> None:
    with rig(tmp_path) as it:
        drive = it.network.drives[1]
        original = drive._store.read

        def forgetful(index: int, sub: int) -> bytes:
            return bytes(2) if index == 0x1017 else original(index, sub)

        drive._sdo._read = forgetful
        words = r"'knee'\), 1017h:00 Producer heartbeat time \[ms\]: wrote 20, reads 0"
        with pytest.raises(DriveError, match=words):
            it.link.open()


def test_the_lock_dies_with_its_process(tmp_path: Path) -> None:
    holder = (
        "import sys, time; from pathlib import Path;"
        "from legbench.drives.transport.lock import ChannelLock;"
        f"ChannelLock('vcan0', Path({str(tmp_path)!r})).acquire();"
        "print('held', flush=True); time.sleep(60)"
    )
    with subprocess.Popen([sys.executable, "-c", holder], stdout=subprocess.PIPE) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == b"held\n"
        lock = ChannelLock("vcan0", tmp_path)
        with pytest.raises(BusError, match=f"already has a master, process {process.pid}"):
            lock.acquire()
        process.kill()
    lock.acquire()
    lock.release()
    lock.release()


def test_a_bus_log_is_read_by_others(tmp_path: Path) -> None:
    path = tmp_path / "bus.log"
    with BusLog(FileLog(path), "can0") as log:
        sent = [
            can.Message(timestamp=0.25, arbitration_id=0x80, is_extended_id=False),
            can.Message(timestamp=0.5, arbitration_id=0x1ABCDEF, data=b"\1\2"),
            can.Message(timestamp=1, arbitration_id=0x181, is_extended_id=False, data=bytes(8)),
            can.Message(
                timestamp=2, arbitration_id=0x701, is_extended_id=False, is_remote_frame=True
            ),
            can.Message(
                timestamp=2, arbitration_id=0x181, is_extended_id=False, is_remote_frame=True, dlc=8
            ),
        ]
        for message in sent:
            log(message)
    assert path.read_text().splitlines()[0] == "(0.250000) can0 080#"
    found = list(can.CanutilsLogReader(path))
    for message, back in zip(sent, found, strict=True):
        assert message.equals(back, timestamp_delta=1e-6, check_channel=False)


@pytest.mark.parametrize("cob_id", [0x88, 0x40, 0x04])
def test_an_error_frame_in_a_bus_log_is_read_back_as_one(tmp_path: Path, cob_id: int) -> None:
    path = tmp_path / "bus.log"
    with BusLog(FileLog(path), "can0") as log:
        # SocketCAN's reports of a bus error, of bus-off and of an overflow.
        log(can.Message(timestamp=1, arbitration_id=cob_id, data=bytes(8), is_error_frame=True))
    (found,) = can.CanutilsLogReader(path)
    assert found.is_error_frame
    assert f"{0x20000080 | cob_id:08X}#0000000000000000" in path.read_text()


def test_interfaces_that_are_not_there_are_named() -> None:
    def opened(bus: BusConfig, **flags: str) -> can.BusABC:
        return open_bus(bus, adapter_of(bus, **flags))

    with pytest.raises(BusError, match="cannot open nonsense can0: "):
        opened(config(), interface="nonsense", channel="can0")
    with pytest.raises(BusError, match="cannot open socketcan nowhere0: "):
        opened(config(interface="socketcan", channel="nowhere0"))
    bus = opened(config(), interface="virtual", channel="here")
    assert isinstance(timebase_of(bus), SystemTime)
    bus.shutdown()


def test_what_flags_and_file_leave_out_comes_from_the_configuration_of_python_can(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setenv("CAN_INTERFACE", "slcan")
    monkeypatch.setenv("CAN_CHANNEL", "/dev/ttyACM7")
    found = adapter_of(config())
    assert (found.interface, found.channel, found.shared) == ("slcan", "/dev/ttyACM7", False)
    found = adapter_of(config(interface="socketcan"))
    assert (found.interface, found.channel, found.shared) == ("socketcan", "/dev/ttyACM7", True)
    assert adapter_of(config(channel="a"), channel="b").channel == "b"


def test_no_interface_at_all_is_named(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.delenv("CAN_INTERFACE", raising=False)
    monkeypatch.setenv("HOME", str(tmp_path))
    monkeypatch.chdir(tmp_path)
    with pytest.raises(BusError, match=r"no interface is given: name one with --interface"):
        adapter_of(config())


def test_a_lock_that_is_taken_twice_is_let_go_with_the_last(tmp_path: Path) -> None:
    lock, other = ChannelLock("bus", tmp_path), ChannelLock("bus", tmp_path)
    lock.acquire()
    lock.acquire()
    lock.release()
    assert lock.held
    with pytest.raises(BusError, match="already has a master"):
        other.acquire()
    lock.release()
    lock.release()
    other.acquire()
    assert not lock.held
    other.release()


def test_a_bus_without_drives_names_the_first_that_is_missing(tmp_path: Path) -> None:
    with can.Bus(interface="virtual", channel="empty") as bus:
        quick = config(sdo_timeout_ms=5, sdo_retries=2)
        link = Link(bus, quick, stiffness=STIFFNESS, lock=ChannelLock("empty", tmp_path))
        words = r"node 1 on .*empty does not answer for 1000h:00 Device type within 5 ms, 2 times"
        with pytest.raises(DriveError, match=words):
            link.open()


def test_time_bases_go_forward() -> None:
    system = SystemTime(spin_ns=10_000)
    at_ns = system.now_ns() + 300_000
    system.wait_until(at_ns)
    assert system.now_ns() >= at_ns
    system.wait_until(at_ns - 1_000_000_000)
    network = emulate(config())
    virtual = NetworkTime(network)
    began = time.monotonic_ns()
    virtual.wait_until(3_000_000_000)
    assert virtual.now_ns() == network.now_ns == 3_000_000_000
    assert began
    virtual.wait_until(0)
    assert virtual.now_ns() == 3_000_000_000


def test_one_behaviour_a_drive() -> None:
    with pytest.raises(ConfigError, match="1 behaviours for 2 drives"):
        emulate(config(), [Behaviour()])


def test_a_body_that_fails_ends_the_run_with_its_cause(tmp_path: Path) -> None:
    def body(motor: tuple[float, ...]) -> tuple[tuple[float, ...], tuple[float, ...]]:
        if network and network[0].now_ns > 400_000_000:
            raise PlantFault("leg straightened through", "the body is broken")
        return motor, (0.0, 0.0)

    network = []
    with rig(tmp_path, body=body) as it:
        network.append(it.network)
        it.link.start()
        with pytest.raises(PlantFault, match="the body is broken") as caught:
            it.run(200)
        assert caught.value.cause == "leg straightened through"
        assert it.link.fault is caught.value


def test_a_drive_that_is_found_enabled_is_stopped_before_it_is_configured(tmp_path: Path) -> None:
    # The master before this one has crashed, and the drives do not watch it.
    with rig(tmp_path) as it:
        it.link.start()
        for drive in it.network.drives:
            drive._values[0x1016, 1] = 0
            drive._values[0x1400, 5] = 0
            drive._heartbeats.clear()
        it.link._parts.channel.release()
        again = LockstepBus("rig", network=it.network)
        link = Link(again, it.config, LIMITS, stiffness=STIFFNESS, lock=ChannelLock("b", tmp_path))
        before = it.angles
        it.network.inject(NodeFault(kind=NodeFaultKind.HEARTBEAT_LOSS, node_id=1, start_ns=1 << 61))
        link.start(clear_faults=True)
        assert it.angles == pytest.approx(before, abs=1e-5)
        link.close()
        again.shutdown()


class Fixed:
    """A time base that stands still at 100 s."""

    def now_ns(self) -> int:
        return 100_000_000_000

    def wait_until(self, at_ns: int) -> None:
        pass


class Stamping(can.BusABC):
    """A driver with one frame, stamped by a clock of its choice."""

    def __init__(self, stamp: float) -> None:
        self.frames = [can.Message(arbitration_id=0x181, is_extended_id=False, timestamp=stamp)]
        super().__init__(channel="stamping")

    def send(self, msg: can.Message, timeout: float | None = None) -> None:
        raise NotImplementedError

    def _recv_internal(self, timeout: float | None) -> tuple[can.Message | None, bool]:
        return self.frames.pop(), True


@pytest.mark.parametrize(
    ("stamp", "shown"),
    [
        pytest.param(97.5, 97.5, id="the time base's own"),
        pytest.param(time.time() + 5000.0, 100.0, id="a clock of the adapter's"),
        pytest.param(0.0, 100.0, id="none"),
    ],
)
def test_received_frames_are_logged_on_the_time_base(stamp: float, shown: float) -> None:
    with Stamping(stamp) as bus:
        heard: list[can.Message] = []
        Port(bus, Fixed(), heard.append).receive(0)
    assert heard[0].timestamp == shown


def test_a_stamp_of_the_system_clock_keeps_its_age() -> None:
    with Stamping(time.time() - 4.0) as bus:
        heard: list[can.Message] = []
        Port(bus, Fixed(), heard.append).receive(0)
    assert 90.0 < heard[0].timestamp < 96.1
