"""Storing of what drives hold (1010h)."""

from typing import Any

import pytest
from service_rig import BENCH, MS, opened, written

from legbench.commissioning import store as store_module
from legbench.commissioning.store import store
from legbench.drives.errors import DriveError, NoAnswerError
from legbench.drives.master.sdo_port import SdoPort
from legbench.drives.protocol.cia402 import DriveState
from legbench.drives.protocol.frame import Frame
from legbench.drives.protocol.sdo import Abort
from legbench.errors import ConfigError


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
            assert [(one.parameter.key, one.there) for one in left] == [
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

    drive.receive = receive
    with session:
        for timeout in (0.5, 0.125):
            said = rf"within {timeout:g} s, so whether it has stored"
            with pytest.raises(NoAnswerError, match=said):
                store(session, session.config.nodes, timeout=timeout)
            saves = [
                at_ns
                for at_ns, frame in network.log or []
                if frame.cob_id == 0x601 and frame.data[:3] == b"\x23\x10\x10"
            ]
            assert network.now_ns - saves[-1] == pytest.approx(1e9 * timeout, rel=0.01)
    # Written once each time.
    assert len(saves) == 2


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"part": 0}, "part is 0; it must be 1 to 127"),
        ({"part": 128}, "part is 128"),
        ({"timeout": 0.0}, "timeout is 0 s; it must be positive, 60 s at most"),
        ({"timeout": 61.0}, "timeout is 61 s"),
    ],
)
def test_settings_of_store_have_two_ends(changes: dict[str, Any], words: str) -> None:
    session, network = opened()
    with session, pytest.raises(ConfigError, match=words):
        store(session, session.config.nodes, **changes)
    assert written(network) == []


@pytest.mark.parametrize(("part", "parks"), [(1, True), (2, True), (3, False)])
def test_command_frames_are_off_before_a_part_that_holds_them_is_stored(
    part: int, parks: bool
) -> None:
    session, network = opened()
    with session:
        done = store(session, session.config.nodes, part=part)
    assert [(one.node, one.part) for one in done] == [("motor1", part), ("motor2", part)]
    told = [(frame.data[1:4], frame.data[4:]) for frame in written(network)]
    objects = [data for key, data in told if key == bytes((0x10, 0x10, part))]
    assert objects == [b"save", b"save"]
    off = [data for key, data in told if key[:2] == b"\x00\x14" and data[3] >> 7]
    assert bool(off) is parks
    if parks:
        # All that is switched off is switched off before the first drive stores.
        first = told.index((bytes((0x10, 0x10, part)), b"save"))
        assert not [key for key, _ in told[first:] if key[:2] == b"\x00\x14"]


@pytest.mark.parametrize(("settings", "wait_ms"), [({}, 10_000), ({"timeout": 60.0}, 60_000)])
def test_a_drive_that_stores_by_itself_says_so(
    settings: dict[str, Any], wait_ms: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    session, network = opened()
    network.drives[1]._values[0x1010, 1] = 3
    waits: list[int] = []

    def patient(*args: Any, timeout_ms: int, **more: Any) -> SdoPort:
        waits.append(timeout_ms)
        return SdoPort(*args, timeout_ms=timeout_ms, **more)

    monkeypatch.setattr(store_module, "SdoPort", patient)
    with session:
        done = store_module.store(session, session.config.nodes, **settings)
    assert [one.by_itself for one in done] == [False, True]
    assert waits == [wait_ms] * 2


def test_the_last_part_may_be_asked_for() -> None:
    session, _ = opened()
    with session, pytest.raises(DriveError, match="cannot store part 127"):
        store(session, session.config.nodes, part=127)
