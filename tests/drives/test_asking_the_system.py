"""What the operating system is asked for, told here by an operating system of our own."""

import ctypes
import os
import sys
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import can
import pytest
from drives_rig import config

from legbench.drives.errors import BusError
from legbench.drives.transport import open_bus as open_bus_module
from legbench.drives.transport import open_channels as open_channels_module
from legbench.drives.transport import realtime
from legbench.drives.transport.messages import frame_of, message_of
from legbench.drives.transport.open_bus import Adapter
from legbench.drives.transport.open_channels import adapters_of, open_channels

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="as Linux has them")
DENIED = OSError(1, "Operation not permitted")


class System:
    """Scheduler, memory and collector of a process; each call and what it was given."""

    def __init__(
        self,
        monkeypatch: pytest.MonkeyPatch,
        *,
        fifo: bool = True,
        memory: tuple[int, ...] = (0, 0),
        cpus: int = 4,
        pins: bool = True,
    ) -> None:
        self.asked: list[tuple[Any, ...]] = []
        results = list(memory)

        def schedule(pid: int, policy: int, parameter: os.sched_param) -> None:
            self.asked.append(("schedule", pid, policy, parameter.sched_priority))
            if not fifo:
                raise DENIED

        def pin(pid: int, chosen: set[int]) -> None:
            self.asked.append(("pin", pid, chosen))
            if not pins:
                raise DENIED

        def processors(pid: int) -> set[int]:
            assert pid == 0
            return set(range(cpus))

        def lock(flags: int) -> int:
            self.asked.append(("lock", flags))
            return results.pop(0)

        def library(name: str | None, *, use_errno: bool) -> SimpleNamespace:
            assert use_errno
            return SimpleNamespace(mlockall=lock)

        monkeypatch.setattr(os, "sched_setscheduler", schedule)
        monkeypatch.setattr(os, "sched_setaffinity", pin)
        monkeypatch.setattr(os, "sched_getaffinity", processors)
        monkeypatch.setattr(ctypes, "CDLL", library)
        monkeypatch.setattr(ctypes, "get_errno", lambda: 12)
        for name in ("collect", "freeze", "disable"):
            monkeypatch.setattr(realtime.gc, name, lambda name=name: self.asked.append((name,)))


FIFO = ("schedule", 0, os.SCHED_FIFO | os.SCHED_RESET_ON_FORK, 80)
COLLECTED = [("collect",), ("freeze",), ("disable",)]
# mlockall(2): MCL_CURRENT is 1, MCL_FUTURE 2, MCL_ONFAULT 4.
LOCKED = [("lock", 1), ("lock", 1 | 2 | 4)]


def test_a_system_that_grants_all_is_asked_in_order(monkeypatch: pytest.MonkeyPatch) -> None:
    it = System(monkeypatch)
    granted = realtime.ask(2)
    assert it.asked == [FIFO, *COLLECTED, *LOCKED, ("pin", 0, {2})]
    assert (granted.fifo, granted.mlockall) == ("priority 80", "granted")
    assert (granted.affinity, granted.spin_us) == ("processor 2 of 4", 100)
    assert granted.kernel == os.uname().release
    System(monkeypatch)
    assert realtime.ask(priority=50).fifo == "priority 50"


@pytest.mark.parametrize(("cpus", "fifo", "spin_us"), [(1, True, 0), (2, True, 100), (2, False, 0)])
def test_a_process_spins_where_it_has_priority_and_another_processor(
    cpus: int, fifo: bool, spin_us: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    System(monkeypatch, cpus=cpus, fifo=fifo)
    granted = realtime.ask()
    assert granted.spin_us == spin_us
    assert granted.affinity == f"not asked for, {cpus} processors"


def test_what_is_refused_is_told_with_the_way_out(monkeypatch: pytest.MonkeyPatch) -> None:
    for memory, calls in (((-1, 0), LOCKED[:1]), ((0, -1), LOCKED)):
        it = System(monkeypatch, fifo=False, memory=memory, pins=False)
        granted = realtime.ask(7)
        assert [call for call in it.asked if call[0] == "lock"] == calls
        assert granted.fifo == "refused (Operation not permitted); see hardware/limits.conf"
        assert granted.mlockall == "refused (Cannot allocate memory); see hardware/limits.conf"
        assert granted.affinity == "refused (Operation not permitted); there are 0, 1, 2, 3"


@pytest.mark.parametrize(
    ("version", "there", "said"),
    [
        ("#1 SMP PREEMPT_DYNAMIC Debian", False, "PREEMPT_DYNAMIC"),
        ("#1 SMP Debian", False, "voluntary or none"),
        ("#1 SMP PREEMPT_DYNAMIC Debian", True, "PREEMPT_RT"),
    ],
)
def test_the_preemption_of_the_kernel_is_told(
    version: str, there: bool, said: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    System(monkeypatch)
    monkeypatch.setattr(realtime.platform, "version", lambda: version)
    monkeypatch.setattr(Path, "exists", lambda path: there)
    assert realtime.ask().preemption == said


# --- messages --------------------------------------------------------------------------------


def test_a_message_is_a_frame_of_at_most_eight_bytes_and_eleven_or_29_bits() -> None:
    for size in range(9):
        data = bytes(range(size))
        frame = frame_of(can.Message(arbitration_id=0x7FF, data=data, is_extended_id=False))
        assert (frame.cob_id, frame.data, frame.length, frame.dlc) == (0x7FF, data, size, 0)
        asks = can.Message(
            arbitration_id=0x1FFFFFFF, dlc=size, is_remote_frame=True, is_extended_id=True
        )
        remote = frame_of(asks)
        assert (remote.cob_id, remote.dlc, remote.data, remote.extended) == (
            0x1FFFFFFF,
            size,
            b"",
            True,
        )
        back = message_of(remote, 1.5, "can0", own=True)
        assert (back.dlc, back.is_rx, back.timestamp) == (size, False, 1.5)


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"arbitration_id": 0x800, "is_extended_id": False}, "800h does not fit into 11 bits"),
        ({"arbitration_id": 1 << 29, "is_extended_id": True}, "20000000h does not fit into 29"),
        ({"data": bytes(9), "dlc": 9}, "9 bytes of data; a frame has at most 8"),
        ({"dlc": 9, "is_remote_frame": True}, "asks for 9 bytes; at most 8 can be"),
        ({"data": bytes(3), "dlc": 4}, "3 bytes of data, but a DLC of 4"),
        ({"is_error_frame": True}, "controllers flag errors by themselves"),
        ({"is_fd": True}, "these buses are classic CAN"),
    ],
)
def test_what_is_no_frame_of_classic_can_is_not_sent(changes: dict[str, Any], said: str) -> None:
    given: dict[str, Any] = {"arbitration_id": 5, "is_extended_id": False, **changes}
    message = can.Message(**given)
    with pytest.raises(can.CanOperationError, match=said):
        frame_of(message)


