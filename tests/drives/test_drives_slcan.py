"""The drives behind an adapter on a serial line: protocol, adapter, terminal; no clock but ours."""

import itertools
import os
import random
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any

import can
import pytest
from can.interfaces import slcan
from can.interfaces.slcan import slcanBus
from can_rig import BUS, MS

from legbench.drives.emulated.build import emulate
from legbench.drives.emulated.network import Network
from legbench.drives.emulated.slcan import SlcanAdapter
from legbench.drives.emulated.slcan_line import FULL
from legbench.drives.emulated.slcan_server import SlcanServer
from legbench.drives.errors import BusError
from legbench.drives.protocol.frame import Frame
from legbench.drives.protocol.slcan import bitrate_of_registers, format_frame, parse_frame
from legbench.drives.setup.bus_file import load_bus
from legbench.drives.transport.open_bus import Adapter, open_bus
from legbench.drives.transport.slcan_bus import SlcanBus

ASK = can.Message(
    arbitration_id=0x601, data=bytes.fromhex("4000100000000000"), is_extended_id=False
)
"""SDO: what is your device type?"""


@pytest.fixture
def network() -> Network:
    network = emulate(load_bus(BUS))
    network.advance(10 * MS)
    return network


def served(network: Network, link: Path | None = None, warned: list[str] | None = None):
    clock = itertools.count(0, MS // 10)
    told = [] if warned is None else warned
    return SlcanServer([network], [link], lambda: next(clock), told.append)


@pytest.fixture
def server(network: Network) -> Iterator[SlcanServer]:
    with served(network) as it:
        yield it


def asked(server: SlcanServer, bitrate: int = 1_000_000) -> can.BusABC:
    """A bus whose adapter has not read yet that it is opened."""
    adapter = Adapter(interface="slcan", channel=server.path)
    return open_bus(load_bus(BUS).at(bitrate), adapter)


def opened(server: SlcanServer, bitrate: int = 1_000_000) -> can.BusABC:
    bus = asked(server, bitrate)
    for _ in range(10):
        server.poll()
    return bus


def answered(server: SlcanServer, bus: can.BusABC, cob_id: int) -> can.Message | None:
    for _ in range(200):
        server.poll()
        message = bus.recv(0.0)
        if message is not None and message.arbitration_id == cob_id:
            return message
    return None


@pytest.mark.parametrize(
    ("frame", "line"),
    [
        (Frame(0x080), b"t0800\r"),
        (Frame(0x181, bytes(range(8))), b"t18180001020304050607\r"),
        (Frame(0x1ABCDEF0, b"\xff", extended=True), b"T1ABCDEF01FF\r"),
        (Frame(0x123, remote=True), b"r1230\r"),
        (Frame(0x123, remote=True, dlc=8), b"r1238\r"),
        (Frame(0x1, remote=True, extended=True), b"R000000010\r"),
    ],
)
def test_a_frame_survives_its_line(frame: Frame, line: bytes) -> None:
    assert format_frame(frame) == line
    assert parse_frame(line.decode().rstrip("\r")) == frame


@pytest.mark.parametrize(
    "line",
    [
        *("", "t", "z", "V1013", "NLEGB", "q1230", "t18", "t1819", "t18x0", "t8000", "T200000000"),
        *("t1812AA", "t1811AABB", "t181 1AA", "r1231AA"),
    ],
)
def test_other_lines_are_no_frames(line: str) -> None:
    assert parse_frame(line) is None


def test_registers_of_an_adapter_say_its_bitrate() -> None:
    found = [bitrate_of_registers(text) for text in ("0014", "001C", "031C", "x", "0014FF")]
    assert found == [1_000_000, 500_000, 125_000, None, None]


@pytest.mark.parametrize(
    ("lines", "answers"),
    [
        ("O\r", "\a"),  # no bitrate yet
        ("C\r", "\a"),
        ("S8\rO\rO\rC\rC\r", "\r\r\a\r\a"),
        ("S8\rO\rS6\r", "\r\r\a"),  # not while it is open
        ("s0014\rO\r", "\r\r"),
        ("Sx\rsxyz\rQ\rt0800\r", "\a\a\a\a"),
        ("S8\rO\rt0800\rt18\rT00000080\r", "\r\r\r\a\a"),
        ("S8\rL\rt0800\r", "\r\r\a"),  # listening only
        ("\rV\rN\rZ0\rZ1\r", "\rV1013\rNLEGB\r\r\a"),
        ("F\rS8\rO\rF\r", "\a\r\rF00\r"),
        (40 * "x" + "\rV\r", "\a\aV1013\r"),
    ],
)
def test_an_adapter_answers_as_its_manual_says(network: Network, lines: str, answers: str) -> None:
    assert SlcanAdapter(network).feed(lines.encode()) == answers.encode()


def test_an_adapter_at_another_bitrate_passes_nothing_and_shows_it(network: Network) -> None:
    adapter = SlcanAdapter(network)
    adapter.feed(b"S6\rO\r" + format_frame(Frame(0x601, bytes(ASK.data))))
    network.advance(100 * MS)
    assert adapter.take() == b""
    assert adapter.feed(b"F\rt0800\r") == b"FA4\r\a"


def test_python_can_reaches_the_drives(server: SlcanServer) -> None:
    with opened(server) as bus:
        assert isinstance(bus, SlcanBus)
        bus.send(ASK)
        message = answered(server, bus, 0x581)
        assert message is not None
        assert message.data[4:6] == b"\x92\x01"


def test_the_one_of_python_can_itself_does_too(server: SlcanServer) -> None:
    with slcanBus(server.path, bitrate=1_000_000, sleep_after_open=0) as bus:
        for _ in range(10):
            server.poll()
        bus.send(ASK)
        assert answered(server, bus, 0x581) is not None


def test_a_frame_behind_an_acknowledgement_is_not_missed(server: SlcanServer) -> None:
    with opened(server) as bus:
        os.write(server._lines[0]._ours, b"\r\r\a\rt7011")
        assert bus.recv(0.0) is None
        os.write(server._lines[0]._ours, b"05\r\rt70210")
        message = bus.recv(0.0)
        assert message is not None
        assert (message.arbitration_id, message.data) == (0x701, b"\x05")
        bus.set_filters([{"can_id": 0x701, "can_mask": 0x7FF}])
        os.write(server._lines[0]._ours, b"5\rt701104\r")
        message = bus.recv(0.0)
        assert message is not None
        assert message.data == b"\x04"


def test_a_wrong_bitrate_is_told_on_both_sides(network: Network) -> None:
    warned: list[str] = []
    with served(network, warned=warned) as server, opened(server, 500_000) as bus:
        bus.send(ASK)
        assert answered(server, bus, 0x581) is None
    assert warned == [
        "the adapter was set to 500000 bit/s, the bus runs at 1000000 bit/s: no frame passes"
    ]


def test_what_an_earlier_program_left_unread_is_forgotten(
    network: Network, server: SlcanServer
) -> None:
    first, other = opened(server), network.attach(1 << 16)
    for count in range(FULL // 50):
        network.send(other, Frame(0x7EE, count.to_bytes(8, "little")))
        server.poll()
    assert server._lines[0]._unsent
    with asked(server) as bus:
        bus.send(ASK)
        heard, left, before = [], server._lines[0]._unsent, server._lines[0]._openings
        for _ in range(100):
            # What lies in the terminal is the kernel's; what the adapter still holds is forgotten.
            left = server._lines[0]._unsent if server._lines[0]._openings == before else left
            server.poll()
            heard += iter(lambda: bus.recv(0.0), None)
        old = [frame for frame in map(parse_frame, left.decode().split("\r")[1:]) if frame]
        assert len(old) > 100
        assert 0x581 in [message.arbitration_id for message in heard]
        assert not {frame.data for frame in old} & {bytes(message.data) for message in heard}
    first.shutdown()


def test_a_link_names_the_terminal_and_goes_with_it(network: Network, tmp_path: Path) -> None:
    link = tmp_path / "leg"
    link.symlink_to("/dev/pts/none")
    with served(network, link) as server:
        assert os.readlink(link) == server.path
        with pytest.raises(BusError, match=r"cannot serve a bus at .*leg: File exists"):
            served(network, link)
        assert link.exists()
    assert not link.is_symlink()
    server.close()


def test_a_terminal_that_goes_is_a_bus_error(server: SlcanServer) -> None:
    bus = opened(server)
    server.close()
    with pytest.raises(can.CanOperationError, match=r"/dev/pts/\d+: "):
        bus.recv(0.0)
    with suppress(can.CanOperationError):
        bus.shutdown()


def test_a_missing_package_names_the_extra(
    server: SlcanServer, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(slcan, "serial", None)
    with pytest.raises(BusError, match=r"pip install 'legbench\[slcan\]'"):
        open_bus(load_bus(BUS), Adapter(interface="slcan", channel=server.path))


def test_no_bytes_hurt_either_side(network: Network, server: SlcanServer) -> None:
    chance = random.Random(7)
    letters = b"SsOCLtTrRFVNZX0123456789ABCDEFabcxyz\r\r\r\r\a\x00\xff"
    adapter = SlcanAdapter(network)
    with opened(server) as bus:
        for _ in range(3000):
            chunk = bytes(chance.choices(letters, k=chance.randrange(1, 60)))
            assert adapter.feed(chunk) is not None
            network.advance(network.now_ns + MS // 10)
            adapter.take()
            os.write(server._lines[0]._ours, chunk)
            while bus.recv(0.0) is not None:
                continue


def test_an_adapter_that_takes_nothing_more_is_named_and_holds_nobody_up(
    server: SlcanServer,
) -> None:
    bus = opened(server)

    def send_for_ever() -> None:
        while True:
            bus.send(ASK)

    # Nobody polls the server: the line fills up.
    with pytest.raises(can.CanOperationError, match=f"{server.path}: .*takes no frame any more"):
        send_for_ever()
    with suppress(can.CanOperationError):  # It comes back, whatever room there is by then.
        bus.shutdown()


def test_a_line_that_was_cut_is_ended_before_the_next_one(
    server: SlcanServer, monkeypatch: pytest.MonkeyPatch
) -> None:
    bus = opened(server)
    write = os.write
    with monkeypatch.context() as patched:
        patched.setattr(os, "write", lambda line, data: write(line, data[:5]))
        with pytest.raises(can.CanOperationError, match="takes no frame any more"):
            bus.send(ASK)
    bus.send(ASK)
    first, second = answered(server, bus, 0x581), answered(server, bus, 0x581)
    assert first is not None
    assert second is not None
    bus.shutdown()


def test_what_is_no_classic_frame_is_not_sent_and_a_closed_bus_does_nothing(
    server: SlcanServer,
) -> None:
    bus = opened(server)
    wrong: list[dict[str, Any]] = [
        {"is_error_frame": True},
        {"is_fd": True},
        {"arbitration_id": 1 << 29},
    ]
    for changes in wrong:
        with pytest.raises(can.CanOperationError, match=r"not sent|29 bits"):
            # pyrefly: ignore[bad-argument-type]
            bus.send(can.Message(**{"arbitration_id": 0, "data": b"\1\1", **changes}))
    bus.shutdown()
    for call in (lambda: bus.send(ASK), lambda: bus.recv(0.0)):
        with pytest.raises(can.CanOperationError, match="shut down"):
            call()


@pytest.mark.parametrize(
    ("given", "error"),
    [
        ({"bitrat": 5}, TypeError),
        ({"receive_own_messages": True}, TypeError),
        ({"fd": True}, can.CanInitializationError),
    ],
)
def test_settings_that_an_adapter_does_not_have_are_refused(
    server: SlcanServer, given: dict[str, object], error: type[Exception]
) -> None:
    with pytest.raises(
        error, match=r"classic CAN|takes no (bitrat|receive_own_messages); .*bitrate"
    ):
        SlcanBus(server.path, sleep_after_open=0.0, **given)
    SlcanBus(server.path, sleep_after_open=0.0, fd=False, single_handle=True).shutdown()


def test_frames_are_stamped_when_their_bytes_are_read(
    server: SlcanServer, monkeypatch: pytest.MonkeyPatch
) -> None:
    with opened(server) as bus:
        for _ in range(3):
            bus.send(ASK)
        for _ in range(50):
            server.poll()
        seconds = itertools.count(100)
        monkeypatch.setattr("legbench.drives.transport.slcan_bus.time.time", lambda: next(seconds))
        answers = [bus.recv(0.0) for _ in range(3)]
        assert [answer.timestamp for answer in answers if answer is not None] == [100, 100, 100]
