"""canopen's LSS master and its storing of parameters, as an independent peer of emulated drives."""

from collections.abc import Iterator
from types import SimpleNamespace
from typing import Any

import pytest
from drives_rig import MS
from test_drives_canopen import Pump

canopen = pytest.importorskip("canopen")
lss = pytest.importorskip("canopen.lss")


@pytest.fixture
def pump(monkeypatch: pytest.MonkeyPatch) -> Iterator[Pump]:
    made = Pump()
    # Its pauses are real time, which the emulated bus does not need.
    monkeypatch.setattr(lss, "time", SimpleNamespace(sleep=lambda _seconds: None))
    monkeypatch.setattr(lss.LssMaster, "RESPONSE_TIMEOUT", 1e-3)
    yield made
    made.bus.shutdown()


def unconfigured(pump: Pump) -> Any:
    """Take the node id from the first drive, whose address is 1234h, 7, 0, 100."""
    master = pump.network.lss
    assert master.send_switch_state_selective(0x1234, 7, 0, 100)
    master.configure_node_id(255)
    master.store_configuration()
    master.send_switch_state_global(master.WAITING_STATE)
    pump.send(0x000, bytes((129, 1)))
    pump.pass_time(20 * MS)
    return master


def test_it_selects_one_drive_of_two_and_gives_it_a_node_id(pump: Pump) -> None:
    master = pump.network.lss
    assert master.send_switch_state_selective(0x1234, 7, 0, 101)
    assert master.inquire_node_id() == 2
    words = [master.inquire_lss_address(code) for code in (0x5A, 0x5B, 0x5C, 0x5D)]
    assert words == [0x1234, 7, 0, 101]
    master.configure_node_id(77)
    with pytest.raises(lss.LssError):
        master.configure_node_id(200)
    master.store_configuration()
    master.send_switch_state_global(master.WAITING_STATE)
    assert [drive.node_id for drive in pump.emulated.drives] == [1, 2]
    pump.send(0x000, bytes((130, 2)))
    pump.pass_time(20 * MS)
    assert [drive.node_id for drive in pump.emulated.drives] == [1, 77]
    with pytest.raises(lss.LssError):
        master.send_switch_state_selective(0x1234, 7, 0, 102)


def test_its_fast_scan_finds_the_drive_without_node_id(pump: Pump) -> None:
    master = unconfigured(pump)
    found, words = master.fast_scan()
    assert found
    assert words == [0x1234, 7, 0, 100]
    # The scan has brought it into configuration.
    master.configure_node_id(5)
    master.send_switch_state_global(master.WAITING_STATE)
    pump.pass_time(20 * MS)
    assert [drive.node_id for drive in pump.emulated.drives] == [5, 2]
    assert master.fast_scan() == (False, None)


def heard(master: Any) -> list[bytes]:
    """Answers that it has not looked at: it leaves those of an identification to its user."""
    return [master.responses.get_nowait() for _ in range(master.responses.qsize())]


def test_it_identifies_ranges_and_drives_without_node_id(pump: Pump) -> None:
    master = pump.network.lss
    for serials, answers in (((90, 100), 1), ((90, 110), 2), ((0, 99), 0), ((102, 200), 0)):
        master.send_identify_remote_slave(0x1234, 7, 0, 9, *serials)
        assert heard(master) == [b"\x4f" + bytes(7)] * answers
    master.send_identify_non_configured_remote_slave()
    assert heard(master) == []
    unconfigured(pump).send_identify_non_configured_remote_slave()
    assert heard(master) == [b"\x50" + bytes(7)]


def test_it_stores_and_restores_what_a_drive_holds(pump: Pump) -> None:
    dictionary = canopen.ObjectDictionary()
    node = canopen.RemoteNode(1, dictionary)
    pump.network.add_node(node)
    deceleration = (4321).to_bytes(4, "little")
    node.sdo.download(0x6085, 0, deceleration)
    node.store()
    for restored, left in ((False, deceleration), (True, bytes(4))):
        if restored:
            node.restore()
        pump.send(0x000, bytes((129, 1)))
        pump.pass_time(20 * MS)
        assert node.sdo.upload(0x6085, 0) == left
    with pytest.raises(canopen.SdoAbortedError, match="0x08000020"):
        node.sdo.download(0x1010, 1, b"evas")
