"""reset, store, node-id and scan: what they do to drives, and what they refuse."""

import dataclasses
import re
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

import pytest
from can_rig import BUS

from legbench.commissioning import node_id as node_id_module
from legbench.commissioning.home import home
from legbench.commissioning.node_id import NodeIdChange, set_node_id
from legbench.commissioning.reset import reset
from legbench.commissioning.scan import scan
from legbench.commissioning.status import status
from legbench.commissioning.store import store
from legbench.commissioning.zero import measure
from legbench.drives.emulated.behaviour import Behaviour
from legbench.drives.emulated.build import emulate, on_bench
from legbench.drives.emulated.bus import LockstepBus
from legbench.drives.emulated.drive import OVER_TEMPERATURE, UNDER_VOLTAGE, EmulatedDrive
from legbench.drives.emulated.network import Network
from legbench.drives.errors import DriveError, NoAnswerError
from legbench.drives.master.session import Session
from legbench.drives.protocol.cia402 import POWERED, DriveState
from legbench.drives.protocol.datatypes import DataType
from legbench.drives.protocol.frame import Frame
from legbench.drives.protocol.pdo import Mapped
from legbench.drives.protocol.sdo import Abort
from legbench.drives.setup.bus_file import load_bus, load_limits
from legbench.drives.setup.config import BusConfig, NodeConfig
from legbench.drives.setup.homed import HomedCondition
from legbench.errors import ConfigError, PlantFault

MS = 1_000_000
FAULT, SOD = DriveState.FAULT, DriveState.SWITCH_ON_DISABLED
HOMED = HomedCondition(object=Mapped(0x6041, 0, DataType.UNSIGNED16), mask=0x8000)
BENCH = load_bus(BUS)


def serial(node: NodeConfig, number: int, **changes: object) -> NodeConfig:
    identity = dataclasses.replace(node.identity, serial=number)
    return dataclasses.replace(node, identity=identity, **changes)


def on(network: Network, config: BusConfig = BENCH) -> Session:
    network.advance(20 * MS)
    return Session(LockstepBus("leg", network=network), config)


def opened(config: BusConfig = BENCH) -> tuple[Session, Network]:
    network = emulate(config, [on_bench(node, 0.0) for node in config.nodes], keep_log=True)
    return on(network, config), network


def alone(*nodes: NodeConfig, keep: Sequence[int | None] = ()) -> tuple[Session, Network]:
    """Drives on a bus of the bench's file, whatever their node ids; None is a drive without one."""
    drives = [EmulatedDrive(node, Behaviour(seed=place)) for place, node in enumerate(nodes)]
    network = Network(drives, keep_log=True, body=lambda motors: (motors, [0.0] * len(motors)))
    for drive, kept in zip(drives, keep, strict=False):
        if kept is None:
            network.advance(network.now_ns + 20 * MS)
            for data in ((0x04, 1), (0x11, 255), (0x17,)):
                drive.receive(Frame(0x7E5, bytes(data).ljust(8, b"\0")), network.now_ns)
            drive.take()
            drive.reset(network.now_ns)
    return on(network), network


def written(network: Network) -> list[Frame]:
    """SDO downloads, NMT orders and LSS configurations that were on the wire."""
    frames = [frame for _, frame in network.log or []]
    return [
        frame
        for frame in frames
        if frame.cob_id == 0
        or (0x600 < frame.cob_id < 0x680 and frame.data[0] >> 5 == 1)
        or (frame.cob_id == 0x7E5 and frame.data[0] in (0x11, 0x17))
    ]


def controlwords(network: Network, node: int) -> list[int]:
    return [
        int.from_bytes(frame.data[4:6], "little")
        for frame in written(network)
        if frame.cob_id == 0x600 + node and frame.data[1:4] == b"\x40\x60\x00"
    ]


def states(network: Network) -> list[DriveState]:
    return [drive.axis.power.state for drive in network.drives]


# --- reset -----------------------------------------------------------------------------------


