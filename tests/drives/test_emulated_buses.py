"""Emulated buses as python-can sees them: the time of a wait, channels, a bus that is served."""

import errno
import math
from collections import deque
from dataclasses import replace
from types import SimpleNamespace
from typing import Any, cast

import can
import pytest
from drives_rig import MS, config, node

from legbench.drives.emulated import build
from legbench.drives.emulated import bus as bus_module
from legbench.drives.emulated.behaviour import Behaviour
from legbench.drives.emulated.build import emulate, emulate_channels, on_bench
from legbench.drives.emulated.bus import LockstepBus
from legbench.drives.emulated.bus_server import BusServer
from legbench.drives.emulated.channels_bus import ChannelsBus
from legbench.drives.emulated.pacer import Pacer
from legbench.drives.errors import BusError
from legbench.drives.protocol.frame import Frame
from legbench.errors import ConfigError


def message(cob_id: int, data: bytes = b"") -> can.Message:
    return can.Message(arbitration_id=cob_id, data=data, is_extended_id=False)


# --- one bus ---------------------------------------------------------------------------------


def test_waiting_takes_the_time_that_is_asked_for_to_the_nanosecond() -> None:
    network = emulate(config(), [Behaviour(boot_us=10**9)] * 2)
    bus = LockstepBus("leg", network=network)
    assert bus.channel_info == "emulated bus leg"
    for timeout, passes in ((0.25, 250 * MS), (1e-9, 1), (0.0, 0), (-1.0, 0)):
        began_ns = network.now_ns
        assert bus.recv(timeout) is None
        assert network.now_ns - began_ns == passes
    bus.shutdown()
    with pytest.raises(can.CanOperationError, match="is shut down"):
        bus.recv(0.0)


