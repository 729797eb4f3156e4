"""Pictures on a full disk, and of run folders that cannot be written."""

import subprocess
import sys
from pathlib import Path

import pytest
from test_viz_render import gl_works
from viz_runs import record, stream_of

from legbench.cli import replay
from legbench.design.setup import SetupKind
from legbench.recording.reader import Recording
from legbench.viz.live import viewer

PROGRAM = """
import resource, signal, sys
from pathlib import Path
from legbench.errors import LegbenchError
from legbench.recording.reader import load
from legbench.viz.film.render import render
from legbench.viz.live.rrd import write_rrd
from legbench.viz.print.figures import phase_figure
from legbench.viz.print.save import save_figure

run, out = load(Path(sys.argv[1])), Path(sys.argv[2])
figure = phase_figure(run)
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
resource.setrlimit(resource.RLIMIT_FSIZE, (4096, resource.RLIM_INFINITY))
for suffix in sys.argv[3:]:
    path = out / f"picture{suffix}"
    try:
        if suffix == ".rrd":
            write_rrd(run, path)
        elif suffix in (".mp4", ".gif", ".film.png"):
            render(run, path)
        else:
            save_figure(figure, path)
        print("wrote", suffix)
    except LegbenchError as error:
        print(error)
"""


def on_a_full_disk(run: Path, out: Path, *suffixes: str) -> list[str]:
    """What is said of pictures where no file may be longer than a page."""
    command = [sys.executable, "-c", PROGRAM, str(run), str(out), *suffixes]
    done = subprocess.run(command, capture_output=True, text=True, timeout=120, check=True)
    return done.stdout.splitlines()


@pytest.fixture(scope="module")
def short(tmp_path_factory: pytest.TempPathFactory) -> Recording:
    run = record(tmp_path_factory.mktemp("short"), SetupKind.JUMP, 300)
    (run.path / "samples.arrows").write_bytes(b"".join(stream_of(run)))
    return run


def refused(suffixes: tuple[str, ...], run: Recording, out: Path) -> None:
    lines = on_a_full_disk(run.path, out, *suffixes)
    assert lines == [
        f"cannot write {out / f'picture{suffix}'}: File too large [EFBIG]" for suffix in suffixes
    ]
    assert list(out.iterdir()) == []


@pytest.mark.long
def test_no_half_figure_or_view_stays(short: Recording, tmp_path: Path) -> None:
    refused((".png", ".svg", ".pdf", ".rrd"), short, tmp_path)


@pytest.mark.long
def test_no_half_film_stays(short: Recording, tmp_path: Path) -> None:
    if not gl_works():
        pytest.skip("no OpenGL without a display")
    refused((".mp4", ".gif", ".film.png"), short, tmp_path)


def test_a_run_folder_that_cannot_be_written_can_be_viewed(
    short: Recording, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    opened: list[Path] = []

    def opens(rrd: Path, *, serve: bool) -> viewer.Viewer:
        opened.append(rrd)
        process = subprocess.Popen(["true"])
        process.wait()
        return viewer.Viewer(process, None)

    monkeypatch.setattr(viewer, "open_viewer", opens)
    monkeypatch.setattr(replay.os, "access", lambda path, mode: False)
    assert replay.main([str(short.path), "--view"]) == 0
    assert not (short.path / "view.rrd").exists()
    assert opened[0].stat().st_size > 100_000
    said = capsys.readouterr().err
    assert f"{short.path} cannot be written" in said
    assert f"wrote {opened[0]}" in said
