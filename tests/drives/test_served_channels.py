"""Two channels, one a drive, that one process serves at two places of whatever kind."""

import json
import os
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path
from typing import final

import can
import pytest
from can_rig import BUS, MS
from served_drives import PATIENCE, end, started

from legbench.cli import main
from legbench.commissioning.emulate import Server
from legbench.drives.emulated.build import emulate_channels
from legbench.drives.emulated.bus_server import BusServer
from legbench.drives.emulated.slcan_server import SlcanServer
from legbench.drives.emulated.unix_server import ChannelsServer
from legbench.drives.errors import BusError
from legbench.drives.setup.bus_file import load_bus
from legbench.drives.setup.config import BusConfig
from legbench.drives.transport.slcan_bus import SlcanBus
from legbench.drives.transport.split_bus import SplitBus
from legbench.drives.transport.unix_bus import UnixBus

SYNC, NMT_START, SDO_READ = 0x080, b"\x01\x00", bytes.fromhex("4018100400000000")
"""Order to all nodes; question for the serial number, 1018h:04."""


def two_channels() -> BusConfig:
    bus = load_bus(BUS)
    first, second = bus.nodes
    return replace(bus, nodes=(replace(first, channel="a"), replace(second, channel="b")))


def split_text() -> str:
    """The bench's bus file, the second drive on a channel of its own."""
    text = BUS.read_text(encoding="utf-8")
    return text.replace('name = "motor2"', 'channel = "can1"\nname = "motor2"')


@final
class Wires:
    """Both channels, a port to each, and a clock that every look moves on by 0.1 ms."""

    def __init__(self, kind: str, folder: Path, made: ExitStack) -> None:
        self.now_ns = 0
        self.moved: list[tuple[float, ...]] = []
        self.config = two_channels()
        self.networks = emulate_channels(self.config, body=self._body, keep_log=True)
        serve = {"unix": self._at_sockets, "slcan": self._at_terminals, "bus": self._on_buses}[kind]
        self.server, self.ports = serve(folder, made)
        self.master = SplitBus(self.ports, self.config)
        made.callback(self.master.shutdown)

    def _at_sockets(self, folder: Path, made: ExitStack) -> tuple[Server, list[can.BusABC]]:
        paths = [folder / "a.sock", folder / "b.sock"]
        server = made.enter_context(ChannelsServer(self.networks, paths, self._clock))
        return server, [UnixBus(str(path)) for path in paths]

    def _at_terminals(self, folder: Path, made: ExitStack) -> tuple[Server, list[can.BusABC]]:
        links = [folder / "a.tty", folder / "b.tty"]
        server = made.enter_context(SlcanServer(self.networks, links, self._clock))
        assert server.path == ",".join(os.readlink(link) for link in links)
        return server, [
            SlcanBus(str(link), bitrate=1_000_000, sleep_after_open=0.0) for link in links
        ]

    def _on_buses(self, _folder: Path, made: ExitStack) -> tuple[Server, list[can.BusABC]]:
        def opened() -> list[can.BusABC]:
            return [can.Bus(interface="virtual", channel=f"served {name}") for name in "ab"]

        split = SplitBus(opened(), self.config)
        return made.enter_context(BusServer(self.networks, split, self._clock)), opened()

    def _clock(self) -> int:
        self.now_ns += MS // 10
        return self.now_ns

    def _body(self, motor_pos: tuple[float, ...]) -> tuple[list[float], list[float]]:
        self.moved.append(motor_pos)
        return list(motor_pos), [0.0, 0.0]

    def on_the_wire(self, place: int) -> set[int]:
        return {frame.cob_id for _, frame in self.networks[place].log or []}

    def wait_for(self, happened: Callable[[], bool]) -> None:
        for _ in range(1000):
            if happened():
                return
            self.server.poll()
        pytest.fail("it has not happened")

    def send(self, cob_id: int, data: bytes = b"") -> None:
        self.master.send(can.Message(arbitration_id=cob_id, data=data, is_extended_id=False))


