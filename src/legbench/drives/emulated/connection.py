"""Errors of an emulated drive's connection: what it reports, and how it stops (6007h)."""

from collections.abc import Mapping
from typing import final

from legbench.drives.emulated.axis import Axis
from legbench.drives.emulated.emergencies import EmergencyOutlet
from legbench.drives.protocol.objects import Key

CONNECTION_ENDED, WAS_OFF_BUS = 0x8100, 0x8140
"""Error codes: communication, and recovered from bus-off (CiA 301, emergency error codes)."""
ABORT_OPTION = (0x6007, 0)
FAULT_OPTION = 1
"""Value of 6007h with which the end of the connection is a fault."""


@final
class Connection:
    """Connection of a drive to its master, as the drive sees it.

    Attributes:
        outlet: emergency messages on their way out.
    """

    def __init__(self, axis: Axis, values: Mapping[Key, int]) -> None:
        self._axis, self._values = axis, values
        self.outlet = EmergencyOutlet(values)

    def report(self, code: int, now_ns: int) -> None:
        """Report an error that has come up."""
        self.outlet.put(self._axis.alarms.raise_(code), now_ns)

    def over(self, code: int, now_ns: int) -> None:
        """Clear an error that is over; a fault keeps its reason until it is reset."""
        if not self._axis.power.faulted:
            self.outlet.put(self._axis.alarms.clear(code), now_ns)

    def forward(self, now_ns: int) -> None:
        """Pass on the emergency messages of the CiA 402 half."""
        for emergency in self._axis.take():
            self.outlet.put(emergency, now_ns)

    def lost(self, code: int, now_ns: int) -> None:
        """Report the loss of the connection and stop."""
        self.report(code, now_ns)
        self._axis.power.connection_lost()

    def end(self, now_ns: int) -> None:
        """Stop, as NMT has ended the connection; if that is a fault, it has a reason."""
        if self._values[ABORT_OPTION] == FAULT_OPTION and not self._axis.power.faulted:
            self.report(CONNECTION_ENDED, now_ns)
        self._axis.power.connection_lost()

    def leave_bus(self, now_ns: int) -> None:
        """Stop, as the drive's own controller is bus-off; it is reported afterwards."""
        self.outlet.mute()
        self.lost(WAS_OFF_BUS, now_ns)

    def rejoin_bus(self, now_ns: int) -> None:
        """Report that the drive was off the bus."""
        self.outlet.unmute(now_ns)
        self.over(WAS_OFF_BUS, now_ns)
