import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pytest
import viz_rrd
from viz_runs import stream_of

from legbench.errors import MissingExtraError
from legbench.recording.layout import STREAM
from legbench.recording.reader import Recording
from legbench.recording.stream import END_MARK
from legbench.viz.live import viewer
from legbench.viz.live.launch import LiveView, start_live
from legbench.viz.live.watch import LOG

DEADLINE = 30.0
"""After which a process that does not get anywhere fails its test [s]."""


def until(true: Callable[[], bool]) -> None:
    end = time.monotonic() + DEADLINE
    while not true():
        assert time.monotonic() < end, "nothing happened"
        time.sleep(0.02)


def state(pid: int) -> str:
    """Of a process, as the kernel names it: R, S, T for stopped, Z for a zombie."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()[0]
    except FileNotFoundError:
        return "gone"


@pytest.fixture
def run(hop: Recording, tmp_path: Path) -> tuple[Path, list[bytes]]:
    """A run folder whose stream has its schema, and the messages that are still to come."""
    messages = stream_of(hop)
    for name in ("run.json", "leg.xml"):
        (tmp_path / name).write_bytes((hop.path / name).read_bytes())
    (tmp_path / STREAM).write_bytes(messages[0])
    return tmp_path, [*messages[1:], END_MARK]


def append(folder: Path, messages: list[bytes]) -> None:
    with (folder / STREAM).open("ab") as file:
        for message in messages:
            file.write(message)


def rows_shown(path: Path) -> int:
    return len(viz_rrd.temporal(path)["/series/joint/link"]["t"])


def test_a_frozen_view_costs_nothing_and_catches_up(run: tuple[Path, list[bytes]]) -> None:
    folder, messages = run
    target = folder / "live.rrd"
    view = start_live(folder, save=target)
    until(lambda: target.exists() and target.stat().st_size > 0)
    os.kill(view.pid, signal.SIGSTOP)
    until(lambda: state(view.pid) == "T")
    append(folder, messages)
    assert view.alive
    os.kill(view.pid, signal.SIGCONT)
    view.stop()
    until(lambda: not view.alive)
    assert rows_shown(target) == 2500
    assert not (folder / LOG).exists()


def test_a_killed_view_leaves_the_run_alone(run: tuple[Path, list[bytes]]) -> None:
    folder, messages = run
    view = start_live(folder, save=folder / "live.rrd")
    os.kill(view.pid, signal.SIGKILL)
    append(folder, messages)
    until(lambda: not view.alive)
    view.stop()
    view.stop()
    assert (folder / STREAM).read_bytes().endswith(END_MARK)


def test_a_stopped_view_cannot_hold_up_stop(run: tuple[Path, list[bytes]]) -> None:
    folder, _ = run
    view = start_live(folder, save=folder / "live.rrd")
    os.kill(view.pid, signal.SIGSTOP)
    until(lambda: state(view.pid) == "T")
    view.stop()
    assert view.alive
    os.kill(view.pid, signal.SIGKILL)
    until(lambda: not view.alive)


def test_the_view_has_a_session_of_its_own_and_no_terminal(
    run: tuple[Path, list[bytes]],
) -> None:
    folder, _ = run
    view = start_live(folder, save=folder / "live.rrd")
    assert os.getsid(view.pid) == view.pid
    for descriptor in (0, 1, 2):
        assert os.readlink(f"/proc/{view.pid}/fd/{descriptor}") == "/dev/null"
    os.kill(view.pid, signal.SIGKILL)
    view.stop()
    until(lambda: not view.alive)


def test_a_view_outlives_no_run(run: tuple[Path, list[bytes]]) -> None:
    folder, messages = run
    append(folder, messages[:4])
    program = (
        "import sys, pathlib; from legbench.viz.live.launch import start_live;"
        "folder = pathlib.Path(sys.argv[1]);"
        "print(start_live(folder, save=folder / 'live.rrd').pid, flush=True);"
        "import os; os._exit(1)"
    )
    done = subprocess.run(
        [sys.executable, "-c", program, str(folder)], capture_output=True, check=False
    )
    pid = int(done.stdout)
    until(lambda: state(pid) in ("gone", "Z"))


def test_what_went_wrong_is_written_beside_the_run(tmp_path: Path) -> None:
    view = start_live(tmp_path, save=tmp_path / "live.rrd")
    until(lambda: not view.alive)
    assert "is no run folder: it has no manifest" in (tmp_path / LOG).read_text()


def test_no_display_is_said_before_anything_starts(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(viewer, "has_display", lambda: False)
    with pytest.raises(MissingExtraError, match="no display: the run goes on unseen"):
        start_live(tmp_path)
    with pytest.raises(MissingExtraError, match=r"no display: open .*view\.rrd with `rerun "):
        viewer.open_viewer(tmp_path / "view.rrd")


def test_no_rerun_is_said_before_anything_starts(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(viewer, "find_spec", lambda name: None)
    with pytest.raises(MissingExtraError, match=r"pip install 'legbench\[viz\]'"):
        start_live(tmp_path, serve=True)


@pytest.mark.parametrize("serve", [False, True])
def test_viewers_listen_on_this_machine_alone(serve: bool) -> None:
    command = viewer.viewer_command(serve=serve)
    assert command[command.index("--bind") + 1] == "127.0.0.1"
    assert ("--serve-web" in command) == serve
    assert viewer.proxy_url(1234) == "rerun+http://127.0.0.1:1234/proxy"
    assert viewer.web_url(1234, 80) == (
        "http://127.0.0.1:80/?url=rerun%2Bhttp%3A%2F%2F127.0.0.1%3A1234%2Fproxy"
    )


def test_stopping_a_view_never_raises() -> None:
    process = subprocess.Popen([sys.executable, "-c", ""])
    process.wait()
    LiveView(process, None).stop()


MISSING = {
    "rerun": ("live.rrd", "viz"),
    "matplotlib": ("print.figures", "viz"),
    "av": ("film.render", "render"),
    "OpenGL": ("film.offscreen", "render"),
}
"""Package that may not be installed -> the module that needs it, and the extra that brings it."""


LIGHT = ("live.launch", "live.viewer", "style", "facts")
"""Modules that the process of a run may import."""
HEAVY = ("rerun", "matplotlib", "mujoco", "imageio", "av", "PIL")


def test_the_control_process_imports_nothing_heavy_and_a_missing_package_names_the_extra() -> None:
    program = f"""
