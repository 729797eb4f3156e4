"""What a user sees: the real viewer, without a window, asked whether it has anything to report."""

import time
from collections.abc import Iterator
from pathlib import Path

import pytest
from rerun.experimental import ViewerClient

from legbench.recording.reader import Recording
from legbench.viz.live import viewer
from legbench.viz.live.rrd import write_rrd

ICDS = [*Path("/usr/share/vulkan/icd.d").glob("*.json"), *Path("/etc/vulkan/icd.d").glob("*.json")]
DEADLINE = 30.0
"""[s]"""

pytestmark = pytest.mark.skipif(not ICDS, reason="no Vulkan: install mesa-vulkan-drivers")


@pytest.fixture
def port() -> Iterator[int]:
    """Of a viewer without a window, started as the viewer for people is."""
    number = viewer.free_port()
    command = [*viewer.viewer_command(port=number, serve=False), "--headless"]
    process = viewer.spawn([*command, "--window-size", "1600x900"])
    try:
        end = time.monotonic() + DEADLINE
        while not viewer.listening(number):
            if process.poll() is not None or time.monotonic() > end:
                pytest.skip("the viewer does not start here")
            time.sleep(0.05)
        yield number
    finally:
        process.kill()
        process.wait()


def listeners(port: int) -> set[str]:
    """Addresses on which this machine listens, in the kernel's hexadecimal."""
    rows = Path("/proc/net/tcp").read_text().splitlines()[1:]
    local = [row.split()[1].split(":") for row in rows if row.split()[3] == "0A"]
    return {address for address, number in local if int(number, 16) == port}


@pytest.mark.long
@pytest.mark.parametrize("name", ["hop", pytest.param("swing", marks=pytest.mark.long)])
def test_the_viewer_has_nothing_to_complain_about(
    name: str, port: int, tmp_path: Path, request: pytest.FixtureRequest
) -> None:
    run: Recording = request.getfixturevalue(name)
    assert listeners(port) == {"0100007F"}
    client = ViewerClient.connect(viewer.proxy_url(port))
    client.open(str(write_rrd(run, tmp_path / "run.rrd")))
    end = time.monotonic() + DEADLINE
    while (state := client.get_state()).loading or len(state.views) < 10:
        assert time.monotonic() < end, "the layout did not appear"
        time.sleep(0.1)
    client.set_time("t", duration=1.0, play_state="paused")
    time.sleep(1.0)
    views = client.get_state().views
    reports = {view.name: view.reports for view in views if view.reports}
    assert reports == {}
    assert {view.name for view in views} >= {
        "leg",
        "model",
        "run",
        "P^r [-], gaps: no motion to rate",
        "colours",
        "spring torque [N m]",
    }
    picture = client.take_screenshot(next(view.view_id for view in views if view.name == "leg"))
    assert len(picture) > 2_000


def test_stopping_a_served_file_ends_its_server(hop: Recording, tmp_path: Path) -> None:
    served = viewer.open_viewer(write_rrd(hop, tmp_path / "run.rrd"), serve=True)
    assert served.url is not None
    served.stop()
    assert served.wait() != 0
