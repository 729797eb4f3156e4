"""Emulated channels, their server and their objects at the edges, each by itself."""

from dataclasses import replace
from typing import Any, cast, final

import can
import pytest
from drives_rig import config, node
from test_sheet_proposals import drive

from legbench.drives.emulated import bus_server
from legbench.drives.emulated.build import emulate_channels
from legbench.drives.emulated.bus import LockstepBus
from legbench.drives.emulated.bus_server import BusServer
from legbench.drives.emulated.channels_bus import ChannelsBus
from legbench.drives.emulated.dictionary import dictionary_of
from legbench.drives.emulated.emergencies import EmergencyOutlet
from legbench.drives.emulated.faults import FrameFault, FrameFaultKind
from legbench.drives.emulated.homing_methods import METHODS, Move, Until
from legbench.drives.emulated.injector import Injector
from legbench.drives.emulated.lss import LssSlave, address_of
from legbench.drives.emulated.network import Network
from legbench.drives.emulated.shared_body import LockstepChannels
from legbench.drives.emulated.station import Heard
from legbench.drives.protocol.datatypes import DataType
from legbench.drives.protocol.frame import Frame
from legbench.drives.protocol.lss import LssMode
from legbench.drives.protocol.sdo import Abort
from legbench.drives.setup.config import BusConfig, Parameter
from legbench.drives.transport.split_bus import SplitBus


def apart() -> BusConfig:
    """The rig's drives, each on a channel of its own."""
    first, second = config().nodes
    return config(nodes=(replace(first, channel="a"), replace(second, channel="b")))


# --- channels --------------------------------------------------------------------------------


def test_a_bus_of_channels_is_alone_restarted_and_named_as_all_of_them() -> None:
    networks = emulate_channels(apart())
    with ChannelsBus(networks, apart()) as bus:
        assert bus.networks == networks
        assert (bus.channel, bus.channel_info) == ("a+b", "emulated buses a + b")
        assert bus.filters is None
        assert bus.alone
        for network in networks:
            other = network.attach()
            assert not bus.alone
            network.detach(other)
        for network, station in zip(networks, bus._stations, strict=True):
            network.errors[station] = 256
        assert bus.state is can.BusState.ERROR
        bus.state = can.BusState.ACTIVE
        assert [n.errors[s] for n, s in zip(networks, bus._stations, strict=True)] == [0, 0]
    with pytest.raises(ValueError, match="zip"):
        ChannelsBus(networks[:1], apart())


@pytest.mark.parametrize("place", [0, 1])
def test_what_waits_on_one_channel_is_received_without_a_wait_for_the_other(place: int) -> None:
    networks = emulate_channels(apart())
    with ChannelsBus(networks, apart()) as bus:
        bus._stations[place].received.append(Heard(0, Frame(0x123)))
        message = bus.recv(1.0)
        assert message is not None
        assert message.arbitration_id == 0x123
        assert [network.now_ns for network in networks] == [0, 0]


@pytest.mark.parametrize("count", [1, 2, 3])
def test_channels_pass_the_same_time_however_many_there_are(count: int) -> None:
    networks = [Network(()) for _ in range(count)]
    together = LockstepChannels(networks)
    assert (together.now_ns(), together.next_ns()) == (0, 1_000_000)
    together.advance(1_500_000, [])
    assert together.now_ns() == 1_500_000
    together.wait_until(2_500_000)
    assert [network.now_ns for network in networks] == [2_500_000] * count


# --- a server of several buses ---------------------------------------------------------------


@final
class Interface:
    """An interface that has one message, and notes how long it was waited for."""

    def __init__(self, name: str) -> None:
        self.channel = self.channel_info = name
        self.waited: list[float] = []
        self._waiting = [can.Message(arbitration_id=0x101, is_extended_id=False)]

    def recv(self, timeout: float) -> can.Message | None:
        self.waited.append(timeout)
        return self._waiting.pop() if self._waiting else None

    def shutdown(self) -> None:
        """Nothing is held."""


