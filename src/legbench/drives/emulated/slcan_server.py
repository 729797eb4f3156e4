"""Serves an emulated bus behind a pseudo terminal, as an adapter on a serial line would."""

import os
import select
import time
import tty
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import final

from legbench.closing import Closing
from legbench.drives.emulated.network import Network
from legbench.drives.emulated.network_time import NetworkTime
from legbench.drives.emulated.pacer import Pacer
from legbench.drives.emulated.slcan import SlcanAdapter
from legbench.drives.errors import BusError
from legbench.drives.protocol.slcan import OK, REFUSED

CHUNK, FULL = 4096, 1 << 16
"""Largest read; amount of unread output from which on lines are dropped [bytes]."""


def _say_nothing(_text: str) -> None:
    """Discard a warning."""


@final
class SlcanServer(Closing):
    """One emulated bus behind one adapter; python-can's `slcan` opens `path`.

    Attributes:
        path: path of the terminal, such as `/dev/pts/3`.
    """

    def __init__(
        self,
        network: Network,
        link: Path | None = None,
        now_ns: Callable[[], int] = time.monotonic_ns,
        warn: Callable[[str], None] = _say_nothing,
    ) -> None:
        """Open a terminal.

        Args:
            network: emulated bus behind the adapter.
            link: a symbolic link to the terminal, whose own name is a matter of chance.
            now_ns: clock that paces the bus [ns].
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
        self._unsent, self._cut, self._openings = b"", False, 0
        self._pacer = Pacer(NetworkTime(network), now_ns)

    @staticmethod
    def _replace_dead(link: Path) -> None:
        """Remove a link to a terminal that is gone; any other file stays."""
        if link.is_symlink() and not link.exists():
            link.unlink()

    def poll(self) -> None:
        """Wait a moment for lines, move frames and time on."""
        writing = [self._ours] if self._unsent else []
        ready, _, _ = select.select([self._ours], writing, [], self._pacer.wait_s())
        self._pacer.advance()
        answers = b""
        if ready:
            with suppress(BlockingIOError):
                answers = self._adapter.feed(os.read(self._ours, CHUNK))
            self._compare_bitrates()
            self._forget_old()
        self._pacer.advance()
        if len(self._unsent) < FULL:
            self._unsent += answers + self._adapter.take()
        self._give()

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

    def _give(self) -> None:
        if self._unsent:
            with suppress(BlockingIOError):
                count = os.write(self._ours, self._unsent)
                self._cut = self._unsent[count - 1 : count] not in (OK, REFUSED)
                self._unsent = self._unsent[count:]

    def close(self) -> None:
        """Take the terminal away; may be called twice."""
        if self._ours >= 0:
            os.close(self._ours)
            os.close(self._theirs)
            self._ours = -1
        if self._link is not None and self._link.is_symlink():
            self._link.unlink()
            self._link = None
