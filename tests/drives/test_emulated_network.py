"""The wire of the emulated bus: order, times, error counters, and each fault in its window."""

from collections.abc import Sequence
from typing import Any

import pytest
from drives_rig import MS, config

from legbench.drives.emulated.behaviour import Behaviour
from legbench.drives.emulated.build import emulate
from legbench.drives.emulated.faults import (
    Babble,
    Fault,
    FrameFault,
    FrameFaultKind,
    NodeFault,
    NodeFaultKind,
)
from legbench.drives.emulated.injector import Injector
from legbench.drives.emulated.network import Network
from legbench.drives.emulated.station import Station
from legbench.drives.emulated.stuffing import Stuffing
from legbench.drives.errors import BusError
from legbench.drives.protocol.frame import Frame
from legbench.drives.setup.wire import exact_bits, plain_bits, worst_bits
from legbench.errors import ConfigError

US = 1000
KIND = FrameFaultKind


def wire(*faults: Fault, stuffing: Stuffing = Stuffing.NONE, **changes: Any) -> Network:
    """A bus without drives: two masters talk."""
    return Network(
        (),
        faults=faults,
        stuffing=stuffing,
        keep_log=True,
        **changes,
    )


def heard(station: Station) -> list[tuple[int, int]]:
    """Time [us] and identifier of what was received."""
    return [(at_ns // US, frame.cob_id) for at_ns, frame, _ in station.received]


# --- order and times -------------------------------------------------------------------------


def test_of_frames_that_wait_the_lowest_identifier_goes_first() -> None:
    network = wire()
    ports = [network.attach() for _ in range(5)]
    for port, cob_id in zip(ports, (0x300, 0x181, 0x180, 0x7FF, 0x200), strict=True):
        network.send(port, Frame(cob_id, bytes(8 if cob_id != 0x200 else 0)))
    network.advance(MS)
    # 111 us of eight bytes and 47 of none; nobody hears itself.
    assert heard(ports[4]) == [(111, 0x180), (222, 0x181), (380, 0x300), (491, 0x7FF)]
    assert (269, 0x200) in heard(ports[0])
    assert not any(port.waiting for port in ports)


def test_frames_of_one_master_leave_in_their_order_also_after_one_was_destroyed() -> None:
    network = wire(FrameFault(kind=KIND.BAD_BITS, cob_id=0x300, end_ns=200 * US))
    here, there = network.attach(), network.attach()
    for cob_id in (0x300, 0x181, 0x180):
        network.send(here, Frame(cob_id))
    network.send(there, Frame(0x200))
    network.advance(2 * MS)
    sent = [frame.cob_id for _, frame in network.log or []]
    # The other master's frame wins against 300h, and not against what waits behind it.
    assert sent == [0x200, 0x300, 0x181, 0x180]


def test_frames_of_one_identifier_keep_their_order() -> None:
    network = wire()
    here, there = network.attach(), network.attach()
    for byte in range(20):
        network.send(here, Frame(0x181, bytes((byte,))))
    network.advance(10 * MS)
    assert [frame.data[0] for _, frame, _ in there.received] == list(range(20))


@pytest.mark.parametrize("bitrate", [125_000, 500_000, 1_000_000])
@pytest.mark.parametrize("stuffing", list(Stuffing))
def test_a_frame_takes_its_bits(bitrate: int, stuffing: Stuffing) -> None:
    for frame in (Frame(0x7FF), Frame(0, bytes(8)), Frame(1 << 28, bytes(3), extended=True)):
        network = wire(stuffing=stuffing, bitrate=bitrate)
        here, there = network.attach(), network.attach()
        network.advance(3 * MS)
        network.send(here, frame)
        network.advance(20 * MS)
        bits = {
            Stuffing.NONE: plain_bits(len(frame.data), extended=frame.extended),
            Stuffing.WORST: worst_bits(len(frame.data), extended=frame.extended),
            Stuffing.EXACT: exact_bits(frame),
        }[stuffing]
        end_ns = 3 * MS + bits * 1_000_000_000 // bitrate
        assert list(there.received) == [(end_ns, frame, False)]
        assert network.log == [(end_ns, frame)]


def test_time_passes_to_the_next_frame_for_a_station_or_to_the_end() -> None:
    network = wire()
    here, there = network.attach(), network.attach()
    network.send(here, Frame(0x100))
    network.advance(5 * MS, there)
    assert network.now_ns == 47 * US
    # What it has not read holds time; others let it pass.
    network.advance(5 * MS, there)
    assert network.now_ns == 47 * US
    there.received.clear()
    network.advance(5 * MS, there)
    assert network.now_ns == 5 * MS
    network.advance(4 * MS)
    assert network.now_ns == 5 * MS


def test_a_full_queue_and_a_station_off_the_bus_take_nothing() -> None:
    network = wire()
    here, there = network.attach(tx_queue=2), network.attach()
    for _ in range(2):
        network.send(here, Frame(0x100))
    with pytest.raises(BusError, match=r"transmit queue is full \(2 frames\)"):
        network.send(here, Frame(0x100))
    network.advance(MS)
    network.send(here, Frame(0x100))
    network.advance(2 * MS)
    assert len(there.received) == 3
    # What it has handed over is still sent when it has gone.
    network.send(here, Frame(0x100))
    network.detach(here)
    network.advance(3 * MS)
    assert len(there.received) == 4


# --- the body and the drives -----------------------------------------------------------------


def test_the_body_moves_once_a_period_with_the_motors_where_they_are() -> None:
    moves: list[tuple[int, tuple[float, ...]]] = []

    def body(motors: tuple[float, ...]) -> tuple[Sequence[float], Sequence[float]]:
        moves.append((network.now_ns, motors))
        return (0.25, -0.5), (1.0, -2.0)

    behaviours = [Behaviour(start_pos=pos) for pos in (0.1, 0.2)]
    network = emulate(config(), behaviours, body=body, body_period_ns=2 * MS)
    network.advance(9 * MS)
    assert [at_ns // MS for at_ns, _ in moves] == [2, 4, 6, 8]
    assert moves[-1][1] == pytest.approx((0.1, 0.2))
    for drive, node, link, torque in zip(
        network.drives, config().nodes, (0.25, -0.5), (1.0, -2.0), strict=True
    ):
        values = drive.axis._values
        assert values[0x60E4, 1] == node.link_units.to_counts(link)
        assert values[0x6077, 0] == node.motor.sign * 100 * torque


def test_a_bus_has_one_behaviour_a_drive_and_its_own_period() -> None:
    with pytest.raises(ConfigError, match="1 behaviours for 2 drives"):
        emulate(config(), [Behaviour()])
    network = emulate(config(bitrate=500_000, period_us=2000))
    assert network.bitrate == 500_000
    assert [drive.node_id for drive in network.drives] == [1, 2]
    assert network.log is None
    assert [drive.axis.motion.angle for drive in network.drives] == [0.0, 0.0]
    ticks: list[int] = []

    def body(motors: tuple[float, ...]) -> tuple[Sequence[float], Sequence[float]]:
        ticks.append(network.now_ns)
        return motors, motors

    network = emulate(config(period_us=2000), body=body)
    network.advance(5 * MS)
    assert ticks == [2 * MS, 4 * MS]


# --- error counters --------------------------------------------------------------------------


def test_a_broken_frame_costs_eight_and_is_sent_until_its_node_is_off_the_bus() -> None:
    network = wire(FrameFault(kind=KIND.BAD_BITS, cob_id=0x100))
    here, there = network.attach(), network.attach()
    network.send(here, Frame(0x100))
    network.send(here, Frame(0x101))
    counts = set()
    while not network.off_bus(here):
        network.advance(network.now_ns + 10 * US)
        counts.add(network.errors[here])
        assert network.now_ns < 100 * MS
    # 32 tries of 8 each: 256 (ISO 11898-1, 8.3).
    assert counts == {8 * count for count in range(33)}
    network.advance(200 * MS)
    assert len(there.received) == 32
    assert all(frame == Frame(0x88, bytes(8), error=True) for _, frame, _ in there.received)
    # A try is the frame's head, as long as one of no data at worst, and the error's 23 bits.
    assert [at_ns for at_ns, _, _ in there.received] == [78 * US * count for count in range(1, 33)]
    assert here.received[-1][1] == Frame(0x40, bytes(8), error=True)
    assert here.waiting == 0
    with pytest.raises(BusError, match="the controller is bus-off"):
        network.send(here, Frame(0x101))
    # Off the bus nothing is heard.
    before = len(here.received)
    network.send(there, Frame(0x300))
    network.advance(300 * MS)
    assert len(here.received) == before
    network.recover(here)
    assert network.errors[here] == 0
    network.send(here, Frame(0x101))
    network.advance(400 * MS)
    assert there.received[-1][1] == Frame(0x101)


def test_a_frame_that_gets_through_takes_one_back() -> None:
    end_ns = 70 * US
    network = wire(FrameFault(kind=KIND.BAD_BITS, cob_id=0x100, end_ns=end_ns))
    here, there = network.attach(), network.attach()
    network.send(here, Frame(0x100))
    network.advance(MS)
    assert network.errors[here] == 7
    for left in (6, 5, 4, 3, 2, 1, 0, 0):
        network.send(here, Frame(0x100))
        network.advance(network.now_ns + MS)
        assert network.errors[here] == left
    assert network.errors[there] == 0


def test_a_station_at_another_bitrate_breaks_frames_until_it_is_passive() -> None:
    network = wire()
    here, other = network.attach(), network.attach(bitrate=500_000)
    assert (here.bitrate, other.bitrate) == (1_000_000, 500_000)
    network.send(here, Frame(0x100))
    network.advance(100 * MS)
    # 15 times it is still error active (below 128); what follows goes through.
    assert other.unread == 128
    assert network.errors[here] == 8 * 15 - 1
    assert all(frame.error for _, frame, _ in other.received)
    network.send(other, Frame(0x200))
    network.advance(200 * MS)
    assert network.off_bus(other)
    network.recover(other)
    assert (other.unread, network.errors[other]) == (0, 0)
    network.detach(other)
    network.send(here, Frame(0x100))
    network.advance(300 * MS)
    assert network.errors[here] == 8 * 15 - 2


def test_who_only_listens_breaks_nothing() -> None:
    network = wire()
    here, there = network.attach(), network.attach()
    other = network.attach(bitrate=500_000, listen_only=True)
    network.send(here, Frame(0x100))
    network.advance(MS)
    assert heard(there) == [(47, 0x100)]
    assert [frame.error for _, frame, _ in other.received] == [True]
    assert network.errors[here] == 0
    for _ in range(40):
        network.send(here, Frame(0x100))
    network.advance(20 * MS)
    assert other.unread == 256


# --- faults ----------------------------------------------------------------------------------


@pytest.mark.parametrize("kind", list(KIND))
def test_a_frame_fault_strikes_its_identifier_in_its_window(kind: FrameFaultKind) -> None:
    fault = FrameFault(kind=kind, cob_id=0x100, start_ns=MS, end_ns=2 * MS, length=3)
    for cob_id, at_ns, hit in (
        (0x100, MS - 1, False),
        (0x100, MS, True),
        (0x100, 2 * MS - 1, True),
        (0x100, 2 * MS, False),
        (0x101, MS, False),
    ):
        assert fault.hits(Frame(cob_id), at_ns) == hit
        frame, injector = Frame(cob_id, b"\1\2"), Injector((fault,))
        assert injector.breaks(frame, at_ns) == (hit and kind is KIND.BAD_BITS)
        changed = injector.fate(frame, at_ns) != ((0, frame),)
        assert changed == (hit and kind is not KIND.BAD_BITS)
    everywhere = FrameFault(kind=kind)
    assert all(everywhere.hits(Frame(cob_id), at) for cob_id in (0, 0x7FF) for at in (0, 1 << 61))


@pytest.mark.parametrize(
    ("fault", "arrivals"),
    [
        ({"kind": KIND.DROP}, []),
        ({"kind": KIND.DELAY, "delay_ns": 300 * US}, [(350, b"\1\2")]),
        ({"kind": KIND.DUPLICATE, "delay_ns": 300 * US}, [(63, b"\1\2"), (426, b"\1\2")]),
        ({"kind": KIND.WRONG_LENGTH, "length": 1}, [(63, b"\1")]),
        ({"kind": KIND.WRONG_LENGTH, "length": 4}, [(63, b"\1\2\0\0")]),
        ({"kind": KIND.WRONG_LENGTH, "length": 0}, [(63, b"")]),
    ],
)
def test_what_arrives_of_a_frame(fault: dict[str, Any], arrivals: list[tuple[int, bytes]]) -> None:
    network = wire(FrameFault(cob_id=0x100, **fault))
    here, there = network.attach(), network.attach()
    network.send(here, Frame(0x100, b"\1\2"))
    network.advance(5 * MS)
    if fault["kind"] is KIND.DELAY:
        # It was on the wire once, arrives nowhere, and comes again after the delay.
        arrivals = [(63 + 300 + 63, b"\1\2")]
    assert [(at_ns // US, frame.data) for at_ns, frame, _ in there.received] == arrivals
    # A copy is none of its sender's, and the sender does not hear it.
    assert list(here.received) == []
    assert here.waiting == 0


def test_faults_of_one_frame_add_up_and_a_drop_wins() -> None:
    both = (
        FrameFault(kind=KIND.WRONG_LENGTH, length=1),
        FrameFault(kind=KIND.DUPLICATE, delay_ns=5),
        FrameFault(kind=KIND.DUPLICATE, delay_ns=0),
    )
    frame = Frame(0x100, b"\1\2")
    assert Injector(both).fate(frame, 0) == ((0, Frame(0x100, b"\1")), (5, frame), (1, frame))
    dropped = (*both, FrameFault(kind=KIND.DROP))
    assert Injector(dropped).fate(frame, 0) == ()
    assert Injector((FrameFault(kind=KIND.DELAY),)).fate(frame, 0) == ((1, frame),)


def test_a_babbling_node_speaks_at_its_pace_in_its_window() -> None:
    network = wire(
        Babble(cob_id=0x001, start_ns=3 * MS, end_ns=5 * MS, every_ns=250 * US),
        Babble(cob_id=0x002, start_ns=3 * MS, end_ns=4 * MS, every_ns=9 * MS, data=b"\7"),
    )
    station = network.attach()
    network.advance(20 * MS)
    times = {
        cob_id: [at for at, heard_id in heard(station) if heard_id == cob_id] for cob_id in (1, 2)
    }
    assert len(times[1]) == 2 * 4
    assert times[1][0] == 3000 + 111
    assert times[1][4] == 4000 + 111
    assert len(times[2]) == 1
    assert {frame.data for _, frame, _ in station.received} == {bytes(8), b"\7"}


def drives_after(fault: NodeFault, until_ms: int) -> tuple[Network, Station]:
    """Two drives with heartbeats every 2 ms and a master that listens."""
    network = emulate(config(), [Behaviour(), Behaviour()], faults=(fault,))
    station = network.attach()
    network.advance(6 * MS)
    for drive in network.drives:
        drive._values[0x1017, 0] = 2
    network.advance(until_ms * MS)
    return network, station


def beats(station: Station, node_id: int) -> list[int]:
    """When a node was heard [ms]."""
    return [at_ns // MS for at_ns, frame, _ in station.received if frame.cob_id == 0x700 + node_id]


@pytest.mark.parametrize("node_id", [1, 2])
@pytest.mark.parametrize("kind", [NodeFaultKind.HEARTBEAT_LOSS, NodeFaultKind.SILENT])
def test_a_silent_node_is_not_heard_in_its_window_and_the_other_is(
    kind: NodeFaultKind, node_id: int
) -> None:
    fault = NodeFault(kind=kind, node_id=node_id, start_ns=20 * MS, end_ns=30 * MS)
    network, station = drives_after(fault, 40)
    quiet = [at for at in beats(station, node_id) if 20 <= at < 30]
    assert quiet == []
    for other in (node_id, 3 - node_id):
        told = beats(station, other)
        assert any(at < 20 for at in told)
        assert any(at >= 31 for at in told)
    assert len([at for at in beats(station, 3 - node_id) if 20 <= at < 30]) == 5
    # Without its plug it does not hear either.
    network.inject(NodeFault(kind=kind, node_id=node_id, start_ns=41 * MS))
    network.advance(43 * MS)
    network.send(station, Frame(0x000, b"\1\0"))
    network.advance(45 * MS)
    operational = [drive.state.name == "OPERATIONAL" for drive in network.drives]
    deaf = kind is NodeFaultKind.SILENT
    assert operational[node_id - 1] == (not deaf)
    assert operational[2 - node_id]


@pytest.mark.parametrize(
    ("kind", "code"),
    [(NodeFaultKind.UNDER_VOLTAGE, 0x3220), (NodeFaultKind.OVER_TEMPERATURE, 0x4310)],
)
def test_a_tripped_drive_is_in_fault_and_its_cause_stands_to_the_end(
    kind: NodeFaultKind, code: int
) -> None:
    fault = NodeFault(kind=kind, node_id=2, start_ns=20 * MS, end_ns=30 * MS)
    network, station = drives_after(fault, 21)
    hip, knee = network.drives
    assert (hip.axis.power.state.value, knee.axis.power.state.value) == (
        "switch on disabled",
        "fault",
    )
    told = [frame.data[:2] for _, frame, _ in station.received if frame.cob_id == 0x082]
    assert told == [code.to_bytes(2, "little")]
    assert knee.axis.alarms.standing
    network.advance(29 * MS + 1)
    assert knee.axis.alarms.standing
    network.advance(30 * MS + 1)
    assert not knee.axis.alarms.standing


def test_a_reset_drive_boots_again_once() -> None:
    fault = NodeFault(kind=NodeFaultKind.RESET, node_id=1, start_ns=20 * MS, end_ns=22 * MS)
    network, station = drives_after(fault, 60)
    boots = [at_ns // MS for at_ns, frame, _ in station.received if frame == Frame(0x701, b"\0")]
    assert boots == [5, 25]
    assert network.drives[0]._values[0x1017, 0] == 0
    assert network.drives[1]._values[0x1017, 0] == 2


def test_a_drive_off_the_bus_comes_back_when_its_cause_is_gone() -> None:
    fault = NodeFault(kind=NodeFaultKind.BUS_OFF, node_id=1, start_ns=20 * MS, end_ns=30 * MS)
    network, station = drives_after(fault, 25)
    assert network.off_bus(network.drives[0])
    assert not network.off_bus(network.drives[1])
    network.advance(40 * MS)
    assert not network.off_bus(network.drives[0])
    told = beats(station, 1)
    assert [at for at in told if 20 <= at < 30] == []
    assert any(at > 30 for at in told)


def test_a_drive_whose_frames_break_leaves_the_bus_and_stops() -> None:
    network = emulate(config(), [Behaviour(), Behaviour()])
    station = network.attach()
    network.advance(6 * MS)
    drive = network.drives[0]
    drive._values[0x1017, 0] = 2
    drive._values[0x6007, 0] = 1
    network.inject(FrameFault(kind=KIND.BAD_BITS, cob_id=0x701))
    network.advance(30 * MS)
    assert network.off_bus(drive)
    assert drive.axis.power.state.value == "fault"
    assert sum(frame.error for _, frame, _ in station.received) == 32
