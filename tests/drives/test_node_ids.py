"""Node ids over LSS, and two drives with one of them."""

import pytest
from service_rig import BENCH, MS, alone, serial, written

from legbench.commissioning import node_id as node_id_module
from legbench.commissioning.node_id import NodeIdChange, set_node_id
from legbench.commissioning.scan import scan
from legbench.drives.errors import DriveError, NoAnswerError
from legbench.drives.protocol.cia402 import DriveState
from legbench.drives.setup.config import NodeConfig
from legbench.errors import ConfigError


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
