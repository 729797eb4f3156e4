"""The program behind a live view: `python -m legbench.viz.live.watch RUN`.

It follows the samples of one run and publishes them, at low priority. Should the viewer stop
taking data, which blocks whoever sends them, a watchdog ends the program.
"""

import argparse
import faulthandler
import os
import signal
import subprocess
import sys
import time
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import IO, final

from legbench.errors import LegbenchError
from legbench.viz.live import viewer
from legbench.viz.live._rerun import rr
from legbench.viz.live.follow import Pace, follow
from legbench.viz.live.publish import APPLICATION

LOOK_PERIOD = 0.05
"""Period of the looks at the run [s]: the writer hands over 50 rows at a time."""
PATIENCE = 30.0
"""Time after which a viewer that takes no data is given up [s]."""
NICENESS = 10
"""Niceness of this program, lower in priority than the control loop."""
LOG = "live.log"
"""Name of the log in the run folder, written only when something went wrong."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Options:
    """Options of the program on its command line."""

    run: Path
    """Folder of the run."""
    port: int = viewer.PORT
    """Port of the viewer."""
    web_port: int = viewer.WEB_PORT
    """Port of the page."""
    serve: bool = False
    """Show the run in a browser on this machine rather than in a window."""
    parent: int | None = None
    """Process that writes the run; by default the one that started this program."""
    save: Path | None = None
    """An `.rrd` file to write instead of opening a viewer."""


@final
class EndRequest:
    """Watch for the end: whether the run's process has asked for it, or has gone."""

    def __init__(self, parent: int | None) -> None:
        self._parent = os.getppid() if parent is None else parent
        self._asked = False
        signal.signal(signal.SIGTERM, self._ask)

    def __call__(self) -> bool:
        """Whether the end has been asked for, or the run's process has gone."""
        return self._asked or os.getppid() != self._parent

    def _ask(self, number: int, frame: object) -> None:
        self._asked = True


def main(arguments: Sequence[str] | None = None) -> int:
    """Follow one run to its end; returns the exit status."""
    options = _parse(arguments)
    ending = EndRequest(options.parent)
    _step_back()
    try:
        with open(os.devnull, "w", encoding="utf-8") as nowhere:
            watch(options, ending, nowhere)
    except LegbenchError as error:
        with suppress(OSError):  # The run's folder is gone: nobody is left to be told.
            (options.run / LOG).write_text(f"{error}\n", encoding="utf-8")
        return 1
    return 0


def watch(options: Options, ending: EndRequest, nowhere: IO[str]) -> None:
    """Open the viewer, publish the run, and serve it for as long as the run's process lives.

    Raises:
        RecordingError: there is no run in the folder.
        MissingExtraError: the viewer does not start.
    """

    def arm() -> None:
        faulthandler.dump_traceback_later(PATIENCE, exit=True, file=nowhere)

    def wait() -> None:
        arm()
        time.sleep(LOOK_PERIOD)

    stream = rr.RecordingStream(APPLICATION, recording_id=options.run.name)
    server = None
    if options.save is not None:
        stream.save(options.save)
    else:
        server = _open_viewer(options)
        stream.connect_grpc(viewer.proxy_url(options.port))
    arm()
    follow(options.run, stream, Pace(wait=wait, over=ending))
    arm()
    stream.disconnect()
    faulthandler.cancel_dump_traceback_later()
    if options.serve and server is not None:
        while not ending():
            time.sleep(LOOK_PERIOD)
        server.terminate()


def _open_viewer(options: Options) -> "subprocess.Popen[bytes] | None":
    """A viewer that accepts connections; None for a window that was there already."""
    if not options.serve and viewer.listening(options.port):
        return None
    command = viewer.viewer_command(
        port=options.port, serve=options.serve, web_port=options.web_port
    )
    process = viewer.spawn(command)
    viewer.wait_until_served(process, options.port, command)
    if not options.serve:
        viewer.forget(process)
    return process


def _step_back() -> None:
    """Give up any real-time priority that came with the control loop's process."""
    if sys.platform == "linux":
        with suppress(OSError):
            os.sched_setscheduler(0, os.SCHED_OTHER, os.sched_param(0))
    with suppress(OSError):
        os.nice(NICENESS)


def _parse(arguments: Sequence[str] | None) -> Options:
    parser = argparse.ArgumentParser(prog="python -m legbench.viz.live.watch", description=__doc__)
    parser.add_argument("run", type=Path)
    parser.add_argument("--port", type=int, default=viewer.PORT)
    parser.add_argument("--web-port", type=int, default=viewer.WEB_PORT)
    parser.add_argument("--serve", action="store_true")
    parser.add_argument("--parent", type=int)
    parser.add_argument("--save", type=Path)
    return Options(**vars(parser.parse_args(arguments)))


if __name__ == "__main__":
    sys.exit(main())
