"""Service of drives beside another master, and under signals."""

import re
import signal
from collections.abc import Iterator

import can
import pytest
from service_rig import BENCH, MS, alone, opened, states, written

from legbench.commissioning.node_id import set_node_id
from legbench.commissioning.reset import reset
from legbench.commissioning.store import store
from legbench.drives.emulated.bus import LockstepBus
from legbench.drives.emulated.drive import UNDER_VOLTAGE, EmulatedDrive
from legbench.drives.emulated.network import Network
from legbench.drives.master.session import Session
from legbench.drives.protocol.cia402 import POWERED
from legbench.drives.protocol.frame import Frame
from legbench.errors import PlantFault
from legbench.interrupts import stop_on_interrupt


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


@pytest.mark.parametrize("action", ["reset", "store", "node-id"])
def test_all_listen_before_they_act(action: str, talkative: tuple[Session, Network]) -> None:
    session, network = talkative
    with session, pytest.raises(PlantFault, match="heartbeat of master 126") as caught:
        ACTIONS[action](session)
    assert re.search("nothing has been sent", str(caught.value))
    assert not [frame for _, frame in network.log or [] if 0x600 < frame.cob_id < 0x680]


ACTIONS = {
    "reset": lambda session: reset(session, session.config.nodes),
    "store": lambda session: store(session, session.config.nodes),
    "node-id": lambda session: set_node_id(session, 42),
}


def interrupted_at(count: int, action: str, monkeypatch: pytest.MonkeyPatch) -> Network | None:
    """Interrupt an action at one of the frames that it sends; None if it has sent fewer."""
    if action == "node-id":
        session, network = alone(BENCH.nodes[0])
    else:
        session, network = opened()
        network.drives[0].trip(UNDER_VOLTAGE, network.now_ns)
        network.drives[0].clear_trip(UNDER_VOLTAGE)
    real, sent = LockstepBus.send, 0

    def send(self: LockstepBus, msg: can.Message, timeout: float | None = None) -> None:
        nonlocal sent
        real(self, msg, timeout)
        # The long search for nodes that are not there is one place like another.
        sent += msg.arbitration_id < 0x604 or msg.arbitration_id > 0x67F
        if sent == count + 1:
            sent += 1
            signal.raise_signal(signal.SIGINT)

    with monkeypatch.context() as patch:
        patch.setattr(LockstepBus, "send", send)
        try:
            with stop_on_interrupt(raises=True), session:
                ACTIONS[action](session)
        except KeyboardInterrupt:
            return network
    return None


@pytest.mark.parametrize("action", ACTIONS)
def test_an_interrupted_service_leaves_no_power_and_no_drive_in_configuration(
    action: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    places = 0
    while (network := interrupted_at(places, action, monkeypatch)) is not None:
        assert not set(states(network)) & set(POWERED), places
        assert [drive._lss.mode for drive in network.drives] == [0] * len(network.drives), places
        places += 1
    assert places > 20


@pytest.mark.parametrize("action", ["reset", "store", "node-id"])
def test_another_lss_master_is_heard(action: str) -> None:
    session, network = opened()
    other = network.attach()
    with session:
        network.send(other, Frame(0x7E5, b"\x04\x01".ljust(8, b"\0")))
        with pytest.raises(PlantFault, match=r"7E5h \(LSS request\)"):
            ACTIONS[action](session)
    assert written(network) == []
