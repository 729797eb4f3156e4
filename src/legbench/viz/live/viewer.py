"""The rerun viewer as a process of its own, reachable from this machine alone."""

import socket
import subprocess
import sys
import threading
import time
from collections.abc import Sequence
from contextlib import suppress
from importlib.util import find_spec
from pathlib import Path
from typing import final
from urllib.parse import quote

from legbench.errors import MissingExtraError
from legbench.viz.display import has_display

LOOPBACK = "127.0.0.1"
"""Address that the viewer listens on; its own default is every network interface."""
PORT, WEB_PORT = 9876, 9090
START_TIME = 20.0
"""Longest time until a viewer must accept connections [s]."""
LOOK_PERIOD = 0.05
"""Period of the looks whether it does [s]."""
MEMORY = ("--memory-limit", "2GB", "--server-memory-limit", "256MB")
"""Memory limits of the viewer, whose default is three quarters of the whole machine's memory.

A server that reaches its limit forgets the oldest rows, which the page has by then; one that is
opened later begins after them. It counts what messages hold, not what they cost: in small ones, as
of a run that is watched, it needs some 2.5 times as much."""


def proxy_url(port: int = PORT) -> str:
    """Address that a recording stream connects to."""
    return f"rerun+http://{LOOPBACK}:{port}/proxy"


def web_url(port: int = PORT, web_port: int = WEB_PORT) -> str:
    """The page that shows what is sent to `proxy_url`."""
    return f"http://{LOOPBACK}:{web_port}/?url={quote(proxy_url(port), safe='')}"


def listening(port: int) -> bool:
    """Whether something on this machine accepts connections on a port."""
    with socket.socket() as probe:
        probe.settimeout(0.2)
        return probe.connect_ex((LOOPBACK, port)) == 0


def free_port() -> int:
    """Port of this machine that nobody has; the system gives two programs two different ones.

    The usual ports would be taken by the second of two runs that look at the same moment.
    """
    with socket.socket() as probe:
        probe.bind((LOOPBACK, 0))
        return int(probe.getsockname()[1])


def wait_until_served(
    process: "subprocess.Popen[bytes]", port: int, command: Sequence[str]
) -> None:
    """Wait until a viewer that was started accepts connections.

    Raises:
        MissingExtraError: it has ended, or takes too long.
    """
    deadline = time.monotonic() + START_TIME
    while not listening(port):
        if process.poll() is not None or time.monotonic() > deadline:
            process.terminate()
            raise MissingExtraError(
                f"the rerun viewer did not start; try `{' '.join(command)}` by hand"
            )
        time.sleep(LOOK_PERIOD)


def viewer_command(
    files: Sequence[Path] = (), *, port: int = PORT, serve: bool, web_port: int = WEB_PORT
) -> list[str]:
    """The command line of a viewer window, or of a server for the browser."""
    command = [*_executable(), *map(str, files)]
    command += ["--bind", LOOPBACK, "--port", str(port), "--hide-welcome-screen", *MEMORY]
    return [*command, "--serve-web", "--web-viewer-port", str(web_port)] if serve else command


def _executable() -> list[str]:
    """The viewer itself, not its Python wrapper, which a signal would not get through."""
    spec = find_spec("rerun_cli")
    folders = [] if spec is None else list(spec.submodule_search_locations or ())
    found = [path for folder in folders for path in Path(folder).glob("rerun*") if _runs(path)]
    return [str(found[0])] if found else [sys.executable, "-m", "rerun_cli"]


def _runs(path: Path) -> bool:
    return path.name in ("rerun", "rerun.exe") and path.is_file()


def require_viewer(*, serve: bool, way_out: str) -> None:
    """Check that a viewer can open, before anything is started.

    Raises:
        MissingExtraError: rerun is not installed, or there is no display; ends with `way_out`.
    """
    if find_spec("rerun") is None:
        raise MissingExtraError(
            "rerun is not installed; the viewer needs it: pip install 'legbench[viz]'"
        )
    if not serve and not has_display():
        raise MissingExtraError(f"no display: {way_out}")


def spawn(command: Sequence[str], *, own_session: bool = True) -> "subprocess.Popen[bytes]":
    """Start a process that shares nothing with this one."""
    return subprocess.Popen(
        list(command),
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        start_new_session=own_session,
    )


def forget(process: "subprocess.Popen[bytes]") -> None:
    """Let a process be: a thread of its own takes note of its end, whenever that is."""
    with suppress(RuntimeError):
        threading.Thread(target=process.wait, daemon=True).start()


@final
class Viewer:
    """A viewer that was opened on a file.

    Attributes:
        url: address of the page to open in a browser; None for a window.
    """

    def __init__(self, process: "subprocess.Popen[bytes]", url: str | None) -> None:
        self._process = process
        self.url = url

    def wait(self) -> int:
        """Wait until the viewer is closed; returns its exit status."""
        return self._process.wait()

    def stop(self) -> None:
        """Close the viewer, without waiting for it."""
        self._process.terminate()
        forget(self._process)


def open_viewer(rrd: Path, *, serve: bool = False) -> Viewer:
    """Show an `.rrd` file in a window, or serve it to a browser on this machine.

    The page is there when this returns, at ports that nobody else had.

    Raises:
        MissingExtraError: rerun is not installed, there is no display for a window, or the server
            does not start.
    """
    way_out = f"open {rrd} with `rerun {rrd}` on a machine that has one, or show it with --serve"
    require_viewer(serve=serve, way_out=way_out)
    port, web_port = (free_port(), free_port()) if serve else (PORT, WEB_PORT)
    command = viewer_command([rrd], port=port, serve=serve, web_port=web_port)
    process = spawn(command)
    if serve:
        wait_until_served(process, web_port, command)
        return Viewer(process, web_url(port, web_port))
    forget(process)
    return Viewer(process, None)
