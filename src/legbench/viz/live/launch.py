"""Watching a run while it goes on, in a process that the control loop never waits for.

The process runs `legbench.viz.live.watch`, which reads the run folder and never the loop: frozen or
killed, it costs the run nothing. Importing this module does not import rerun.
"""

import os
import subprocess
import sys
from contextlib import suppress
from pathlib import Path
from typing import final

from legbench.viz.live import viewer


@final
class LiveView:
    """A live view that has been started.

    Attributes:
        url: address of the page to open in a browser; None for a window.
    """

    def __init__(
        self, process: "subprocess.Popen[bytes]", url: str | None, web_port: int | None = None
    ) -> None:
        self._process = process
        self.url = url
        self._web_port = web_port

    @property
    def pid(self) -> int:
        """Process id of the program that follows the run."""
        return self._process.pid

    @property
    def alive(self) -> bool:
        """Whether the program still follows the run."""
        return self._process.poll() is None

    @property
    def served(self) -> bool:
        """Whether the page is there."""
        return self._web_port is not None and viewer.listening(self._web_port)

    def stop(self) -> None:
        """Have the last rows shown, and no more; returns at once whatever state the view is in.

        A window stays open, a page is no longer served.
        """
        with suppress(OSError):
            self._process.terminate()
        viewer.forget(self._process)


def start_live(
    run_folder: Path,
    *,
    serve: bool = False,
    port: int = viewer.PORT,
    save: Path | None = None,
) -> LiveView:
    """Start watching a run that is about to write its first row.

    Args:
        run_folder: folder of the run; its manifest is there.
        serve: show it in a browser on this machine rather than in a window.
        port: port of the window; one that already listens there is used. A page is served at ports
            that nobody has.
        save: write an `.rrd` file instead of opening a viewer.

    Raises:
        MissingExtraError: rerun is not installed, or there is no display for a window; a run
            goes on without.
    """
    if save is None:
        way_out = "the run goes on unseen; look at it afterwards, or take --serve for a browser"
        viewer.require_viewer(serve=serve, way_out=way_out)
    web_port = viewer.WEB_PORT
    if serve:
        port, web_port = viewer.free_port(), viewer.free_port()
    command = [
        sys.executable,
        "-m",
        "legbench.viz.live.watch",
        str(run_folder),
        "--port",
        str(port),
        "--web-port",
        str(web_port),
    ]
    command += ["--parent", str(os.getpid())]
    command += ["--serve"] if serve else []
    command += [] if save is None else ["--save", str(save)]
    process = viewer.spawn(command)
    if not serve:
        return LiveView(process, None)
    return LiveView(process, viewer.web_url(port, web_port), web_port)
