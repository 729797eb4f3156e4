"""A pseudo terminal behind which an emulated bus looks like a CAN adapter on a serial line."""

import os
import tty
from collections.abc import Callable, Collection
from contextlib import suppress
from pathlib import Path
from typing import final

from legbench.closing import Closing
from legbench.drives.emulated.network import Network
from legbench.drives.emulated.slcan import SlcanAdapter
from legbench.drives.errors import BusError
from legbench.drives.protocol.slcan import OK, REFUSED

CHUNK, FULL = 4096, 1 << 16
"""Largest read; amount of unread output from which on lines are dropped [bytes]."""


@final
class SlcanLine(Closing):
    """One emulated network behind one adapter; python-can's `slcan` opens `path`.

    Attributes:
        path: path of the terminal, such as `/dev/pts/3`.
    """

    def __init__(self, network: Network, link: Path | None, warn: Callable[[str], None]) -> None:
        """Open a terminal.

        Args:
            network: emulated bus behind the adapter.
            link: a symbolic link to the terminal, whose own name is a matter of chance.
            warn: called with a warning of an adapter that is set to another bitrate than the bus.

        Raises:
            BusError: there is no terminal to be had, or no link.
        """
        self.network, self._link, self._warn = network, None, warn
        try:
            self._ours, self._theirs = os.openpty()
        except OSError as error:
            raise BusError(f"no pseudo terminal: {error.strerror}") from None
        # The terminal is raw before it is opened: an echo would come back as frames. This
        # process holds the other end, too, so the terminal stays when a program closes it.
        tty.setraw(self._theirs)
        os.set_blocking(self._ours, False)
        self.path = os.ttyname(self._theirs)
        if link is not None:
            try:
                self._replace_dead(link)
                link.symlink_to(self.path)
            except OSError as error:
                self.close()
                raise BusError(f"cannot serve a bus at {link}: {error.strerror}") from None
            self._link = link
        self._adapter = SlcanAdapter(network)
        self._warned: int | None = None
        self._answers = self._unsent = b""
        self._cut, self._openings = False, 0

    @staticmethod
    def _replace_dead(link: Path) -> None:
        """Remove a link to a terminal that is gone; any other file stays."""
        if link.is_symlink() and not link.exists():
            link.unlink()

    @property
    def reader(self) -> int:
        """File descriptor from which lines of the program are read."""
        return self._ours

    @property
    def writers(self) -> list[int]:
        """File descriptor to which lines are left to be written; none if there are none."""
        return [self._ours] if self._unsent else []

    def take(self, ready: Collection[int]) -> None:
        """Hand over the lines that have come, if its reader is among those that are ready."""
        if self._ours not in ready:
            return
        with suppress(BlockingIOError):
            self._answers = self._adapter.feed(os.read(self._ours, CHUNK))
        self._compare_bitrates()
        self._forget_old()

    def give(self) -> None:
        """Write answers and received frames, as far as the program has read what came before."""
        if len(self._unsent) < FULL:
            self._unsent += self._answers + self._adapter.take()
        self._answers = b""
        if self._unsent:
            with suppress(BlockingIOError):
                count = os.write(self._ours, self._unsent)
                self._cut = self._unsent[count - 1 : count] not in (OK, REFUSED)
                self._unsent = self._unsent[count:]

    def _forget_old(self) -> None:
        """Drop what an earlier program has left unread when the channel is opened anew."""
        if self._adapter.openings != self._openings:
            self._openings = self._adapter.openings
            self._unsent = b"\r" if self._cut else b""

    def _compare_bitrates(self) -> None:
        asked = self._adapter.bitrate
        if asked not in (None, self.network.bitrate, self._warned):
            self._warn(
                f"the adapter was set to {asked} bit/s, the bus runs at {self.network.bitrate} "
                "bit/s: no frame passes"
            )
        self._warned = asked

    def close(self) -> None:
        """Take the terminal away; may be called twice."""
        if self._ours >= 0:
            os.close(self._ours)
            os.close(self._theirs)
            self._ours = -1
        if self._link is not None and self._link.is_symlink():
            self._link.unlink()
            self._link = None