@pytest.fixture(params=["unix", "slcan", "bus"])
def wires(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[Wires]:
    with ExitStack() as made:
        yield Wires(request.param, tmp_path, made)


def test_each_drive_answers_on_its_own_channel_and_sync_is_on_both(wires: Wires) -> None:
    wires.wait_for(lambda: all(0x700 + 1 + place in wires.on_the_wire(place) for place in (0, 1)))
    wires.send(0x000, NMT_START)
    wires.send(SYNC)
    for node_id in (1, 2):
        wires.send(0x600 + node_id, SDO_READ)
    wires.wait_for(lambda: all(0x581 + place in wires.on_the_wire(place) for place in (0, 1)))
    for place, other in ((0, 1), (1, 0)):
        seen = wires.on_the_wire(place)
        assert {0x000, SYNC, 0x601 + place, 0x581 + place} <= seen
        assert not seen & {0x601 + other, 0x581 + other, 0x181 + other, 0x701 + other}
    serials = {}
    for place, port in enumerate(wires.ports):
        while (message := port.recv(0.0)) is not None:
            assert message.arbitration_id & 0x7F == 1 + place
            if message.arbitration_id == 0x581 + place:
                serials[place] = int.from_bytes(message.data[4:], "little")
    assert serials == {0: 1001, 1: 1002}


def test_both_channels_pass_the_same_time_and_move_one_leg(wires: Wires) -> None:
    for _ in range(50):
        wires.server.poll()
        assert wires.networks[0].now_ns == wires.networks[1].now_ns
    now_ms = wires.networks[0].now_ns // MS
    assert now_ms >= 5
    # Once in every period, with both motors.
    assert [len(motors) for motors in wires.moved] == [2] * now_ms


def test_no_socket_file_is_left_when_the_second_one_cannot_be_made(tmp_path: Path) -> None:
    (tmp_path / "b.sock").write_text("mine")
    networks = emulate_channels(two_channels())
    with pytest.raises(BusError, match=r"cannot serve a bus at .*b\.sock"):
        ChannelsServer(networks, [tmp_path / "a.sock", tmp_path / "b.sock"])
    assert [path.name for path in tmp_path.iterdir()] == ["b.sock"]


def test_no_terminal_is_left_when_the_second_one_gets_no_link(tmp_path: Path) -> None:
    (tmp_path / "b.tty").write_text("mine")
    networks = emulate_channels(two_channels())
    with pytest.raises(BusError, match=r"cannot serve a bus at .*b\.tty"):
        SlcanServer(networks, [tmp_path / "a.tty", tmp_path / "b.tty"])
    assert [path.name for path in tmp_path.iterdir()] == ["b.tty"]


@pytest.mark.parametrize(("serve", "interface"), [("unix", "legbench_unix"), ("slcan", "slcan")])
def test_a_master_in_another_process_reads_both_drives(
    serve: str,
    interface: str,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    (tmp_path / "leg.toml").write_text(split_text(), encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    where = ("--bus", "leg.toml", "--channel", "a.sock,b.sock")
    ask = ("drives", "emulate", *where, "--serve", serve, "--bare", "--json")
    drives = started(tmp_path, *ask, "--seconds", str(2 * PATIENCE), "--patience", "5000")
    try:
        assert drives.stdout is not None
        lines = [json.loads(drives.stdout.readline()) for _ in range(2)]
        assert [line["node"] for line in lines] == ["motor1", "motor2"]
        ask = ("drives", "scan", *where, "--interface", interface, "--last", "3", "--json")
        assert main(list(ask)) == 0
    finally:
        end(drives)
    found = json.loads(capsys.readouterr().out)["nodes"]
    assert [(node["node_id"], node["serial"]) for node in found] == [(1, 1001), (2, 1002)]