def test_one_rising_edge_resets_a_fault_whose_cause_is_gone() -> None:
    session, network = opened()
    network.drives[0].trip(UNDER_VOLTAGE, network.now_ns)
    network.drives[0].untrip(UNDER_VOLTAGE)
    with session:
        done = reset(session, session.config.nodes)
    assert [(one.node, one.in_fault) for one in done] == [("motor1", False), ("motor2", False)]
    assert done[0].error == "3220h under-voltage"
    assert done[0].before.startswith("0208h: fault")
    assert "switch on disabled" in done[0].after
    assert done[1].error == ""
    assert states(network) == [SOD, SOD]
    # Bit 7 rises once, after it has been low, and falls again; the other drive is told nothing.
    assert controlwords(network, 1) == [0x00, 0x80, 0x00]
    assert controlwords(network, 2) == []


def test_a_fault_whose_cause_is_there_stays_and_is_reset_once_only() -> None:
    session, network = opened()
    network.drives[1].trip(OVER_TEMPERATURE, network.now_ns)
    with session:
        done = reset(session, session.config.nodes)
    assert [one.in_fault for one in done] == [False, True]
    assert done[1].error == "4310h drive over-temperature"
    assert states(network) == [SOD, FAULT]
    assert controlwords(network, 2).count(0x80) == 1


def test_a_fault_that_comes_back_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    session, network = opened()
    drive = network.drives[0]
    drive.trip(UNDER_VOLTAGE, network.now_ns)
    drive.untrip(UNDER_VOLTAGE)
    real = EmulatedDrive.tick
    left: list[int] = []

    def tick(self: EmulatedDrive, now_ns: int) -> float:
        """The drive is well for 50 ms, then finds its supply too low again."""
        if self is drive and self.axis.power.state is SOD:
            left.append(now_ns)
            if now_ns - left[0] > 50 * MS:
                self.trip(UNDER_VOLTAGE, now_ns)
        return real(self, now_ns)

    monkeypatch.setattr(EmulatedDrive, "tick", tick)
    with session:
        done = reset(session, session.config.nodes[:1])
    assert left
    assert done[0].in_fault
    assert controlwords(network, 1) == [0x00, 0x80, 0x00]


def test_a_drive_with_power_is_stopped_before_another_one_is_reset() -> None:
    session, network = opened()
    network.drives[0].trip(UNDER_VOLTAGE, network.now_ns)
    network.drives[0].untrip(UNDER_VOLTAGE)
    network.drives[1].axis.power.state = DriveState.OPERATION_ENABLED
    with session:
        reset(session, session.config.nodes)
    assert states(network) == [SOD, SOD]


# --- store -----------------------------------------------------------------------------------


def test_what_the_drives_hold_outlasts_their_power() -> None:
    session, network = opened()
    with session:
        for node in session.config.nodes:
            session.bring_up().configure(node)
        done = store(session, session.config.nodes)
        assert [(one.node, one.part, one.by_itself) for one in done] == [
            ("motor1", 1, False),
            ("motor2", 1, False),
        ]
        for drive in network.drives:
            drive.reset(network.now_ns)
        network.advance(network.now_ns + 20 * MS)
        # All but the command frames, which are stored switched off.
        for node in session.config.nodes:
            left = session.bring_up().differences(node)
            assert [(one.key, there) for one, there in left] == [
                ((0x1400, 1), 1 << 31 | 0x200 + node.node_id)
            ]
    # The signature is "save", once a drive.
    saves = [frame for frame in written(network) if frame.data[1:4] == b"\x10\x10\x01"]
    assert [frame.data[4:] for frame in saves] == [b"save", b"save"]


@pytest.mark.parametrize("place", [0, 1])
def test_nothing_is_stored_while_any_drive_has_power(place: int) -> None:
    session, network = opened()
    network.drives[place].axis.power.state = DriveState.OPERATION_ENABLED
    name = BENCH.nodes[place].name
    with session, pytest.raises(DriveError, match=f"'{name}' .* has power.*nothing has been"):
        store(session, session.config.nodes[:1])
    assert written(network) == []


