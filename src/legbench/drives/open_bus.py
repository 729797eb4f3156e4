"""A python-can bus from a bus file and flags, its failures named."""

import can

from legbench.drives.bus import LockstepBus
from legbench.drives.config import BusConfig
from legbench.drives.errors import BusError
from legbench.drives.timebase import SystemTime, Timebase


def open_bus(
    config: BusConfig,
    *,
    interface: str | None = None,
    channel: str | None = None,
    bitrate: int | None = None,
    **options: object,
) -> can.BusABC:
    """Open an interface; flags go before the bus file, python-can's own configuration fills in.

    Args:
        config: the bus file.
        interface: python-can's name, such as `socketcan`, `slcan` or `legbench`.
        channel: such as `can0`.
        bitrate: [bit/s]; SocketCAN's is set with `ip link`, not here.
        options: of the driver.

    Raises:
        BusError: no such interface or channel, or it is down.
    """
    chosen = interface or config.interface
    where = channel or config.channel
    given = {
        "interface": chosen,
        "channel": where,
        "bitrate": bitrate or config.bitrate,
        **options,
    }
    try:
        return can.Bus(**{key: value for key, value in given.items() if value is not None})  # pyright: ignore[reportArgumentType]
    except (can.CanError, OSError, ImportError, ValueError) as error:
        raise BusError(
            f"cannot open {chosen or 'the default interface'} {where or ''}: {error}; interfaces "
            "are those of python-can, 'legbench' is the emulated leg"
        ) from error


def timebase_of(bus: can.BusABC, spin_ns: int = 0) -> Timebase:
    """Virtual time of an emulated bus, the machine's for all others."""
    return bus.timebase if isinstance(bus, LockstepBus) else SystemTime(spin_ns)
