"""Pages that are served to a browser: there when their address is told, and nobody else's."""

import socket
import sys
from pathlib import Path
from urllib.request import urlopen

import pytest

from legbench.errors import MissingExtraError
from legbench.recording.reader import Recording
from legbench.viz.live import viewer
from legbench.viz.live.rrd import write_rrd


def test_a_page_is_served_at_other_ports_where_these_are_taken(
    hop: Recording, tmp_path: Path
) -> None:
    rrd = write_rrd(hop, tmp_path / "run.rrd")
    with socket.create_server(("127.0.0.1", 0)) as taken, socket.create_server(("", 0)) as too:
        ports = taken.getsockname()[1], too.getsockname()[1]
        served = viewer.open_viewer(rrd, serve=True, port=ports[0], web_port=ports[1])
        try:
            assert served.url is not None
            assert not any(f":{port}/" in served.url for port in ports)
            with urlopen(served.url, timeout=10.0) as page:
                assert b"<html" in page.read()
        finally:
            served.stop()
            served.wait()


def test_a_server_that_does_not_start_is_told(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(viewer, "viewer_command", lambda *_, **__: [sys.executable, "-c", ""])
    with pytest.raises(MissingExtraError, match="the rerun viewer did not start"):
        viewer.open_viewer(tmp_path / "run.rrd", serve=True)


def test_a_port_that_nobody_has_is_taken_as_it_is() -> None:
    with socket.socket() as probe:
        probe.bind((viewer.LOOPBACK, 0))
        number = probe.getsockname()[1]
    assert viewer.free_port(number) == number