def test_a_drive_that_refuses_or_has_no_memory_is_named_with_those_before_it() -> None:
    session, network = opened()
    del network.drives[1]._store._entries[0x1010, 1]
    with session, pytest.raises(DriveError, match=r"'motor2' .*cannot store part 1") as caught:
        store(session, session.config.nodes)
    assert caught.value.__notes__ == ["stored before that: motor1"]
    session, network = opened()
    network.drives[0]._values[0x1010, 1] = 2
    with (
        session,
        pytest.raises(DriveError, match=r"stores nothing on command: 1010h:01 reads 0000"),
    ):
        store(session, session.config.nodes)
    assert not [frame for frame in written(network) if frame.data[1:3] == b"\x10\x10"]


def test_nothing_is_stored_where_command_frames_stay_on() -> None:
    session, network = opened()
    drive = network.drives[0]
    with session:
        session.bring_up().configure(session.config.nodes[0])
        drive._pdos.check = lambda key, value: Abort.DEVICE_STATE if key == (0x1400, 1) else None
        with pytest.raises(DriveError, match=r"'motor1' .* is not parked.*nothing has been stored"):
            store(session, session.config.nodes)
    assert not [frame for frame in written(network) if frame.data[1:3] == b"\x10\x10"]


def test_a_drive_that_never_answers_to_the_signature_is_told_as_unknown() -> None:
    session, network = opened()
    drive = network.drives[0]
    real = drive.receive

    def receive(frame: Frame, now_ns: int) -> None:
        if frame.data[1:3] != b"\x10\x10" or frame.data[0] >> 5 != 1:
            real(frame, now_ns)

    drive.receive = receive  # pyright: ignore[reportAttributeAccessIssue]
    with session, pytest.raises(NoAnswerError, match=r"within 3 s, so whether it has stored"):
        store(session, session.config.nodes, timeout=3.0)
    assert len([frame for frame in written(network) if frame.data[1:3] == b"\x10\x10"]) == 1


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"part": 0}, "part is 0; it must be 1 to 127"),
        ({"part": 128}, "part is 128"),
        ({"timeout": 0.0}, "timeout is 0 s; it must be positive, 60 s at most"),
        ({"timeout": 61.0}, "timeout is 61 s"),
    ],
)
def test_settings_of_store_have_two_ends(changes: dict[str, float], words: str) -> None:
    session, network = opened()
    with session, pytest.raises(ConfigError, match=words):
        store(session, session.config.nodes, **changes)  # pyright: ignore[reportArgumentType]
    assert written(network) == []


# --- node-id ---------------------------------------------------------------------------------


def test_the_only_drive_gets_another_node_id_for_good() -> None:
    session, network = alone(serial(BENCH.nodes[0], 0x80000001))
    with session:
        done = set_node_id(session, 42)
        assert done == NodeIdChange(
            before=1,
            after=42,
            vendor=0x123,
            product=0x402,
            revision=0,
            serial=0x80000001,
            stored=True,
        )
        network.drives[0].reset(network.now_ns)
        network.advance(network.now_ns + 20 * MS)
        assert [found.node_id for found in scan(session, 50)] == [42]
    assert network.drives[0]._lss.mode == 0


def test_a_drive_without_node_id_is_found_and_gets_its_first() -> None:
    session, network = alone(serial(BENCH.nodes[0], 0xA5A5_0F01), keep=(None,))
    with session:
        done = set_node_id(session, 3)
    assert (done.before, done.after, done.serial, done.stored) == (None, 3, 0xA5A5_0F01, True)
    assert network.drives[0].node_id == 3


def test_a_node_id_can_be_given_anew() -> None:
    session, network = alone(BENCH.nodes[0])
    with session:
        assert set_node_id(session, 1).after == 1
    assert network.drives[0].node_id == 1


