"""Both ends of a bus over AF_UNIX, packet by packet, the server's turns taken by the test."""

import select
import socket
from collections.abc import Iterator
from pathlib import Path
from typing import Any, cast, final

import can
import pytest
from bus_wire import BROKEN, MS, UnixPorts, drain, message

from legbench.drives.emulated.network import Network
from legbench.drives.emulated.station import Heard, Station
from legbench.drives.emulated.unix_server import ChannelsServer
from legbench.drives.emulated.unix_wire import UnixWire
from legbench.drives.errors import BusError
from legbench.drives.protocol.frame import Frame
from legbench.drives.transport.unix_bus import STAMP, UnixBus, _stamp_of
from legbench.drives.transport.unix_packet import Controller, pack_frame

PACKET_BYTES = 14
"""Identifier, length, note, and 8 bytes of data."""


@pytest.fixture
def wire(tmp_path: Path) -> Iterator[UnixWire]:
    with UnixWire(Network(()), tmp_path / "wire.sock") as it:
        yield it


def station_of(wire: UnixWire) -> Station:
    """The only master on a wire."""
    (station,) = wire._stations.values()
    return station


def opened(wire: UnixWire, **how: Any) -> UnixBus:
    """A bus that the wire has let in, and whose opening it has read."""
    bus = UnixBus(str(wire.path), **how)
    for _ in range(2):
        turn(wire)
    return bus


def turn(wire: UnixWire) -> None:
    """Let a wire take what has come."""
    wire.take(select.select(wire.readers, (), (), 0.0)[0])


# --- the server ------------------------------------------------------------------------------


def test_all_that_a_master_has_sent_is_taken_in_one_turn_but_what_is_no_frame(
    wire: UnixWire,
) -> None:
    with opened(wire) as bus:
        for packet in (bytes(PACKET_BYTES - 1), bytes(PACKET_BYTES + 1), bytes(40)):
            bus._socket.send(packet)
            bus.send(message(0x101))
        # An error frame is none that a master may send.
        bus._socket.send(pack_frame(Frame(0x40, bytes(8), error=True)))
        bus.send(message(0x102))
        turn(wire)
        assert station_of(wire).waiting == 4


def test_who_hangs_up_with_frames_unread_has_sent_what_it_had_sent(wire: UnixWire) -> None:
    bus = opened(wire)
    station = station_of(wire)
    station.received.append(Heard(0, Frame(0x181, b"\1")))
    wire.give()
    assert not station.received
    bus.send(message(0x101))
    bus.send(message(0x102))
    bus.shutdown()
    turn(wire)
    assert station.waiting == 2
    assert wire._stations == {}


def test_a_master_that_asks_for_a_bitrate_is_one_station_and_not_two(wire: UnixWire) -> None:
    with opened(wire, bitrate=500_000):
        assert station_of(wire).bitrate == 500_000
        assert wire.network.alone(station_of(wire))


@final
class Deaf:
    """A client of a wire that takes nothing more."""

    def __init__(self, error: OSError) -> None:
        self._error = error

    def send(self, _: bytes) -> None:
        raise self._error


@pytest.mark.parametrize(("waiting", "left"), [(63, 63), (64, 64), (65, 64), (100, 64)])
def test_64_frames_wait_for_who_does_not_read_and_of_more_the_last_are_told_as_lost(
    wire: UnixWire, waiting: int, left: int
) -> None:
    wire.network.advance(5 * MS)
    station = wire.network.attach()
    station.received.extend(Heard(number, Frame(number)) for number in range(waiting))
    wire._give(cast(socket.socket, Deaf(BlockingIOError())), station)
    told = [heard.frame.cob_id for heard in station.received if not heard.frame.error]
    assert len(station.received) == left
    assert told == list(range(left if waiting <= 64 else 63))
    if waiting > 64:
        # SocketCAN: controller, receive buffer overflow.
        at_ns, frame, own = station.received[-1]
        assert (at_ns, frame.cob_id, frame.data, own) == (5 * MS, 0x004, b"\0\1" + bytes(6), False)


