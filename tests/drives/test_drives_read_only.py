"""Read-only changes nothing in a drive, whoever leads it and however it is found."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import final

import pytest
from drives_rig import LIMITS, MS, START, STIFFNESS, Rig, config, rig

from legbench.commissioning.jitter import measure
from legbench.drives.emulated.behaviour import Behaviour
from legbench.drives.emulated.build import emulate
from legbench.drives.emulated.bus import LockstepBus
from legbench.drives.emulated.faults import FrameFault, FrameFaultKind
from legbench.drives.emulated.network import Network
from legbench.drives.errors import BusError, DriveError
from legbench.drives.master.cycle import Tick
from legbench.drives.master.link import Link, LinkState
from legbench.drives.master.read_only import may_pace, may_read
from legbench.drives.master.session import Session
from legbench.drives.protocol.cia402 import DriveState
from legbench.drives.protocol.frame import Frame
from legbench.drives.protocol.nmt import NmtCommand, NmtState, heartbeat_frame, nmt_frame
from legbench.drives.transport.lock import ChannelLock
from legbench.errors import PlantFault

OE = DriveState.OPERATION_ENABLED
MASTER = 126
RUNNING = (0x6041, 0x6062, 0x6064, 0x606C, 0x60FC, 0x60F4, 0x6077)
"""Objects that tell what a drive does, and change by themselves."""


def held(network: Network) -> list[dict[tuple[int, int], object]]:
    """Everything that the drives hold, but for what they measure."""
    return [
        {key: value for key, value in drive._values.items() if key[0] not in RUNNING}
        for drive in network.drives
    ]


def sent(network: Network) -> list[Frame]:
    """What a master has said: everything that no drive says."""
    masters = (0x000, 0x080, 0x700 + MASTER, *range(0x200, 0x280), *range(0x600, 0x680))
    return [frame for _, frame in network.log or [] if frame.cob_id in masters]


def observe(link: Link, cycles: int) -> None:
    for _ in range(cycles):
        link.exchange()


@final
class OtherMaster:
    """Leads both drives from another computer: start, SYNC and heartbeat."""

    def __init__(self) -> None:
        self.out: list[tuple[int, Frame]] = []
        self.count = 0
        self.silent = False

    def receive(self, frame: Frame, now_ns: int) -> None:
        """It knows what it wants."""

    def tick(self, now_ns: int) -> float:
        self.count += 1
        if self.count >= 20 and not self.silent:
            if self.count == 20:
                self.out.append((now_ns, nmt_frame(NmtCommand.START)))
            self.out.append((now_ns, Frame(0x080)))
            if self.count % 10 == 0:
                self.out.append((now_ns, heartbeat_frame(MASTER, NmtState.OPERATIONAL)))
        return 0.0

    def take(self) -> list[tuple[int, Frame]]:
        out, self.out = self.out, []
        return out


@contextmanager
def beside(folder: Path) -> Iterator[tuple[OtherMaster, Rig]]:
    """A link in read-only on a bus that another master leads."""
    drives = emulate(config(), [Behaviour(start_pos=pos) for pos in START], configured=True).drives
    other = OtherMaster()
    network = Network(drives, others=[other], keep_log=True)
    with LockstepBus("rig", network=network) as bus:
        lock = ChannelLock("rig", folder)
        link = Link(bus, config(), LIMITS, stiffness=STIFFNESS, read_only=True, lock=lock)
        network.advance(100 * MS)
        yield other, Rig(config(), network, bus, link)
        link.close()


def test_alone_it_asks_and_paces_and_leaves_the_drives_as_they_were(tmp_path: Path) -> None:
    with rig(tmp_path, read_only=True, configured=True) as it:
        it.network.advance(20 * MS)
        before = held(it.network)
        sample = it.link.start()
        assert sample.motor_pos == pytest.approx(START, abs=1e-5)
        assert it.link.state is LinkState.CYCLIC
        assert not it.link.listening
        observe(it.link, 300)
        with pytest.raises(DriveError, match="this link is read-only"):
            it.link.command(START)
        it.link.close()
        assert held(it.network) == before
        it.network.advance(it.network.now_ns + 100 * MS)
        # Drives that watch for a heartbeat note that it has ended, as after every run.
        for now, then in zip(held(it.network), before, strict=True):
            assert {key[0] for key in now if now[key] != then[key]} == {0x1001, 0x1003, 0x603F}
            assert now[0x1003, 1] == 0x8130
        assert all(drive.state is NmtState.PRE_OPERATIONAL for drive in it.network.drives)
        assert it.words() == []
        assert all(may_pace(MASTER)(frame.cob_id, frame.data) for frame in sent(it.network))


def test_beside_another_master_it_only_asks(tmp_path: Path) -> None:
    with beside(tmp_path) as (other, it):
        holder = ChannelLock("rig", tmp_path)
        holder.acquire()  # a master of this computer: no reason not to look
        before, count = held(it.network), other.count
        sample = it.link.start()
        assert it.link.listening
        assert sample.motor_pos == pytest.approx(START, abs=1e-5)
        observe(it.link, 300)
        it.link.close()
        it.network.advance(it.network.now_ns + 100 * MS)
        assert held(it.network) == before
        assert all(drive.state is NmtState.OPERATIONAL for drive in it.network.drives)
        theirs = (0x000, 0x080, 0x700 + MASTER)
        asked = [frame for frame in sent(it.network) if frame.cob_id not in theirs]
        assert asked
        assert all(may_read(frame.cob_id, frame.data) for frame in asked)
        # One start, and a SYNC for each of its own ticks: none of these came from here.
        numbers = [frame.cob_id for frame in sent(it.network)]
        assert (numbers.count(0x000), numbers.count(0x080)) == (1, other.count - 19)
        assert other.count - count > 300
        holder.release()


def test_a_sync_that_ends_ends_the_look(tmp_path: Path) -> None:
    with beside(tmp_path) as (other, it):
        it.link.start()
        observe(it.link, 10)
        other.silent = True
        with pytest.raises(PlantFault, match="sent no process data for 3 cycles"):
            observe(it.link, 20)
        assert not it.link.cycle.bus_off


@pytest.mark.parametrize("missed", [1, 2])
def test_time_goes_on_where_sync_is_missing(tmp_path: Path, missed: int) -> None:
    with beside(tmp_path) as (_, it):
        it.link.start()
        began_ns = it.link.exchange().time_ns
        start_ns = it.network.now_ns // MS * MS + 5 * MS
        it.network.inject(
            FrameFault(
                kind=FrameFaultKind.DROP,
                cob_id=0x080,
                start_ns=start_ns,
                end_ns=start_ns + missed * MS,
            )
        )
        samples = [it.link.exchange() for _ in range(20)]
        periods = sum(1 + sample.skipped for sample in samples)
        assert samples[-1].time_ns - began_ns == periods * MS


def test_a_sync_that_is_missed_is_counted(tmp_path: Path) -> None:
    with beside(tmp_path) as (_, it):
        it.link.start()
        start_ns = it.network.now_ns // MS * MS + 5 * MS
        it.network.inject(
            FrameFault(
                kind=FrameFaultKind.DROP, cob_id=0x080, start_ns=start_ns, end_ns=start_ns + MS
            )
        )
        observe(it.link, 20)
        assert it.link.skipped_total == 1
        # Whoever only looks is not to blame for what another master misses.
        it.link._supervisor.bus(Tick(0, 0, 50, 50, True))


def test_a_drive_that_is_not_configured_is_refused_with_the_way_out(tmp_path: Path) -> None:
    with rig(tmp_path, read_only=True) as it:
        it.network.advance(20 * MS)
        before = held(it.network)
        words = (
            r"node 1 \('hip'\) holds \d+ objects otherwise than the bus file, first .*1006h:00.*: "
            r"0, wanted 1000; read-only changes no drive: run `legbench drives configure --write`"
        )
        with pytest.raises(DriveError, match=words):
            it.link.open()
        it.link.close()
        assert held(it.network) == before
        assert all(may_read(frame.cob_id, frame.data) for frame in sent(it.network))
        ChannelLock("rig", tmp_path).acquire()


@pytest.mark.parametrize(
    ("found", "words"),
    [
        ("power", r"'knee' \(node 2\) has power, though nobody sends SYNC"),
        ("operational", r"'knee' \(node 2\) is operational, though nobody sends SYNC"),
    ],
)
def test_a_drive_that_somebody_leads_without_sync_is_left_alone(
    tmp_path: Path, found: str, words: str
) -> None:
    with rig(tmp_path, read_only=True, configured=True) as it:
        it.network.advance(20 * MS)
        knee = it.network.drives[1]
        if found == "power":
            knee.axis.power.state = OE
        else:
            knee.state = NmtState.OPERATIONAL
        with pytest.raises(DriveError, match=words):
            it.link.open()
        assert all(may_read(frame.cob_id, frame.data) for frame in sent(it.network))


@pytest.mark.parametrize(
    "frame",
    [heartbeat_frame(MASTER, NmtState.OPERATIONAL), nmt_frame(NmtCommand.ENTER_PRE_OPERATIONAL)],
    ids=str,
)
def test_a_master_that_has_not_sent_sync_yet_is_not_disturbed(tmp_path: Path, frame: Frame) -> None:
    with rig(tmp_path, read_only=True, configured=True) as it:
        it.network.advance(20 * MS)
        it.network.send(it.network.attach(), frame)
        with pytest.raises(PlantFault, match=f"somebody else sends {frame.cob_id:03X}h"):
            it.link.open()
        it.link.close()
        it.network.advance(it.network.now_ns + MS)
        said = [one for one in sent(it.network) if one != frame]
        assert all(may_read(one.cob_id, one.data) for one in said)
        ChannelLock("rig", tmp_path).acquire()


def test_a_master_that_comes_later_is_not_disturbed(tmp_path: Path) -> None:
    with rig(tmp_path, read_only=True, configured=True) as it:
        it.link.start()
        observe(it.link, 10)
        it.network.send(it.network.attach(), Frame(0x201, bytes(6)))
        with pytest.raises(PlantFault, match="somebody else sends 201h"):
            observe(it.link, 5)
        it.link.close()
        it.network.advance(it.network.now_ns + MS)
        orders = [frame for frame in sent(it.network) if frame.cob_id == 0x000]
        assert [order.data[0] for order in orders] == [NmtCommand.START] * 2


def test_a_master_that_came_after_the_last_look_is_not_disturbed(tmp_path: Path) -> None:
    with rig(tmp_path, read_only=True, configured=True) as it:
        it.link.start()
        observe(it.link, 10)
        it.network.send(it.network.attach(), Frame(0x080))
        it.network.advance(it.network.now_ns + MS)
        it.link.close()
        it.network.advance(it.network.now_ns + MS)
        orders = [frame for frame in sent(it.network) if frame.cob_id == 0x000]
        assert [order.data[0] for order in orders] == [NmtCommand.START] * 2


@pytest.mark.parametrize("started", [False, True])
def test_a_link_that_is_closed_says_nothing_more(tmp_path: Path, started: bool) -> None:
    with rig(tmp_path, read_only=True, configured=True) as it:
        it.link.open()
        if started:
            it.link.start()
        it.link.close()
        it.network.advance(it.network.now_ns + MS)
        before = len(sent(it.network))
        it.link.close()
        it.network.advance(it.network.now_ns + MS)
        assert len(sent(it.network)) == before


def test_a_master_of_this_computer_that_sends_no_sync_yet_is_waited_for(tmp_path: Path) -> None:
    with rig(tmp_path, read_only=True, configured=True) as it:
        first = ChannelLock("rig", tmp_path)
        first.acquire()
        with pytest.raises(BusError, match="already has a master"):
            it.link.open()
        first.release()
        assert sent(it.network) == []


@pytest.mark.parametrize(
    ("frame", "reading", "pacing"),
    [
        (Frame(0x601, bytes.fromhex("4041600000000000")), True, True),  # upload
        (Frame(0x601, bytes.fromhex("6000000000000000")), True, True),  # its next segment
        (Frame(0x601, bytes.fromhex("8041600000000405")), True, True),  # abort
        (Frame(0x601, bytes.fromhex("2B40600006000000")), False, False),  # download
        (Frame(0x601, bytes.fromhex("0000000000000000")), False, False),  # its next segment
        (Frame(0x601), False, False),
        (Frame(0x201, bytes(6)), False, False),
        (Frame(0x080), False, True),
        (Frame(0x77E, b"\x05"), False, True),
        (Frame(0x701, b"\x05"), False, False),
        (Frame(0x000, b"\x01\x01"), False, True),
        (Frame(0x000, b"\x80\x01"), False, True),
        (Frame(0x000, b"\x81\x01"), False, False),  # reset
        (Frame(0x000, b"\x02\x01"), False, False),
    ],
)
def test_what_may_go_out(frame: Frame, reading: bool, pacing: bool) -> None:
    assert may_read(frame.cob_id, frame.data) is reading
    assert may_pace(MASTER)(frame.cob_id, frame.data) is pacing


def test_nothing_else_gets_past_the_port(tmp_path: Path) -> None:
    with rig(tmp_path, read_only=True, configured=True) as it:
        it.link.open()
        for cob_id, data in ((0x201, bytes(6)), (0x601, bytes.fromhex("2B40600006000000"))):
            with pytest.raises(DriveError, match=f"read-only: {cob_id:03X}#.* is not sent"):
                it.link._port.send(cob_id, data)
        with pytest.raises(DriveError, match="is not sent"):
            it.link.bring_up.configure(it.config.nodes[0])


def test_jitter_is_not_measured_on_the_sync_of_another(tmp_path: Path) -> None:
    with beside(tmp_path) as (_, it):
        session = Session(it.bus, it.config, lock=ChannelLock("rig", tmp_path))
        with pytest.raises(PlantFault, match=r"somebody else sends 000h \(NMT order\)"):
            measure(session, STIFFNESS, 10)
