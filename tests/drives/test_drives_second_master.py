"""With another master leading, whatever is started here leaves its run alone, to the bit."""

import struct
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import final

import pytest
from drives_rig import LIMITS, MS, START, STIFFNESS, config

from legbench.commissioning import configure, jitter, zero
from legbench.commissioning.home import home
from legbench.commissioning.jog import jog
from legbench.drives.emulated.behaviour import Behaviour
from legbench.drives.emulated.build import emulate
from legbench.drives.emulated.bus import LockstepBus
from legbench.drives.emulated.network import Network
from legbench.drives.master.link import Link, LinkState
from legbench.drives.master.sample import Sample
from legbench.drives.master.session import Session
from legbench.drives.protocol.cia402 import DriveState
from legbench.drives.protocol.datatypes import DataType
from legbench.drives.protocol.frame import Frame
from legbench.drives.setup.config import BusConfig, Parameter
from legbench.drives.transport.lock import ChannelLock
from legbench.drives.transport.open_bus import LISTEN_NS
from legbench.errors import LegbenchError, PlantFault

U32 = DataType.UNSIGNED32
RAMP = Parameter(index=0x6085, sub=0, kind=U32, value=1 << 31)
FULL = replace(
    LIMITS,
    joint_range=LIMITS.motor_range,
    command_step=0.5,
    joint_speed=60.0,
    standing=0.02,
    sway=0.05,
)
CYCLES = 300
FOREIGN = 5
"""A node that the bus file does not name."""


def bus_config() -> BusConfig:
    nodes = tuple(replace(node, parameters=(RAMP,)) for node in config().nodes)
    return replace(config(), nodes=nodes)


@final
class Wave:
    """A first master that leads both drives along a slow wave."""

    def __init__(self, folder: Path) -> None:
        how = [Behaviour(start_pos=pos, seed=3) for pos in START]
        self.network = emulate(bus_config(), how, keep_log=True)
        self.second = LockstepBus("second", network=self.network)
        self._bus = LockstepBus("first", network=self.network)
        self.link = Link(
            self._bus, bus_config(), LIMITS, stiffness=STIFFNESS, lock=ChannelLock("1", folder)
        )
        self.rows: list[Sample] = []

    def lead(self, cycles: int) -> None:
        """Go on for some cycles."""
        for _ in range(cycles):
            place = len(self.rows) * 1e-4
            self.link.command([START[0] + place, START[1] - place])
            self.rows.append(self.link.exchange())

    def close(self) -> None:
        """End the run, unplug."""
        self.link.close()
        self._bus.shutdown()
        self.second.shutdown()


def run_there(session: Session) -> None:
    session.link(FULL, STIFFNESS).start()


def home_there(session: Session) -> None:
    home(session, session.config.nodes[0], 37)


def jog_there(session: Session) -> None:
    jog(session, FULL, STIFFNESS, "hip", by=0.01, speed=0.1, back=True)


def jitter_there(session: Session) -> None:
    jitter.measure(session, STIFFNESS, 10)


def zero_there(session: Session) -> None:
    zero.measure(session, START)


COMMANDS: dict[str, Callable[[Session], object]] = {
    "configure": configure.write,
    "home": home_there,
    "zero": zero_there,
    "jog": jog_there,
    "jitter": jitter_there,
    "run": run_there,
}


@contextmanager
def waves(folder: Path, name: str) -> Iterator[Wave]:
    (folder / name).mkdir()
    wave = Wave(folder / name)
    try:
        wave.link.start()
        yield wave
    finally:
        wave.close()


