"""Pages that are served to a browser: there when their address is told, and nobody else's."""

import sys
from pathlib import Path
from urllib.request import urlopen

import pytest

from legbench.errors import MissingExtraError
from legbench.recording.reader import Recording
from legbench.viz.live import viewer
from legbench.viz.live.rrd import write_rrd


def test_two_pages_at_a_time_each_show_their_own_run(hop: Recording, tmp_path: Path) -> None:
    rrd = write_rrd(hop, tmp_path / "run.rrd")
    served = [viewer.open_viewer(rrd, serve=True) for _ in range(2)]
    try:
        addresses = [view.url or "" for view in served]
        assert addresses[0] != addresses[1]
        for address in addresses:
            with urlopen(address, timeout=10.0) as page:
                assert b"<html" in page.read()
    finally:
        for view in served:
            view.stop()
            view.wait()


def test_a_server_that_does_not_start_is_told(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(viewer, "viewer_command", lambda *_, **__: [sys.executable, "-c", ""])
    with pytest.raises(MissingExtraError, match="the rerun viewer did not start"):
        viewer.open_viewer(tmp_path / "run.rrd", serve=True)