@pytest.mark.parametrize(
    ("nodes", "keep", "words"),
    [
        ((BENCH.nodes[0], BENCH.nodes[1]), (), "nodes 1, 2 answer; .* disconnect the others"),
        ((BENCH.nodes[0], serial(BENCH.nodes[0], 9)), (), "two drives answer as node 1"),
        (
            (BENCH.nodes[0], serial(BENCH.nodes[1], 9)),
            (1, None),
            "node 1 answers, and a drive without node id does, too",
        ),
        (
            (serial(BENCH.nodes[0], 8), serial(BENCH.nodes[1], 9)),
            (None, None),
            "two drives without node id answer",
        ),
    ],
)
def test_no_node_id_is_given_while_two_nodes_answer(
    nodes: tuple[NodeConfig, ...], keep: tuple[int | None, ...], words: str
) -> None:
    session, network = alone(*nodes, keep=keep)
    before = [drive.node_id for drive in network.drives]
    with session, pytest.raises(DriveError, match=words):
        set_node_id(session, 42)
    assert [drive.node_id for drive in network.drives] == before
    assert written(network) == []
    assert [drive._lss.mode for drive in network.drives] == [0] * len(nodes)


def test_no_node_id_is_given_to_a_drive_with_power_or_to_nobody() -> None:
    session, network = alone(BENCH.nodes[0])
    network.drives[0].axis.power.state = DriveState.OPERATION_ENABLED
    with session, pytest.raises(DriveError, match=r"node 1 has power.*nothing has been changed"):
        set_node_id(session, 42)
    assert written(network) == []
    session, network = alone(BENCH.nodes[0])
    network.drives[0]._lss.feed = lambda data: None
    with session, pytest.raises(NoAnswerError, match="no drive answers over LSS"):
        set_node_id(session, 42)
    assert written(network) == []
    session, network = alone(BENCH.nodes[0])
    network.drives[0].receive = lambda frame, now_ns: None
    with session, pytest.raises(NoAnswerError, match="no node answers, with a node id or without"):
        set_node_id(session, 42)


@pytest.mark.parametrize("wanted", [0, 126, 128, 255])
def test_node_ids_that_do_not_exist_or_are_the_masters_are_refused(wanted: int) -> None:
    session, network = alone(BENCH.nodes[0])
    with session, pytest.raises(ConfigError, match=f"node id is {wanted}; it must be 1 to 127"):
        set_node_id(session, wanted)
    assert network.log is not None
    assert not [frame for _, frame in network.log if frame.cob_id == 0x601]


