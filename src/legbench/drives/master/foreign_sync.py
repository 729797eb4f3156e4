"""The wait for the SYNC of another master."""

from collections.abc import Callable

import can

from legbench.drives.master.port import Port
from legbench.drives.protocol.frame import SYNC_ID


def await_sync(port: Port, until_ns: int, other: Callable[[can.Message], object]) -> int | None:
    """Time at which the SYNC of another master came [ns]; none if it has not by `until_ns`.

    Args:
        port: port of the bus.
        until_ns: latest time, on the time base of the port [ns].
        other: called with every other frame that comes first.

    Raises:
        BusError: the bus has failed.
    """
    now_ns = port.timebase.now_ns
    while now_ns() < until_ns:
        message = port.receive(until_ns)
        if message is None:
            break
        if message.arbitration_id == SYNC_ID and not message.is_error_frame:
            return now_ns()
        other(message)
    return None