import importlib, sys
from legbench.errors import MissingExtraError
for module in {LIGHT}:
    importlib.import_module("legbench.viz." + module)
print("heavy:", *set({HEAVY}) & set(sys.modules))
for missing, (module, _) in {MISSING}.items():
    sys.modules[missing] = None
    try:
        importlib.import_module("legbench.viz." + module)
    except MissingExtraError as error:
        print(missing, error)
    del sys.modules[missing]
"""
    done = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, check=False, text=True
    )
    heavy, *lines = done.stdout.splitlines()
    assert heavy == "heavy:"
    assert [line.split()[0] for line in lines] == list(MISSING), done.stderr
    for line, (_, extra) in zip(lines, MISSING.values(), strict=True):
        assert f"pip install 'legbench[{extra}]'" in line


def test_a_viewer_that_takes_no_data_is_given_up(tmp_path: Path) -> None:
    program = (
        "import sys, threading, legbench.viz.live.watch as watch\n"
        "watch.PATIENCE = 0.2\n"
        "watch.follow = lambda *arguments: threading.Event().wait()\n"
        "watch.main([sys.argv[1], '--save', sys.argv[1] + '/live.rrd'])\n"
    )
    command = [sys.executable, "-c", program, str(tmp_path)]
    done = subprocess.run(command, capture_output=True, check=False, timeout=DEADLINE)
    assert (done.returncode, done.stderr) == (1, b"")
