"""SYNC and RPDOs as an emulated drive receives them, and their absence (CiA 301, 7.2.2, 7.2.5)."""

from collections.abc import Mapping
from typing import final

from legbench.drives.emulated.axis import SYNC_MISSING, Axis
from legbench.drives.emulated.connection import Connection
from legbench.drives.emulated.process_data import LAST_SYNCHRONOUS, ProcessData
from legbench.drives.protocol.cia402 import DriveState
from legbench.drives.protocol.frame import Frame
from legbench.drives.protocol.objects import Key

PDO_SHORT, PDO_LONG, SYNC_LENGTH, RPDO_LATE = 0x8210, 0x8220, 0x8240, 0x8250


@final
class Reception:
    """What a drive makes of SYNC and of RPDOs while it is operational.

    Attributes:
        fresh: whether a target has been written since the last SYNC.
    """

    def __init__(
        self,
        values: Mapping[Key, int],
        axis: Axis,
        pdos: ProcessData,
        connection: Connection,
        sync_loss_periods: int,
    ) -> None:
        self._values, self._axis, self._pdos = values, axis, pdos
        self._connection, self._periods = connection, sync_loss_periods
        self._sync_ns: int | None = None
        self.fresh = False

    def forget(self) -> None:
        """Discard what has been received, as on leaving operational."""
        self._sync_ns, self.fresh = None, False

    def is_sync(self, data: bytes, now_ns: int) -> bool:
        """Whether a SYNC has the length that 1019h asks for; reports one that has not."""
        if len(data) == (1 if self._values[0x1019, 0] else 0):
            return True
        self._connection.report(SYNC_LENGTH, now_ns)
        return False

    def sync(self, now_ns: int) -> list[Frame]:
        """Latch the commands at SYNC; returns the process data sampled at it."""
        frames = self._pdos.at_sync()
        self._pdos.latch()
        self._axis.sync(self.fresh, now_ns)
        self.fresh, self._sync_ns = False, now_ns
        return frames

    def rpdo(self, cob_id: int, data: bytes, now_ns: int) -> None:
        """Receive an RPDO, to be latched at the next SYNC or applied at once."""
        pdo = self._pdos.rpdos[cob_id]
        size = pdo.layout.size
        if len(data) < size:
            self._connection.report(PDO_SHORT, now_ns)
            return
        if len(data) > size:
            self._connection.report(PDO_LONG, now_ns)
        pdo.seen_ns = now_ns
        self._connection.over(RPDO_LATE, now_ns)
        window_ns = 1000 * self._values[0x1007, 0]
        values = pdo.layout.unpack(data[:size])
        if pdo.kind > LAST_SYNCHRONOUS:
            self._pdos.apply(pdo, values)
        elif not (window_ns and self._sync_ns and now_ns - self._sync_ns > window_ns):
            pdo.waiting = values

    def late_rpdos(self, now_ns: int) -> int:
        """Number of RPDOs whose deadline has passed since the last look."""
        count = 0
        for pdo in self._pdos.rpdos.values():
            late = pdo.seen_ns is not None and now_ns - pdo.seen_ns > pdo.timer_ns
            if pdo.timer_ns and late:
                pdo.seen_ns = None
                count += 1
        return count

    def watch_sync(self, now_ns: int) -> None:
        """Go into fault if SYNC has been missing for too long while the motor has power."""
        cycle_ns = 1000 * self._values[0x1006, 0] * self._periods
        if cycle_ns and self._sync_ns is not None and now_ns - self._sync_ns > cycle_ns:
            self._sync_ns = None
            if self._axis.power.state is DriveState.OPERATION_ENABLED:
                self._axis.fault(SYNC_MISSING)
