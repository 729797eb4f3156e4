"""Buses on which time is virtual."""

from abc import abstractmethod

import can

from legbench.drives.transport.timebase import Timebase


class VirtualBus(can.BusABC):
    """Bus whose time passes only while somebody waits for it.

    Attributes:
        timebase: its virtual time.
    """

    timebase: Timebase

    @property
    @abstractmethod
    def alone(self) -> bool:
        """Whether this is the only master, and nothing but drives hangs on the bus."""
