"""Serves emulated channels behind pseudo terminals, as adapters on serial lines would."""

import select
import time
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import final

from legbench.closing import Closing
from legbench.drives.emulated.network import Network
from legbench.drives.emulated.pacer import Pacer
from legbench.drives.emulated.shared_body import time_of
from legbench.drives.emulated.slcan_line import SlcanLine


def _say_nothing(_text: str) -> None:
    """Discard a warning."""


@final
class SlcanServer(Closing):
    """Emulated channels of one leg, each behind an adapter of its own.

    Attributes:
        path: paths of the terminals, in the order of the channels, with commas between them.
    """

    def __init__(
        self,
        networks: Sequence[Network],
        links: Sequence[Path | None] = (),
        now_ns: Callable[[], int] = time.monotonic_ns,
        warn: Callable[[str], None] = _say_nothing,
    ) -> None:
        """Open a terminal for each channel; all channels pass time together.

        Args:
            networks: emulated buses behind the adapters.
            links: symbolic links to the terminals, whose own names are a matter of chance.
            now_ns: clock that paces the buses [ns].
            warn: called with a warning of an adapter that is set to another bitrate than its bus.

        Raises:
            BusError: there is no terminal to be had, or no link; none is left then.
        """
        with ExitStack() as made:
            self._lines = [
                made.enter_context(SlcanLine(network, link, warn))
                for network, link in zip(networks, links or [None] * len(networks), strict=True)
            ]
            made.pop_all()
        self.path = ",".join(line.path for line in self._lines)
        self._pacer = Pacer(time_of(networks), now_ns)

    def poll(self) -> None:
        """Wait a moment for lines, move frames and time on."""
        reading = [line.reader for line in self._lines]
        writing = [writer for line in self._lines for writer in line.writers]
        ready, _, _ = select.select(reading, writing, [], self._pacer.wait_s())
        self._pacer.advance()
        for line in self._lines:
            line.take(ready)
        self._pacer.advance()
        for line in self._lines:
            line.give()

    def close(self) -> None:
        """Take the terminals away; may be called twice."""
        for line in self._lines:
            line.close()