@pytest.mark.parametrize("name", list(COMMANDS))
def test_the_run_of_another_master_is_untouched_to_the_bit(name: str, tmp_path: Path) -> None:
    with waves(tmp_path, "alone") as alone:
        alone.lead(CYCLES)
    with waves(tmp_path, "disturbed") as wave:
        wave.lead(CYCLES // 2)
        session = Session(wave.second, bus_config(), lock=ChannelLock("second", tmp_path))
        before = len(wave.network.log or [])
        with pytest.raises(LegbenchError, match="somebody else sends"):
            COMMANDS[name](session)
        for link in session._links:
            link.close()
        assert len(wave.network.log or []) == before
        wave.lead(CYCLES - CYCLES // 2)
        assert wave.link.fault is None
        assert wave.rows == alone.rows
    assert wave.network.log == alone.network.log


@final
class Speaker:
    """Somebody who says one thing at a time of its own."""

    def __init__(self, frame: Frame, at_ns: int, *, every_ns: int = 0) -> None:
        self._frame, self._at_ns, self._every_ns = frame, at_ns, every_ns
        self._out: list[tuple[int, Frame]] = []
        self.said_ns: int | None = None

    def receive(self, frame: Frame, now_ns: int) -> None:
        """It does not listen."""

    def tick(self, now_ns: int) -> float:
        if now_ns >= self._at_ns:
            self._out.append((now_ns, self._frame))
            self.said_ns = now_ns if self.said_ns is None else self.said_ns
            self._at_ns = now_ns + self._every_ns if self._every_ns else 1 << 62
        return 0.0

    def take(self) -> list[tuple[int, Frame]]:
        out, self._out = self._out, []
        return out


def spoken(
    frame: Frame, at_ns: int, *, every_ns: int = 0, changed: Parameter | None = None
) -> tuple[Speaker, Network]:
    """Drives, and somebody else on the wire."""
    speaker = Speaker(frame, at_ns, every_ns=every_ns)
    how = [Behaviour(start_pos=pos) for pos in START]
    drives = emulate(bus_config(), how).drives
    if changed is not None:
        for drive in drives:
            drive._values[changed.key] = changed.value
    return speaker, Network(drives, others=[speaker], keep_log=True)


def writes(network: Network, since_ns: int, but: Frame) -> list[Frame]:
    """Everything but questions that a master has sent since then."""
    found = []
    for at_ns, frame in network.log or []:
        if at_ns <= since_ns or frame == but:
            continue
        if 0x600 < frame.cob_id < 0x680:
            if frame.data[0] >> 5 not in (2, 3, 4):
                found.append(frame)
        elif frame.cob_id in (0x000, 0x080, 0x77E) or 0x200 < frame.cob_id < 0x280:
            found.append(frame)
    return found


SPOKEN = {
    "SYNC": Frame(0x080),
    "command": Frame(0x202, struct.pack("<Hi", 0x0F, 5)),
    "order to all": Frame(0x000, b"\x01\x00"),
    "question": Frame(0x601, bytes.fromhex("4041600000000000")),
    "heartbeat": Frame(0x77E, b"\x05"),
}


@pytest.mark.parametrize("name", [name for name in COMMANDS if name != "jitter"])
@pytest.mark.parametrize("said", list(SPOKEN))
@pytest.mark.parametrize("at_ms", [10, 300, 590])
def test_one_frame_while_listening_is_enough(name: str, said: str, at_ms: int) -> None:
    frame = SPOKEN[said]
    _, network = spoken(frame, at_ms * MS)
    session = Session(LockstepBus("it", network=network), bus_config())
    with (
        session,
        pytest.raises(PlantFault, match=rf"somebody else sends {frame.cob_id:03X}h \(") as caught,
    ):
        COMMANDS[name](session)
    network.advance(network.now_ns + 50 * MS)
    assert caught.value.cause == "second master"
    assert writes(network, 0, frame) == []
    masters = (0x000, 0x080, 0x77E, *range(0x200, 0x280), *range(0x600, 0x680))
    assert [one for _, one in network.log or [] if one.cob_id in masters] == [frame]


@pytest.mark.parametrize("name", ["configure", "home", "run", "jog"])
@pytest.mark.parametrize("after_ms", range(2, 44, 6))
def test_a_newcomer_during_the_bring_up_ends_it_at_once(name: str, after_ms: int) -> None:
    frame = SPOKEN["SYNC"]
    listened_ms = LISTEN_NS // MS * (2 if name == "jog" else 1)
    speaker, network = spoken(frame, (listened_ms + after_ms) * MS)
    session = Session(LockstepBus("it", network=network), bus_config())
    with session, pytest.raises(PlantFault, match="somebody else sends 080h"):
        COMMANDS[name](session)
    network.advance(network.now_ns + 50 * MS)
    assert speaker.said_ns is not None
    # What was on the wire, or in the controller, when the frame ended.
    assert writes(network, speaker.said_ns + MS, frame) == []
    assert all(
        drive.axis.power.state is not DriveState.OPERATION_ENABLED for drive in network.drives
    )


def test_a_newcomer_between_open_and_start_keeps_the_drives() -> None:
    speaker, network = spoken(SPOKEN["command"], 1500 * MS)
    session = Session(LockstepBus("it", network=network), bus_config())
    with session:
        link = session.link(FULL, STIFFNESS)
        link.open()
        assert network.now_ns < 1400 * MS
        network.advance(1600 * MS)
        with pytest.raises(PlantFault, match="somebody else sends 202h"):
            link.start()
        assert link.state is LinkState.CONFIGURED
    network.advance(network.now_ns + 50 * MS)
    assert speaker.said_ns is not None
    assert writes(network, speaker.said_ns, SPOKEN["command"]) == []


def test_a_heartbeat_that_the_drives_watch_for_is_a_masters() -> None:
    watched = Parameter(index=0x1016, sub=1, kind=U32, value=FOREIGN << 16 | 300)
    beat = Frame(0x700 + FOREIGN, b"\x05")
    _, network = spoken(beat, 10 * MS, every_ns=500 * MS, changed=watched)
    session = Session(LockstepBus("it", network=network), bus_config())
    words = r"705h \(the heartbeat that 'hip' watches for\)"
    with session, pytest.raises(PlantFault, match=words):
        configure.write(session)
    assert writes(network, 0, beat) == []


def test_a_heartbeat_that_nobody_watches_for_is_a_bystanders() -> None:
    _, network = spoken(Frame(0x700 + FOREIGN, b"\x05"), 10 * MS, every_ns=100 * MS)
    session = Session(LockstepBus("it", network=network), bus_config())
    with session:
        assert configure.write(session).objects > 0


@pytest.mark.parametrize("period_ms", [1, 20, 100, 333, 500])
def test_every_usual_heartbeat_is_heard(period_ms: int) -> None:
    beat = SPOKEN["heartbeat"]
    _, network = spoken(beat, 3 * MS, every_ns=period_ms * MS)
    network.advance(20 * MS)
    session = Session(LockstepBus("it", network=network), bus_config())
    with session, pytest.raises(PlantFault, match=r"77Eh \(heartbeat of master 126\)"):
        configure.write(session)


def test_alone_on_an_emulated_bus_nobody_waits() -> None:
    network = emulate(bus_config(), keep_log=True)
    session = Session(LockstepBus("it", network=network), bus_config())
    with session:
        zero.measure(session, (0.0, 0.0))
    assert network.now_ns < LISTEN_NS // 2


def test_a_newcomer_in_a_search_does_not_keep_the_stop_from_the_drive() -> None:
    moving = Parameter(index=0x6099, sub=1, kind=U32, value=1 << 17)
    limited = (Parameter(index=0x6065, sub=0, kind=U32, value=1 << 16), RAMP, moving)
    torque = Parameter(index=0x6072, sub=0, kind=DataType.UNSIGNED16, value=500)
    nodes = tuple(replace(one, parameters=(*limited, torque)) for one in config().nodes)
    speaker, network = spoken(SPOKEN["SYNC"], 1100 * MS)
    session = Session(LockstepBus("it", network=network), replace(config(), nodes=nodes))
    with session, pytest.raises(PlantFault, match="somebody else sends 080h"):
        home(session, session.config.nodes[0], -3)
    assert speaker.said_ns is not None
    words = [
        struct.unpack_from("<H", frame.data, 4)[0]
        for at_ns, frame in network.log or []
        if at_ns > speaker.said_ns and frame.cob_id == 0x601 and frame.data[1:3] == b"\x40\x60"
        if frame.data[0] == 0x2B
    ]
    assert words[:1] == [2]
    assert network.drives[0].axis.power.state is DriveState.SWITCH_ON_DISABLED
