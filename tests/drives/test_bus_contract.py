"""What python-can promises of every bus, tried on the emulated bus and on the one over a socket."""

import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any, cast

import can
import pytest
from bus_wire import (
    BROKEN,
    MS,
    LockstepPorts,
    Ports,
    UnixPorts,
    accepted,
    clock,
    drain,
    message,
    until,
)


@pytest.fixture(params=[LockstepPorts, UnixPorts], ids=["legbench", "legbench_unix"])
def ports(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[Ports]:
    made = request.param(tmp_path)
    yield made
    made.close()


@pytest.fixture
def socket_ports(tmp_path: Path) -> Iterator[UnixPorts]:
    made = UnixPorts(tmp_path)
    yield made
    made.close()


def numbered(count: int, cob_id: int = 0x123) -> Iterator[can.Message]:
    for number in range(count):
        yield message(cob_id, number.to_bytes(4, "little"))


def contents(messages: list[can.Message]) -> list[tuple[int, bytes]]:
    return [(frame.arbitration_id, bytes(frame.data)) for frame in messages]


# --- frames arrive, or their sender is told --------------------------------------------------


@pytest.mark.parametrize("count", [200, 1000])
def test_a_frame_of_a_burst_arrives_or_its_sender_gets_an_error(ports: Ports, count: int) -> None:
    with ports.open() as here, ports.open() as there:
        taken = accepted(here, numbered(count))
        # A queue has an end, and it is the sender who learns of it.
        assert len(taken) < count or count == 200
        assert contents(drain(ports, there, 200)) == contents(taken)


def test_four_senders_of_a_thousand_frames_each_lose_none_in_silence(ports: Ports) -> None:
    senders = [ports.open() for _ in range(4)]
    with ports.open() as listener:
        taken: list[list[can.Message]] = [[] for _ in senders]
        heard: list[can.Message] = []
        for start in range(0, 1000, 50):
            # Each sends as fast as it can, and the wire keeps up with none of them.
            for place, bus in enumerate(senders):
                burst = (
                    message(0x100 + place, number.to_bytes(4, "little"))
                    for number in range(start, start + 50)
                )
                taken[place] += accepted(bus, burst)
            heard += drain(ports, listener, 1)
        heard += drain(ports, listener, 500)
        for place in range(4):
            mine = [frame for frame in heard if frame.arbitration_id == 0x100 + place]
            assert contents(mine) == contents(taken[place])
            assert 0 < len(mine) < 1000
        assert len(heard) == sum(map(len, taken))
    for bus in senders:
        bus.shutdown()


def test_a_sender_may_wait_for_room_in_its_queue(ports: Ports) -> None:
    with ports.open() as here, ports.open() as there:
        taken = accepted(here, numbered(1000))
        with pytest.raises(can.CanOperationError, match=r"full"):
            here.send(message(), timeout=0.0)
        if isinstance(ports, UnixPorts):
            # The server is this very thread: nothing becomes free while it waits.
            with pytest.raises(can.CanOperationError, match=r"full"):
                here.send(message(), timeout=1e-3)
            until(ports, lambda: False, 200)
        here.send(message(0x124), timeout=0.1)
        heard = contents(drain(ports, there, 300))
    assert heard == [*contents(taken), (0x124, b"\1\2")]


def test_what_was_sent_before_the_end_is_on_the_wire_after_it(ports: Ports) -> None:
    with ports.open() as there:
        here = ports.open()
        for frame in numbered(5):
            here.send(frame)
        here.shutdown()
        assert contents(drain(ports, there)) == contents(list(numbered(5)))


def test_a_reader_who_is_too_slow_is_told_what_it_missed(socket_ports: UnixPorts) -> None:
    count = 1000
    with socket_ports.open() as here, socket_ports.open() as there:
        taken: list[can.Message] = []
        for frame in numbered(count):
            while not (went := accepted(here, iter([frame]))):
                socket_ports.pass_time()
            taken += went
        heard = drain(socket_ports, there, 200)
    lost = [frame for frame in heard if frame.is_error_frame]
    # SocketCAN's report of a controller whose receive buffer has overflowed.
    assert {(frame.arbitration_id, bytes(frame.data)) for frame in lost} == {
        (0x04, b"\0\1" + bytes(6))
    }
    first = heard.index(lost[0])
    assert contents(heard[:first]) == contents(taken[:first])
    assert 100 <= first < count


# --- the end of a bus ------------------------------------------------------------------------


def test_a_bus_that_is_shut_down_does_nothing_any_more(ports: Ports) -> None:
    with ports.open() as there:
        here = ports.open()
        there.send(message())
        ports.pass_time()
        here.shutdown()
        here.shutdown()
        for call in (
            lambda: here.send(message()),
            lambda: here.recv(0.0),
            lambda: here.send_periodic(message(), 0.01),
        ):
            with pytest.raises(can.CanOperationError, match="shut down"):
                call()
        assert drain(ports, there) == []


class Goodbye:
    """A periodic task of which nothing but its end is needed."""

    def __init__(self, bus: can.BusABC) -> None:
        self._bus = bus

    def stop(self, remove_task: bool = True) -> None:
        self._bus.send(message(0x321))


def test_what_is_sent_periodically_ends_before_the_bus(ports: Ports) -> None:
    bus = ports.open()
    with ports.open() as there:
        bus._periodic_tasks.append(cast(Any, Goodbye(bus)))
        bus.shutdown()
        assert [frame.arbitration_id for frame in drain(ports, there)] == [0x321]


# --- frames that are none --------------------------------------------------------------------


@pytest.mark.parametrize(
    ("changes", "told"),
    [
        ({"arbitration_id": 0, "is_error_frame": True}, "error frame"),
        ({"arbitration_id": 0, "is_fd": True}, "FD"),
        ({"arbitration_id": 0x800}, "800h.*11 bits"),
        ({"arbitration_id": -1}, "11 bits"),
        ({"arbitration_id": 1 << 29, "is_extended_id": True}, "20000000h.*29 bits"),
        ({"arbitration_id": 1 << 31, "is_extended_id": True}, "29 bits"),
        ({"data": bytes(9)}, "9 bytes.*8"),
        ({"dlc": 5}, "2 bytes.*5"),
        ({"data": None, "dlc": 9, "is_remote_frame": True}, "9.*8"),
    ],
)
def test_what_is_no_classic_frame_is_not_sent(
    ports: Ports, changes: dict[str, Any], told: str
) -> None:
    with ports.open() as here, ports.open() as there:
        with pytest.raises(can.CanOperationError, match=told):
            here.send(message(**changes))
        assert drain(ports, there) == []


@pytest.mark.parametrize("extended", [False, True])
@pytest.mark.parametrize("length", [0, 3, 8])
def test_a_remote_frame_keeps_its_length(ports: Ports, length: int, extended: bool) -> None:
    with ports.open() as here, ports.open() as there:
        here.send(message(0x123, None, is_remote_frame=True, dlc=length, is_extended_id=extended))
        (heard,) = drain(ports, there)
    assert heard.is_remote_frame
    assert heard.is_extended_id is extended
    assert (heard.arbitration_id, heard.dlc, bytes(heard.data)) == (0x123, length, b"")


# --- times -----------------------------------------------------------------------------------


def test_a_frame_is_stamped_when_it_comes_not_when_it_is_read(ports: Ports) -> None:
    with ports.open() as here, ports.open() as there:
        here.send(message())
        ports.pass_time()
        if isinstance(ports, LockstepPorts):
            # 63 bits and at worst 12 of stuffing, at 1 Mbit/s.
            expected = pytest.approx(75e-6, abs=1e-9)
            until(ports, lambda: False, 5)
            heard = there.recv(0.0)
            assert heard is not None
            assert heard.timestamp == expected
            return
        arrived = clock()
        heard = there.recv(0.0)
        assert heard is not None
        # Seconds since 1970, as python-can stamps frames, and not later than they came.
        assert arrived - 10.0 < heard.timestamp <= arrived


def test_who_waits_without_end_waits_until_a_frame_comes(tmp_path: Path) -> None:
    ports = LockstepPorts(tmp_path)
    with ports.open() as here, ports.open() as there:

        def send_late() -> None:
            # Virtual time runs on while somebody waits.
            while ports.network.now_ns < 2000 * MS:
                time.sleep(1e-3)
            here.send(message(0x321))

        sender = threading.Thread(target=send_late)
        sender.start()
        heard = there.recv()
        sender.join()
        assert heard is not None
        assert heard.arbitration_id == 0x321


def test_threads_may_share_a_wire(tmp_path: Path) -> None:
    ports = LockstepPorts(tmp_path)
    with ports.open(tx_queue=4000) as here, ports.open() as there:
        taken: list[can.Message] = []

        def burst() -> None:
            taken.extend(accepted(here, numbered(1000)))

        senders = [threading.Thread(target=burst) for _ in range(4)]
        for sender in senders:
            sender.start()
        heard: list[can.Message] = []
        while any(sender.is_alive() for sender in senders):
            heard += iter(lambda: there.recv(1e-3), None)
        heard += drain(ports, there, 1000)
        for sender in senders:
            sender.join()
    assert len(taken) == 4000
    assert sorted(contents(heard)) == sorted(contents(taken))


# --- bus-off ---------------------------------------------------------------------------------


def test_a_controller_that_goes_bus_off_says_so_and_takes_nothing(ports: Ports) -> None:
    with ports.open() as here, ports.open() as there:
        assert here.state is can.BusState.ACTIVE
        here.send(message(BROKEN))
        assert until(ports, lambda: here.state is can.BusState.ERROR)
        assert there.state is can.BusState.ACTIVE
        with pytest.raises(can.CanOperationError, match="bus-off"):
            here.send(message())
        drain(ports, there)
        # Restarted, it sends again, and nothing of before.
        here.state = can.BusState.ACTIVE
        assert here.state is can.BusState.ACTIVE
        ports.pass_time()
        here.send(message(0x321))
        assert [frame.arbitration_id for frame in drain(ports, there)] == [0x321]


def test_a_controller_with_many_errors_is_passive(ports: Ports) -> None:
    with ports.open() as here:
        here.send(message(BROKEN))
        seen = []
        for _ in range(60):
            seen.append(here.state)
            ports.pass_a_little_time()
    order = [can.BusState.ACTIVE, can.BusState.PASSIVE, can.BusState.ERROR]
    assert [state for place, state in enumerate(seen) if state not in seen[:place]] == order


def test_bus_off_reaches_a_sender_who_never_reads(socket_ports: UnixPorts) -> None:
    with socket_ports.open() as here, socket_ports.open() as there:
        here.send(message(BROKEN))
        until(socket_ports, lambda: False, 20)
        assert len(accepted(here, numbered(1000))) < 1000
        assert [frame for frame in drain(socket_ports, there) if not frame.is_error_frame] == []


def test_a_sender_that_is_bus_off_and_gone_leaves_nothing_behind(socket_ports: UnixPorts) -> None:
    here = socket_ports.open()
    here.send(message(BROKEN))
    until(socket_ports, lambda: False, 20)
    accepted(here, numbered(10))
    assert len(socket_ports.server._wire._stations) == 1
    here.shutdown()
    assert until(socket_ports, lambda: not socket_ports.server._wire._stations)


def test_other_states_than_active_cannot_be_asked_for(ports: Ports) -> None:
    with (
        ports.open() as here,
        pytest.raises(NotImplementedError, match="PASSIVE"),
    ):
        here.state = can.BusState.PASSIVE


# --- what a bus is opened with ---------------------------------------------------------------


def test_own_frames_are_received_by_who_asks_for_them(ports: Ports) -> None:
    with ports.open(receive_own_messages=True) as here, ports.open() as there:
        here.send(message(0x101))
        there.send(message(0x102))
        assert [(m.arbitration_id, m.is_rx) for m in drain(ports, here)] == [
            (0x101, False),
            (0x102, True),
        ]
        assert [(m.arbitration_id, m.is_rx) for m in drain(ports, there)] == [(0x101, True)]


def test_a_bus_at_its_own_bitrate_receives_its_own_frames(ports: Ports) -> None:
    with ports.open(receive_own_messages=True, bitrate=1_000_000) as here:
        here.send(message(0x101))
        assert [m.arbitration_id for m in drain(ports, here)] == [0x101]


@pytest.mark.parametrize("given", [{"bitrat": 5}, {"listen_only": True}])
def test_settings_that_nobody_knows_are_refused(ports: Ports, given: dict[str, object]) -> None:
    with pytest.raises(TypeError, match=next(iter(given))):
        ports.open(**given)


def test_flexible_data_rate_is_refused(ports: Ports) -> None:
    with pytest.raises(can.CanInitializationError, match="classic CAN"):
        ports.open(fd=True)
    # python-can's own programs give these to every interface.
    with ports.open(fd=False, single_handle=True) as bus:
        assert bus.protocol is can.CanProtocol.CAN_20


def test_filters_let_through_what_they_name(ports: Ports) -> None:
    only = [{"can_id": 0x181, "can_mask": 0x7FF, "extended": False}]
    with ports.open() as here, ports.open(can_filters=only) as there:
        for cob_id, extended in ((0x180, False), (0x181, False), (0x181, True)):
            here.send(message(cob_id, is_extended_id=extended))
        heard = [(m.arbitration_id, m.is_extended_id) for m in drain(ports, there)]
        assert heard == [(0x181, False)]
        there.set_filters(None)
        here.send(message(0x180))
        assert [m.arbitration_id for m in drain(ports, there)] == [0x180]