# --- channels --------------------------------------------------------------------------------


class Opened:
    """A bus, or a lock, that notes what is done with it."""

    def __init__(self, name: str, log: list[str]) -> None:
        self.name, self._log = name, log

    def shutdown(self) -> None:
        self._log.append(f"shut {self.name}")

    def acquire(self) -> None:
        self._log.append("acquire")

    def release(self) -> None:
        self._log.append("release")


def opening(monkeypatch: pytest.MonkeyPatch, fails: str = "") -> list[str]:
    log: list[str] = []

    def open_one(_config: object, adapter: Adapter) -> Opened:
        log.append(f"open {adapter.channel}")
        if adapter.channel == fails:
            raise BusError(f"no {fails}")
        return Opened(str(adapter.channel), log)

    def lock_of(_interface: object, channel: object) -> object:
        return channel

    locks = SimpleNamespace(of_channel=lock_of, joined=lambda names: Opened(str(names), log))
    monkeypatch.setattr(open_channels_module, "open_bus", open_one)
    monkeypatch.setattr(open_channels_module, "ChannelLock", locks)
    monkeypatch.setattr(open_channels_module, "SplitBus", lambda buses, config: tuple(buses))
    return log


CAN0 = Adapter(interface="socketcan", channel="can0")
CAN1 = Adapter(interface="socketcan", channel="can1")
LINE = Adapter(interface="slcan", channel="ttyACM0")


@pytest.mark.parametrize(
    ("adapters", "leads", "locks"),
    [
        ((CAN0,), True, True),
        ((CAN0,), False, False),
        ((LINE,), False, True),
        ((CAN0, CAN1), False, False),
        ((CAN0, LINE), False, True),
        ((LINE, CAN0), False, True),
    ],
)
def test_a_channel_that_is_led_or_serves_one_program_is_locked_before_it_is_opened(
    adapters: tuple[Adapter, ...], leads: bool, locks: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    log = opening(monkeypatch)
    bus, lock = open_channels(config(), adapters, leads=leads)
    opened = [f"open {one.channel}" for one in adapters]
    assert log == [*(["acquire"] if locks else []), *opened]
    found: Any = bus
    names = [one.name for one in (found if isinstance(found, tuple) else (found,))]
    assert names == [one.channel for one in adapters]
    assert isinstance(found, tuple) is (len(adapters) > 1)
    assert lock is not None


def test_where_one_channel_fails_none_is_left_open(monkeypatch: pytest.MonkeyPatch) -> None:
    log = opening(monkeypatch, fails="can1")
    with pytest.raises(BusError, match="no can1"):
        open_channels(config(), (CAN0, CAN1), leads=True)
    assert log == ["acquire", "open can0", "open can1", "shut can0", "release"]


def test_the_only_channel_is_that_of_the_flag_or_of_the_drives() -> None:
    bus = config(interface="socketcan", channel="can5")
    assert adapters_of(bus) == (Adapter(interface="socketcan", channel="can5"),)
    assert adapters_of(bus, channel="can6") == (Adapter(interface="socketcan", channel="can6"),)


@pytest.mark.parametrize(
    ("channel", "given", "wanted"),
    [
        ("/dev/pts/7", {}, 0.0),
        ("/dev/pts/7", {"sleep_after_open": 2.0}, 2.0),
        ("/dev/tty", {}, None),
    ],
)
def test_a_terminal_of_a_program_needs_no_time_to_boot(
    monkeypatch: pytest.MonkeyPatch, channel: str, given: dict[str, Any], wanted: float | None
) -> None:
    opened: list[dict[str, Any]] = []
    module = SimpleNamespace(SlcanBus=lambda **options: opened.append(options))
    monkeypatch.setattr(open_bus_module, "import_module", lambda _name: module)
    monkeypatch.setattr(
        open_bus_module, "load_config", lambda config: {"interface": "slcan", **config, **given}
    )
    monkeypatch.setattr(open_bus_module.os.path, "realpath", lambda path: path)
    open_bus_module._slcan({"channel": channel})
    (options,) = opened
    assert options.pop("sleep_after_open", None) == wanted
    assert options == {"channel": channel}
