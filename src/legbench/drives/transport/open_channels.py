"""All channels of a bus file, locked and opened as one bus."""

import can

from legbench.drives.errors import BusError
from legbench.drives.setup.config import BusConfig
from legbench.drives.transport.lock import ChannelLock
from legbench.drives.transport.open_bus import Adapter, adapter_of, open_bus
from legbench.drives.transport.split_bus import SplitBus


def adapters_of(
    config: BusConfig, *, interface: str | None = None, channel: str | None = None
) -> tuple[Adapter, ...]:
    """Choose the adapter of every channel, by flags, then bus file; opens nothing.

    Args:
        config: the bus file.
        interface: name of the interface, instead of the bus file's.
        channel: names of the channels instead of the bus file's, commas between them.

    Raises:
        BusError: nobody says which interface, or not one channel is given for each of the file's.
    """
    if len(config.channels) == 1:
        return (adapter_of(config, interface=interface, channel=channel or config.channels[0]),)
    names = config.channels if channel is None else tuple(channel.split(","))
    if len(set(names)) != len(config.channels) or None in names:
        raise BusError(
            f"drives hang on {len(config.channels)} channels, {channel or 'the bus file'} names "
            f"{len(set(names))}: give each drive its own, or --channel can0,can1"
        )
    return tuple(adapter_of(config, interface=interface, channel=name) for name in names)


def open_channels(
    config: BusConfig, adapters: tuple[Adapter, ...], *, leads: bool
) -> tuple[can.BusABC, ChannelLock]:
    """Open the adapters of a bus file; whoever leads, or shares none of them, holds their lock.

    A channel is locked before its adapter is touched: opening a serial one resets it under a
    program that uses it. Whoever only reads locks no channel that others may share.

    Args:
        config: the bus, at the bitrate that is asked for.
        adapters: one a channel, in the order of `config.channels`.
        leads: drives are led, or written.

    Raises:
        BusError: an interface is not there, is down, or has a master; none is left open.
    """
    locks = [ChannelLock.of_channel(one.interface, one.channel) for one in adapters]
    lock = ChannelLock.joined(locks)
    if leads or not all(one.shared for one in adapters):
        lock.acquire()
    opened: list[can.BusABC] = []
    try:
        for adapter in adapters:
            opened.append(open_bus(config, adapter))
        return (opened[0] if len(opened) == 1 else SplitBus(opened, config)), lock
    except BaseException:
        for bus in opened:
            bus.shutdown()
        lock.release()
        raise
