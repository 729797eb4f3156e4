"""The AF_UNIX bus and the servers of emulated drives, in one process, with the test's clock."""

import errno
import os
from collections.abc import Iterator
from pathlib import Path
from typing import final

import can
import pytest
from can_rig import BUS, MS

from legbench.drives.emulated.build import emulate
from legbench.drives.emulated.bus_server import BusServer
from legbench.drives.emulated.pacer import FORGIVEN_NS
from legbench.drives.emulated.unix_server import UnixServer
from legbench.drives.errors import BusError
from legbench.drives.master.session import Session
from legbench.drives.protocol.frame import Frame
from legbench.drives.setup.bus_file import load_bus
from legbench.drives.setup.stopping import check_stopping
from legbench.drives.transport.unix_bus import UnixBus
from legbench.drives.transport.unix_packet import pack_frame, unpack_frame
from legbench.errors import ConfigError
from legbench.limits.safety import SafetyLimits


@final
class Time:
    """A clock that every look moves on by 0.1 ms."""

    def __init__(self) -> None:
        self.now_ns = 0

    def __call__(self) -> int:
        self.now_ns += MS // 10
        return self.now_ns


@pytest.fixture
def server(tmp_path: Path) -> Iterator[UnixServer]:
    with UnixServer(emulate(load_bus(BUS)), tmp_path / "leg.sock", Time()) as it:
        yield it


def answered(server: UnixServer, bus: can.BusABC, cob_id: int) -> can.Message:
    for _ in range(1000):
        server.poll()
        message = bus.recv(0.0)
        if message is not None and message.arbitration_id == cob_id:
            return message
    pytest.fail(f"no {cob_id:03X}h")


@pytest.mark.parametrize(
    "frame",
    [
        Frame(0x000),
        Frame(0x7FF, bytes(range(8))),
        Frame(0x1FFFFFFF, b"\x01", extended=True),
        Frame(0x123, remote=True),
        Frame(0x123, remote=True, dlc=8),
        Frame(1 << 20, remote=True, extended=True, dlc=1),
        Frame(0x40, bytes(8), error=True),
    ],
)
def test_a_frame_survives_its_packet(frame: Frame) -> None:
    assert unpack_frame(pack_frame(frame)) == frame


@pytest.mark.parametrize(
    "packet",
    [
        b"",
        bytes(13),
        bytes(15),
        b"\0\0\0\0\xff" + bytes(9),
        b"\0\x08\0\0\0" + bytes(9),
    ],
)
def test_other_packets_are_no_frames(packet: bytes) -> None:
    assert unpack_frame(packet) is None


def test_two_listeners_hear_the_same_drive(server: UnixServer) -> None:
    path = str(server.path)
    with UnixBus(path) as first, UnixBus(path) as second:
        assert answered(server, first, 0x701).data == b"\0"
        request = can.Message(
            arbitration_id=0x601, data=bytes.fromhex("4000100000000000"), is_extended_id=False
        )
        first.send(request)
        assert answered(server, second, 0x581).data[4:6] == b"\x92\x01"


def test_a_file_that_nobody_serves_is_replaced_and_one_in_use_is_not(tmp_path: Path) -> None:
    path = tmp_path / "leg.sock"
    network = emulate(load_bus(BUS))
    dead = UnixServer(network, path)
    dead._wire._listener.close()
    assert path.exists()
    with (
        UnixServer(network, path),
        pytest.raises(BusError, match="Address already in use"),
    ):
        UnixServer(network, path)
    assert not path.exists()


def test_a_bus_that_went_down_is_named_before_anything_is_enabled(server: UnixServer) -> None:
    with Session(UnixBus(str(server.path)), load_bus(BUS)) as session:
        server.poll()
        server.close()
        with pytest.raises(BusError, match=r"cannot (send|receive).*ip -details link show"):
            session.bring_up().identify()


def test_time_that_the_server_was_away_is_forgiven(server: UnixServer) -> None:
    clock = Time()
    clock.now_ns = 10_000 * MS
    server._pacer._now_ns = clock
    before = server.network.now_ns
    server.poll()
    assert server.network.now_ns - before <= FORGIVEN_NS


def test_drives_on_any_bus_of_python_can() -> None:
    here = can.Bus(interface="virtual", channel="leg")
    there = can.Bus(interface="virtual", channel="leg")
    with here, BusServer([emulate(load_bus(BUS))], there, Time()) as server:
        for _ in range(200):
            server.poll()
        heard = {message.arbitration_id for message in iter(lambda: here.recv(0.0), None)}
    assert heard == {0x701, 0x702}


class Failing(can.BusABC):
    """An interface whose errors are as asked for."""

    def __init__(self, *, send: int | None = None, receive: int | None = None) -> None:
        self.codes = {"send": send, "receive": receive}
        super().__init__(channel="failing")

    def _fail(self, name: str) -> None:
        code = self.codes[name]
        if code is not None:
            raise can.CanOperationError(os.strerror(code), error_code=code)

    def send(self, msg: can.Message, timeout: float | None = None) -> None:
        self._fail("send")

    def _recv_internal(self, timeout: float | None) -> tuple[can.Message | None, bool]:
        self._fail("receive")
        return None, True


@pytest.mark.parametrize(
    ("send", "receive"), [(errno.ENOBUFS, None), (errno.ENETDOWN, errno.ENETDOWN)]
)
def test_drives_lose_frames_and_outlive_an_interface_that_goes_down(
    send: int, receive: int | None
) -> None:
    network, bus = emulate(load_bus(BUS)), Failing(send=send, receive=receive)
    with BusServer([network], bus, Time()) as server:
        for _ in range(200):
            server.poll()
        assert network.now_ns > 10 * MS


def test_drives_end_with_an_interface_that_is_gone() -> None:
    with (
        BusServer([emulate(load_bus(BUS))], Failing(receive=errno.ENODEV), Time()) as server,
        pytest.raises(BusError, match="No such device"),
    ):
        server.poll()


def test_a_ramp_that_is_too_long_is_refused() -> None:
    config = load_bus(BUS)
    check_stopping(config, SafetyLimits())
    check_stopping(config, SafetyLimits(command_speed=40.0))
    with pytest.raises(ConfigError, match=r"needs 1 rad to stop from 200 rad/s.*0\.2 rad"):
        check_stopping(config, SafetyLimits(command_speed=200.0))