def test_nothing_waits_for_who_has_gone(wire: UnixWire) -> None:
    station = wire.network.attach()
    station.received.extend(Heard(number, Frame(number)) for number in range(100))
    wire._give(cast(socket.socket, Deaf(BrokenPipeError())), station)
    assert not station.received


@pytest.mark.parametrize(
    ("errors", "state"),
    [
        # ISO 11898-1: error passive from 128 on, bus-off from 256 on.
        (0, Controller.ACTIVE),
        (127, Controller.ACTIVE),
        (128, Controller.PASSIVE),
        (255, Controller.PASSIVE),
        (256, Controller.BUS_OFF),
    ],
)
def test_every_packet_tells_its_reader_the_state_of_its_controller(
    wire: UnixWire, errors: int, state: Controller
) -> None:
    with opened(wire) as bus:
        station = station_of(wire)
        wire.network.errors[station] = errors
        station.received.append(Heard(0, Frame(0x181)))
        wire.give()
        assert bus._socket.recv(PACKET_BYTES)[5] == state << 1


def test_a_master_that_is_bus_off_is_let_go_when_it_hangs_up_and_not_before(wire: UnixWire) -> None:
    bus = opened(wire)
    bus.send(message(0x101))
    wire.network.errors[station_of(wire)] = 256
    wire.give()
    # What it sent is not taken any more, and waits in the kernel.
    assert len(wire._stations) == 1
    bus.shutdown()
    wire.give()
    assert wire._stations == {}


def test_channels_and_places_are_as_many(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="zip"):
        ChannelsServer([Network(()), Network(())], [tmp_path / "a.sock"])
    assert list(tmp_path.iterdir()) == []


# --- the master ------------------------------------------------------------------------------


def test_a_bus_says_where_it_is(wire: UnixWire) -> None:
    with opened(wire) as bus:
        assert bus.channel_info == f"unix bus {wire.path}"
        assert bus.channel == str(wire.path)


def test_a_stamp_is_seconds_and_nanoseconds_since_1970() -> None:
    for seconds, nanoseconds in ((5, 250_000_000), (1_700_000_000, 999_999_999), (7, 0)):
        packed = STAMP.pack(seconds, nanoseconds)
        assert _stamp_of([(0, 0, packed)]) == pytest.approx(seconds + nanoseconds / 1e9, abs=1e-9)


@pytest.mark.parametrize("note", [1, 2, 3])
def test_own_frames_and_a_passive_controller_are_no_reason_not_to_send(
    wire: UnixWire, note: int
) -> None:
    with opened(wire) as bus:
        (client,) = wire._stations
        packed = bytearray(pack_frame(Frame(0x181)))
        packed[5] = note
        client.send(packed)
        heard = bus.recv(0.0)
        assert heard is not None
        assert heard.is_rx is (note == 2)
        bus.send(message(0x101))
        packed[5] = 4
        client.send(packed)
        assert bus.recv(0.0) is not None
        with pytest.raises(can.CanOperationError, match="bus-off"):
            bus.send(message(0x101))


def test_each_look_at_the_state_is_at_what_has_come_since(tmp_path: Path) -> None:
    ports = UnixPorts(tmp_path)
    with ports.open() as here, ports.open() as there:
        # Read one byte off, this would be a controller that is bus-off.
        there.send(message(0x101, b"\xff" * 8))
        ports.pass_time()
        assert here.state is can.BusState.ACTIVE
        there.send(message(0x102))
        ports.pass_time()
        # Nothing that was looked at is lost to who reads later.
        assert [here.state for _ in range(3)] == [can.BusState.ACTIVE] * 3
        here.send(message(BROKEN))
        for _ in range(20):
            ports.pass_time()
        assert here.state is can.BusState.ERROR
        heard = [
            frame.arbitration_id for frame in drain(ports, here, 1) if not frame.is_error_frame
        ]
        assert heard == [0x101, 0x102]
    ports.close()


def test_a_bus_between_processes_asks_for_linux(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delattr(select, "poll")
    with pytest.raises(BusError, match="a bus between processes needs"):
        UnixBus("nowhere")