@pytest.mark.parametrize("count", [1, 2, 3])
def test_a_server_waits_for_all_its_buses_at_once_and_takes_from_each(
    count: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    waits: list[tuple[int, float]] = []
    monkeypatch.setattr(
        bus_server, "wait_for_any", lambda parts, left: waits.append((len(parts), left))
    )
    interfaces = [Interface(name) for name in "abc"[:count]]
    bus = cast(Any, interfaces[0] if count == 1 else SplitBus(cast(Any, interfaces), config()))
    networks = [Network(()) for _ in interfaces]
    with BusServer(networks, bus, lambda: 0) as server:
        server.poll()
        assert [port._station.waiting for port in server._ports] == [1] * count
    # The next tick of the networks is 1 ms away.
    if count == 1:
        assert waits == []
        assert interfaces[0].waited == [1e-3, 0.0]
    else:
        assert waits == [(count, 1e-3)]
        assert [each.waited for each in interfaces] == [[0.0, 0.0]] * count
    with pytest.raises(ValueError, match="zip"):
        BusServer([*networks, Network(())], bus, lambda: 0)


# --- objects ---------------------------------------------------------------------------------


def test_a_value_beyond_the_limits_of_a_data_sheet_is_refused_on_its_side() -> None:
    limited = drive(limits={(0x6065, 0): (10, 20)})
    shown = dictionary_of(node(0), limited)
    answers = {9: Abort.TOO_LOW, 10: None, 20: None, 21: Abort.TOO_HIGH}
    assert {value: shown.refusal((0x6065, 0), value) for value in answers} == answers
    assert shown.refusal((0x6066, 0), -1) is None


def test_a_drive_without_an_interpolation_time_or_a_mode_works_as_it_should_all_the_same() -> None:
    cycle, power = (0x60C2, 1), (0x60C2, 2)
    mode, display = (0x6060, 0), (0x6061, 0)
    for period_us, value in ((None, 1), (1000, 1), (2000, 2)):
        lacking = drive(cycle, power, mode)
        how: dict[str, Any] = {} if period_us is None else {"period_us": period_us}
        shown = dictionary_of(node(0), lacking, **how)
        # Cyclic synchronous position is mode 8 (CiA 402).
        assert (shown.hidden[cycle], shown.hidden[power], shown.hidden[mode]) == (value, -3, 8)
        assert {entry.key: entry.default for entry in shown.entries}[display] == 8
        assert display not in shown.hidden
    whole = dictionary_of(node(0), drive())
    assert not {cycle, power, mode, display} & whole.hidden.keys()
    assert {entry.key: entry.default for entry in whole.entries}[display] == 0


def test_the_top_speed_of_a_data_sheet_stops_no_motor_unless_the_bus_file_gives_one() -> None:
    key = (0x6080, 0)
    given = Parameter(index=0x6080, sub=0, kind=DataType.UNSIGNED32, value=5)
    for parameters, kind in (((), DataType.OCTET_STRING), ((given,), DataType.UNSIGNED32)):
        shown = dictionary_of(replace(node(0), parameters=parameters), drive())
        (entry,) = [entry for entry in shown.entries if entry.key == key]
        assert entry.kind is kind


# --- services --------------------------------------------------------------------------------

MINE = (0x1234, 7, 0x10002, 101)
"""Vendor, product, revision and serial number of a drive."""


def request(specifier: int, word: int, rest: bytes = bytes(3)) -> bytes:
    return bytes([specifier]) + word.to_bytes(4, "little") + rest


def test_an_address_is_the_four_words_of_an_identity() -> None:
    values = {(0x1018, sub): word for sub, word in enumerate((*MINE, 999), start=1)}
    assert address_of(values) == MINE
    assert address_of({(0x1018, 3): 5}) == (0, 0, 5, 0)


def test_a_drive_is_selected_by_four_words_in_their_order_however_often_it_is_tried() -> None:
    # CiA 305: 40h to 43h, answered by 44h.
    slave = LssSlave(MINE, 5)
    others = ((1, *MINE[1:]), (*MINE[:3], 1), (MINE[0], 1, *MINE[2:]))
    for words in (*others, MINE):
        answers = [slave.feed(request(0x40 + place, word)) for place, word in enumerate(words)]
        assert [answer and answer[0] for answer in answers] == [
            *(None, None, None),
            0x44 if words == MINE else None,
        ]
    assert slave.mode is LssMode.CONFIGURATION


@pytest.mark.parametrize(("node_id", "answers"), [(0xFF, True), (5, False)])
def test_a_drive_with_a_node_id_takes_no_part_in_a_scan(*, node_id: int, answers: bool) -> None:
    # CiA 305, fast scan: 51h with bit 80h asks who has no node id, and 4Fh answers.
    reset = request(0x51, 0, bytes((0x80, 0, 0)))
    slave = LssSlave(MINE, node_id)
    assert (slave.feed(reset) is not None) is answers
    # One that has got its node id and has not left initialisation yet is silent, too.
    slave.feed(request(0x04, 0x01))
    slave.feed(request(0x11, 7))
    slave.feed(request(0x04, 0x00))
    assert slave.feed(reset) is None


def test_every_fault_of_frames_may_destroy_one_and_every_message_that_was_held_is_sent() -> None:
    faults = [
        FrameFault(kind=kind, cob_id=cob_id)
        for kind, cob_id in (
            (FrameFaultKind.BAD_BITS, 0x181),
            (FrameFaultKind.DROP, 0x182),
            (FrameFaultKind.BAD_BITS, 0x183),
        )
    ]
    injector = Injector(faults)
    broken = [injector.breaks(Frame(0x180 + number), 0) for number in range(5)]
    assert broken == [False, True, False, True, False]
    outlet = EmergencyOutlet({(0x1015, 0): 10})
    outlet.mute()
    for number in (1, 2):
        outlet.put(Frame(0x80 + number), 500)
    assert outlet.take() == []
    outlet.unmute(1000)
    # 1015h is the inhibit time in units of 0.1 ms (CiA 301).
    assert outlet.take() == [(1000, Frame(0x81)), (1_001_000, Frame(0x82))]


def test_a_search_goes_one_way_or_the_other_and_turns_round_where_it_is_said() -> None:
    moves = [move for method in METHODS.values() for move in method]
    assert {move.direction for move in moves} == {-1, 1}
    assert not Move(direction=1, until=Until.HOME).turns
    # CiA 402-2: methods 7 to 14 and 23 to 30 begin towards a limit switch and turn round there.
    turning = {number for number, method in METHODS.items() if any(move.turns for move in method)}
    assert turning == {*range(7, 15), *range(23, 31)}


def test_an_emulated_bus_is_let_go_when_it_is_shut_and_hears_itself_only_if_asked() -> None:
    network = Network(())
    for asked in ({}, {"receive_own_messages": False}, {"receive_own_messages": True}):
        with LockstepBus("wire", network=network, **cast(Any, asked)) as bus:
            assert network.alone(bus.station)
            bus.send(can.Message(arbitration_id=0x101, is_extended_id=False))
            heard = bus.recv(1e-3)
            assert (heard is not None) is asked.get("receive_own_messages", False)
        assert network._nodes == []
