"""A python-can bus from a bus file and flags, its failures named."""

import os
from dataclasses import dataclass
from importlib import import_module
from typing import Any

import can
from can.util import load_config

from legbench.drives.errors import BusError
from legbench.drives.setup.config import BusConfig
from legbench.drives.transport.interface import check_interface
from legbench.drives.transport.timebase import SystemTime, Timebase
from legbench.drives.transport.virtual_bus import VirtualBus

SLCAN, SOCKETCAN = "slcan", "socketcan"
TERMINALS = "/dev/pts/"
"""Path of the pseudo terminals on Linux."""
SHARED = ("legbench", "legbench_unix", "socketcan", "socketcand", "udp_multicast", "virtual")
"""Interfaces that serve any number of programs; any other adapter serves one."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Adapter:
    """Interface and channel through which a bus is reached."""

    interface: str
    """Name of the interface in python-can."""
    channel: str | None

    @property
    def shared(self) -> bool:
        """Whether a program may listen beside another one."""
        return self.interface in SHARED


def adapter_of(
    config: BusConfig, *, interface: str | None = None, channel: str | None = None
) -> Adapter:
    """Choose the adapter by flags, then bus file, then python-can's configuration; opens nothing.

    Raises:
        BusError: nobody says which interface.
    """
    chosen, where = interface or config.interface, channel or config.channel
    if chosen is None or where is None:
        given = {"interface": chosen, "channel": where}
        try:
            found = load_config(config={key: value for key, value in given.items() if value})
        except (can.CanError, OSError, ImportError, ValueError) as error:
            if chosen is None:
                raise BusError(
                    "no interface is given: name one with --interface, in the bus file, or in "
                    "python-can's own configuration (CAN_INTERFACE, can.conf)"
                ) from error
            raise _named(chosen, where, error) from error
        chosen, where = found["interface"], where or found.get("channel")
    return Adapter(interface=str(chosen), channel=None if where is None else str(where))


def open_bus(config: BusConfig, adapter: Adapter) -> can.BusABC:
    """Open an adapter at the bitrate of a bus; SocketCAN's is set with `ip link`, not here.

    Raises:
        BusError: no such interface or channel, it is down, or runs at another bitrate.
    """
    if adapter.interface == SOCKETCAN and adapter.channel is not None:
        check_interface(config, adapter.channel)
    given: dict[str, Any] = {
        "interface": adapter.interface,
        "channel": adapter.channel,
        "bitrate": config.bitrate,
    }
    given = {key: value for key, value in given.items() if value is not None}
    try:
        return _slcan(given) if adapter.interface == SLCAN else can.Bus(**given)
    except Exception as error:  # Such as a TypeError, where a driver wants more than a channel.
        raise _named(adapter.interface, adapter.channel, error) from error


def _slcan(given: dict[str, object]) -> can.BusABC:
    """Open an slcan adapter; its module is imported late, as python-can warns without pyserial."""
    options: dict[str, Any] = {**load_config(config=given)}
    del options["interface"]
    if os.path.realpath(str(options["channel"])).startswith(TERMINALS):
        # A real adapter needs two seconds to boot after it has been opened.
        options.setdefault("sleep_after_open", 0.0)
    try:
        return import_module("legbench.drives.transport.slcan_bus").SlcanBus(**options)
    except can.CanInterfaceNotImplementedError as error:
        raise BusError(f"slcan: {error}; pip install 'legbench[slcan]'") from None


def _named(interface: str, channel: str | None, error: Exception) -> BusError:
    where = f"{interface} {channel or ''}".strip()
    return BusError(
        f"cannot open {where}: {error}; interfaces are those of python-can, which takes what one "
        "needs besides a channel from its own can.conf; 'legbench' is the emulated leg"
    )


LISTEN_NS = 600_000_000
"""Time that a bus is listened to before anything is sent to drives [ns].

A master that leads a leg sends SYNC and commands every few milliseconds. One that has only started,
or stands still, is given away by its heartbeat: usual periods are 100 to 500 ms, and drives that
are to stop within 100 ms need one of 33 ms. 600 ms hold a whole period of the slowest.
"""


def listening_ns(bus: can.BusABC) -> int:
    """Time to listen for another master; 0 on a virtual bus without other participants [ns]."""
    return 0 if isinstance(bus, VirtualBus) and bus.alone else LISTEN_NS


def timebase_of(bus: can.BusABC, spin_ns: int = 0) -> Timebase:
    """Time base of a bus: virtual time of an emulated bus, the machine's clock for all others."""
    return bus.timebase if isinstance(bus, VirtualBus) else SystemTime(spin_ns)