@pytest.mark.parametrize("step", ["configure", "store"])
def test_no_drive_stays_in_configuration_whatever_happens(
    step: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(_self: object, *_arguments: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(node_id_module.LssPort, step, fail)
    session, network = alone(BENCH.nodes[0])
    with session, pytest.raises(KeyboardInterrupt):
        set_node_id(session, 42)
    network.advance(network.now_ns + 5 * MS)
    assert network.drives[0]._lss.mode == 0
    assert network.drives[0].node_id == 1


def test_a_drive_that_does_not_store_says_so() -> None:
    session, network = alone(BENCH.nodes[0])
    slave = network.drives[0]._lss
    real = slave.feed

    def feed(data: bytes) -> bytes | None:
        return b"\x17\x01" + bytes(6) if data[0] == 0x17 else real(data)

    slave.feed = feed
    with session:
        done = set_node_id(session, 42)
    assert (done.after, done.stored) == (42, False)


# --- scan ------------------------------------------------------------------------------------


@pytest.mark.parametrize("seeds", range(4))
def test_two_drives_with_one_node_id_are_noticed(seeds: int) -> None:
    twin = serial(BENCH.nodes[0], 5000 + seeds)
    session, network = alone(BENCH.nodes[0], twin, BENCH.nodes[1])
    with session:
        found = list(scan(session, 5))
    assert [(one.node_id, one.answers) for one in found] == [(1, 2), (2, 1)]
    assert found[0].verdict == "2 drives answer with this node id"
    assert found[1].verdict == "'motor2' of the bus file"
    assert written(network) == []


# --- homed -----------------------------------------------------------------------------------


def homing_bus() -> BusConfig:
    nodes = tuple(dataclasses.replace(node, homed=HOMED) for node in BENCH.nodes)
    return dataclasses.replace(BENCH, nodes=nodes)


def begin_run(session: Session) -> None:
    limits = load_limits(BUS.parent / "limits.toml")
    session.link(limits, (4.0, 5.0)).open()


def begin_zero(session: Session) -> None:
    measure(session, (0.0, 0.0))


@pytest.mark.parametrize("begin", [begin_run, begin_zero])
def test_nothing_begins_before_every_drive_is_homed(begin: Callable[[Session], None]) -> None:
    session, network = opened(homing_bus())
    words = r"'motor1' \(node 1\) is not homed .*`legbench drives home --node motor1`"
    with session, pytest.raises(DriveError, match=words):
        begin(session)
    assert written(network) == []


def test_a_drive_that_has_been_homed_may_run_until_it_is_switched_off() -> None:
    session, network = opened(homing_bus())
    with session:
        assert [one.homed for one in status(session)] == [False, False]
        home(session, session.config.nodes[0], -1)
        assert [one.homed for one in status(session)] == [True, False]
        with pytest.raises(DriveError, match=r"'motor2' \(node 2\) is not homed"):
            begin_zero(session)
        home(session, session.config.nodes[1], 23)
        assert [one.homed for one in status(session)] == [True, True]
        begin_zero(session)
        begin_run(session)
        network.drives[0].reset(network.now_ns)
        network.advance(network.now_ns + 20 * MS)
        assert [one.homed for one in status(session)] == [False, True]
    assert not set(states(network)) & set(POWERED)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ('{ object = "6041:00 u16", mask = 0 }', "mask is 0x0; .* it must be 1 to 0xffff"),
        ('{ object = "6041:00 u16", mask = 0x10000 }', "mask is 0x10000"),
        ('{ object = "6041:00 u16", mask = 1, value = 2 }', "value is 0x2; it must have no bits"),
        ('{ object = "6041:00 u16" }', "mask must be given"),
        ("{ mask = 1 }", "object must be given"),
        ('{ object = "6041", mask = 1 }', "'6041' is no object"),
        ('{ object = "6041:00 u16", mask = 1, bit = 3 }', "unknown keys: bit"),
        ("3", "'homed' must be a table"),
    ],
)
def test_the_condition_is_checked_with_its_place(text: str, words: str, tmp_path: Path) -> None:
    path = tmp_path / "leg.toml"
    path.write_text(
        BUS.read_text("utf-8").replace("soft_limits", f"homed = {text}\nsoft_limits", 1)
    )
    with pytest.raises(ConfigError, match=rf"leg\.toml: node 'motor1' homed.*{words}"):
        load_bus(path)


def test_the_condition_comes_from_the_bus_file(tmp_path: Path) -> None:
    path = tmp_path / "leg.toml"
    homed = 'homed = { object = "2013:02 u8", mask = 0x0C, value = 4 }'
    path.write_text(BUS.read_text("utf-8").replace("soft_limits", f"{homed}\nsoft_limits", 1))
    first, second = load_bus(path).nodes
    assert second.homed is None
    assert first.homed is not None
    assert [value for value in range(16) if first.homed.met(value)] == [4, 5, 6, 7]


# --- who else is on the bus ------------------------------------------------------------------


@pytest.fixture
def talkative() -> Iterator[tuple[Session, Network]]:
    """Another master's heartbeat is on the bus from the beginning."""
    session, network = opened()
    other = network.attach()
    real = EmulatedDrive.tick

    def tick(self: EmulatedDrive, now_ns: int) -> float:
        if self is network.drives[0] and now_ns % (100 * MS) == 0:
            network.send(other, Frame(0x77E, b"\x05"))
        return real(self, now_ns)

    patch = pytest.MonkeyPatch()
    patch.setattr(EmulatedDrive, "tick", tick)
    yield session, network
    patch.undo()


@pytest.mark.parametrize(
    "act",
    [
        lambda session: reset(session, session.config.nodes),
        lambda session: store(session, session.config.nodes),
        lambda session: set_node_id(session, 42),
    ],
    ids=["reset", "store", "node-id"],
)
def test_all_listen_before_they_act(
    act: Callable[[Session], object], talkative: tuple[Session, Network]
) -> None:
    session, network = talkative
    with session, pytest.raises(PlantFault, match="heartbeat of master 126") as caught:
        act(session)
    assert re.search("nothing has been sent", str(caught.value))
    assert not [frame for _, frame in network.log or [] if 0x600 < frame.cob_id < 0x680]