def test_a_wait_without_end_passes_a_while_at_a_time_and_lets_others_run(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    network = emulate(config(), [Behaviour(boot_us=10**9)] * 2)
    bus = LockstepBus("leg", network=network)
    paused: list[tuple[float, int]] = []

    def pause(seconds: float) -> None:
        paused.append((seconds, network.now_ns))
        if len(paused) == 3:
            bus.inject(Frame(0x123))

    monkeypatch.setattr(bus_module, "time", SimpleNamespace(sleep=pause))
    assert bus_module.IDLE_NS == 1000 * MS
    monkeypatch.setattr(bus_module, "IDLE_NS", 2 * MS)
    found = bus.recv(None)
    assert found is not None
    assert found.arbitration_id == 0x123
    assert paused == [(1e-3, 2 * MS * count) for count in (1, 2, 3)]
    bus.shutdown()


def test_a_sender_waits_for_room_as_long_as_it_says() -> None:
    network = emulate(config(), [Behaviour(boot_us=10**9)] * 2)
    bus = LockstepBus("leg", network=network, tx_queue=1)
    bus.send(message(0x7F0))
    with pytest.raises(can.CanOperationError):
        bus.send(message(0x7F1))
    assert network.now_ns == 0
    # One frame of 55 bits: there is room after two looks of 50 us.
    bus.send(message(0x7F1), timeout=0.01)
    assert network.now_ns == 100_000
    with pytest.raises(can.CanOperationError):
        bus.send(message(0x7F2), timeout=20e-6)
    assert network.now_ns == 120_000
    bus.shutdown()


def test_a_controller_is_passive_from_128_errors_on_and_off_the_bus_at_256() -> None:
    network = emulate(config())
    bus = LockstepBus("leg", network=network)
    for level, state in (
        (127, can.BusState.ACTIVE),
        (128, can.BusState.PASSIVE),
        (255, can.BusState.PASSIVE),
    ):
        cast(Any, network).level = lambda station, level=level: level
        assert bus.state is state
    bus.shutdown()


def test_what_is_sent_periodically_ends_with_the_bus(monkeypatch: pytest.MonkeyPatch) -> None:
    ended: list[str] = []
    monkeypatch.setattr(can.BusABC, "shutdown", lambda bus: ended.append(bus.channel_info))
    bus = LockstepBus("leg", network=emulate(config()))
    bus.shutdown()
    bus.shutdown()
    channels = ChannelsBus(emulate_channels(two()), two())
    channels.shutdown()
    assert ended[:3] == ["emulated bus leg"] * 2 + ["emulated buses a + b"]
    assert ended[3:] == ["emulated bus a", "emulated bus b"]
    # Python-can's own destructor must find nothing to complain of.
    monkeypatch.undo()
    for one in (bus, channels):
        can.BusABC.shutdown(one)


def test_channels_that_are_shut_down_do_nothing_any_more() -> None:
    bus = ChannelsBus(emulate_channels(two()), two())
    bus.shutdown()
    for call in (
        lambda: bus.send(message(0x123)),
        lambda: bus.recv(0.0),
        lambda: bus.send_periodic(message(0x123), 0.01),
    ):
        with pytest.raises(can.CanOperationError, match="shut down"):
            call()


# --- several channels ------------------------------------------------------------------------


def two() -> Any:
    nodes = [replace(each, channel=name) for each, name in zip(config().nodes, "ab", strict=True)]
    return config(nodes=tuple(nodes))


def test_frames_of_all_channels_come_in_the_order_of_their_times() -> None:
    bus = ChannelsBus(emulate_channels(two()), two())
    parts = bus._parts
    for part, at_ns, cob_id in ((0, 50, 0x10), (1, 20, 0x20), (1, 70, 0x21), (0, 60, 0x11)):
        parts[part].station.received.append(cast(Any, (at_ns, Frame(cob_id), False)))
    found = [bus.recv(0.0) for _ in range(4)]
    assert [one.arbitration_id for one in found if one] == [0x20, 0x10, 0x11, 0x21]
    began_ns = bus.timebase.now_ns()
    quiet = bus.recv(0.002)
    assert quiet is None
    assert bus.timebase.now_ns() - began_ns == 2 * MS
    bus.shutdown()


def test_a_channel_that_refuses_keeps_no_frame_from_the_other() -> None:
    bus = ChannelsBus(emulate_channels(two()), two())
    sent: list[int] = []

    def part(place: int, *, refuses: bool) -> Any:
        def send(_message: can.Message) -> None:
            sent.append(place)
            if refuses:
                raise can.CanOperationError(f"full {place}")

        return SimpleNamespace(send=send, shutdown=lambda: None)

    kept = bus._parts
    for refusing in ((0,), (1,), (0, 1)):
        sent.clear()
        bus._parts = [part(place, refuses=place in refusing) for place in (0, 1)]
        with pytest.raises(can.CanOperationError, match=f"full {refusing[0]}"):
            bus.send(message(0x080))
        assert sent == [0, 1]
    bus._parts = kept
    bus.shutdown()


# --- how it is built -------------------------------------------------------------------------


def test_a_drive_on_a_bench_has_its_stops_behind_its_soft_limits() -> None:
    assert (0.1, math.pi) == (build.STOP_BEHIND, build.FREE_RANGE)
    plain, limited = node(0), replace(node(0), soft_limits=(-1.0, 0.5))
    for drive, start, stops in (
        (plain, 0.25, (-math.pi, math.pi)),
        (limited, 0.25, (-1.1, 0.6)),
        (limited, -1.3, (-1.3, 0.6)),
        (limited, 0.9, (-1.1, 0.9)),
    ):
        found = on_bench(drive, start, seed=5)
        assert found.hard_stop == pytest.approx(stops)
        assert (found.start_pos, found.seed) == (start, 5)
        assert found.home_switch == (-0.05, 0.05)


def test_networks_are_built_without_a_log_or_a_configuration_unless_asked_for() -> None:
    for made in ((emulate(config()),), emulate_channels(two())):
        for network in made:
            assert network.log is None
            assert network.drives[0]._values[0x1017, 0] == 0
    asked: dict[str, Any] = {"keep_log": True, "configured": True}
    for made in ((emulate(config(), **asked),), emulate_channels(two(), **asked)):
        for network in made:
            assert network.log is not None
            assert network.drives[0]._values[0x1017, 0] == config().heartbeat_ms
    for count in (1, 3):
        with pytest.raises(ConfigError, match=f"{count} behaviours for 2 drives"):
            emulate(config(), [Behaviour()] * count)


# --- a bus that is served --------------------------------------------------------------------


class Served:
    """A network, a bus and a clock that are set by hand."""

    channel_info = "vcan0"

    def __init__(self) -> None:
        self.log: list[Any] = []
        self.clock_ns = 1000
        self.incoming: list[can.Message | Exception | None] = []
        self.refuses: Exception | None = None
        self.station = SimpleNamespace(received=deque[Any]())
        self.network: Any = SimpleNamespace(
            attach=lambda: self.station,
            send=self._network_send,
            now_ns=0,
            upcoming=lambda: (400, None),
            advance=self._wait_until,
        )
        self.server = BusServer([cast(Any, self.network)], cast(Any, self), lambda: self.clock_ns)

    def _network_send(self, station: Any, frame: Frame) -> None:
        assert station is self.station
        self.log.append(("in", frame.cob_id))
        if frame.cob_id == 0x666:
            raise BusError("full")

    def _wait_until(self, at_ns: int) -> None:
        self.log.append(("until", at_ns))
        self.network.now_ns = at_ns

    def recv(self, timeout: float) -> can.Message | None:
        self.log.append(("recv", round(1e9 * timeout)))
        came = self.incoming.pop(0) if self.incoming else None
        if isinstance(came, Exception):
            raise came
        self.clock_ns += 100
        return came

    def send(self, given: can.Message) -> None:
        self.log.append(("out", given.arbitration_id, round(1e9 * given.timestamp)))
        if self.refuses is not None:
            raise self.refuses

    def shutdown(self) -> None:
        self.log.append("shutdown")


def test_a_server_waits_for_the_next_event_then_passes_all_that_has_come() -> None:
    it = Served()
    fd = can.Message(arbitration_id=5, is_fd=True)
    it.incoming = [message(0x201), message(0x666), fd, message(0x202), None]
    it.station.received.extend(
        [
            (300, Frame(0x181), False),
            (310, Frame(0x88, error=True), False),
            (320, Frame(0x182), False),
        ]
    )
    it.server.poll()
    assert it.log == [
        *[("recv", 400), ("until", 100), ("in", 0x201), ("recv", 0), ("in", 0x666)],
        *[("recv", 0), ("recv", 0), ("in", 0x202), ("recv", 0), ("until", 500)],
        *[("out", 0x181, 300), ("out", 0x182, 320)],
    ]
    assert not it.station.received
    it.server.close()
    assert it.log[-1] == "shutdown"


def test_an_interface_that_is_down_or_full_loses_frames_and_any_other_error_ends_it() -> None:
    it = Served()
    it.incoming = [can.CanOperationError("down", errno.ENETDOWN)]
    it.refuses = can.CanOperationError("full")
    it.station.received.append((5, Frame(0x181), False))
    it.server.poll()
    assert it.log[-1] == ("out", 0x181, 5)
    for error in (can.CanOperationError("broken", errno.EIO), OSError("gone")):
        it.incoming = [error]
        with pytest.raises(BusError, match="vcan0: "):
            it.server.poll()


def test_virtual_time_follows_a_clock_and_leaves_out_what_is_beyond_3_ms() -> None:
    now = {"virtual": 40, "clock": 5000}
    virtual: Any = SimpleNamespace(
        now_ns=lambda: now["virtual"],
        next_ns=lambda: 10 * MS + 40,
        wait_until=lambda at_ns: now.update(virtual=at_ns),
    )
    pacer = Pacer(virtual, lambda: now["clock"])
    assert pacer.wait_s() == pytest.approx(0.01)
    for passes, virtually in ((2 * MS, 2 * MS), (3 * MS, 5 * MS), (20 * MS, 8 * MS), (MS, 9 * MS)):
        now["clock"] += passes
        pacer.advance()
        assert now["virtual"] == virtually + 40
    assert pacer.wait_s() == pytest.approx(0.001)
    now["clock"] += 2 * MS
    assert pacer.wait_s() == 0.0
