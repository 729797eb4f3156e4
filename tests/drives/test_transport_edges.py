"""Channels, adapters and messages at their edges; nothing leaves this process."""

import hashlib
import socket
import sys
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import can
import pytest
from drives_rig import config

from legbench.drives.emulated.build import emulate
from legbench.drives.emulated.bus import LockstepBus
from legbench.drives.errors import BusError
from legbench.drives.protocol.frame import Frame
from legbench.drives.transport import open_bus as module
from legbench.drives.transport import open_channels as channels_module
from legbench.drives.transport.lock import ChannelLock
from legbench.drives.transport.messages import frame_of, message_of
from legbench.drives.transport.open_bus import Adapter, adapter_of, listening_ns, open_bus
from legbench.drives.transport.open_channels import open_channels
from legbench.drives.transport.timebase import SystemTime

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="as Linux has them")


# --- locks -----------------------------------------------------------------------------------


def test_an_address_has_107_bytes_and_a_longer_name_ends_with_its_digest() -> None:
    # unix(7): sun_path has 108 bytes, of which the first of an abstract address is zero.
    fits, longer = "x" * (107 - len("legbench ")), "x" * (108 - len("legbench "))
    assert ChannelLock(fits).address == b"\0legbench " + fits.encode()
    digest = hashlib.sha256(f"legbench {longer}".encode()).hexdigest().encode()
    address = ChannelLock(longer).address
    assert len(address) == 108
    assert address == (b"\0legbench " + longer.encode())[: 108 - 64] + digest


def test_joined_locks_are_all_taken_or_none() -> None:
    def private(count: int) -> list[ChannelLock]:
        return [ChannelLock.private(str(place)) for place in range(count)]

    locks = private(4)
    joined = ChannelLock.joined(locks)
    joined.acquire()
    assert [lock.held for lock in locks] == [True] * 4
    joined.release()
    assert [lock.held for lock in locks] == [False] * 4

    def refuse() -> None:
        raise BusError("it has a master")

    taken = private(3)
    last = cast(ChannelLock, SimpleNamespace(acquire=refuse))
    with pytest.raises(BusError, match="it has a master"):
        ChannelLock.joined([*taken, last]).acquire()
    assert [lock.held for lock in taken] == [False] * 3


def test_a_holder_that_is_asked_too_often_is_not_waited_for(tmp_path: Path) -> None:
    lock = ChannelLock("asked", tmp_path)
    clients: list[socket.socket] = []
    with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as holder:
        holder.bind(lock.address)
        holder.listen(0)
        try:
            for _ in range(2):
                clients.append(socket.socket(socket.AF_UNIX, socket.SOCK_STREAM))
                clients[-1].setblocking(False)
                clients[-1].connect_ex(lock.address)
            with pytest.raises(BusError, match="already has a master, process unknown;"):
                lock.acquire()
        finally:
            for client in clients:
                client.close()


# --- adapters --------------------------------------------------------------------------------


def test_an_adapter_that_is_named_in_full_asks_nobody(monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[dict[str, Any]] = []

    def load_config(*, config: dict[str, Any]) -> dict[str, Any]:
        asked.append(config)
        return {"interface": "told", "channel": "where"} | config

    monkeypatch.setattr(module, "load_config", load_config)
    bus = config(interface="virtual", channel="leg")
    assert adapter_of(bus) == Adapter(interface="virtual", channel="leg")
    assert adapter_of(bus, interface="other") == Adapter(interface="other", channel="leg")
    assert asked == []
    found = adapter_of(config(interface=None, channel="leg"))
    assert found == Adapter(interface="told", channel="leg")
    found = adapter_of(config(interface="virtual", channel=None))
    assert found == Adapter(interface="virtual", channel="where")
    assert asked == [{"channel": "leg"}, {"interface": "virtual"}]


def test_only_socketcan_is_asked_for_the_state_of_its_interface(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    asked: list[str] = []
    monkeypatch.setattr(module, "check_interface", lambda _, channel: asked.append(channel))
    monkeypatch.setattr(can, "Bus", lambda **given: given)
    for interface, channel in (("virtual", "a"), ("socketcan", "can7"), ("socketcan", None)):
        given = cast(Any, open_bus(config(), Adapter(interface=interface, channel=channel)))
        assert given["bitrate"] == 1_000_000
        assert ("channel" in given) is (channel is not None)
    assert asked == ["can7"]


def test_an_emulated_bus_without_others_is_not_listened_to_and_any_other_for_600_ms() -> None:
    network = emulate(config())
    with LockstepBus("leg", network=network) as alone:
        assert listening_ns(alone) == 0
        with LockstepBus("leg", network=network) as beside:
            assert listening_ns(alone) == listening_ns(beside) == 600_000_000
    with can.Bus(interface="virtual", channel="edges") as real:
        assert listening_ns(real) == 600_000_000
        clock = module.timebase_of(real)
        assert isinstance(clock, SystemTime)
        # It sleeps to the end, and spins for nothing.
        assert clock._spin_ns == 0


def test_channels_that_were_opened_are_shut_when_a_later_one_cannot_be(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    shut: list[str] = []

    def opened(_: object, adapter: Adapter) -> Any:
        if adapter.channel == "c":
            raise BusError("cannot open c")
        return SimpleNamespace(shutdown=lambda: shut.append(str(adapter.channel)))

    monkeypatch.setattr(channels_module, "open_bus", opened)
    adapters = tuple(Adapter(interface="virtual", channel=name) for name in "abc")
    with pytest.raises(BusError, match="cannot open c"):
        open_channels(config(), adapters, leads=False)
    assert shut == ["a", "b"]


# --- messages --------------------------------------------------------------------------------


def test_a_message_is_of_another_node_unless_it_is_said_to_be_ones_own() -> None:
    assert message_of(Frame(0x181, b"\1"), 0.5, "leg").is_rx is True
    assert message_of(Frame(0x181, b"\1"), 0.5, "leg", own=True).is_rx is False


def test_eight_bytes_of_data_are_not_too_many_but_may_have_another_dlc() -> None:
    for count, told in ((8, "8 bytes of data, but a DLC of 5"), (9, "a frame has at most 8")):
        odd = can.Message(arbitration_id=0x123, data=bytes(count), is_extended_id=False)
        odd.dlc = 5
        with pytest.raises(can.CanOperationError, match=told):
            frame_of(odd)
