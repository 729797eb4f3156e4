"""Pictures of runs too long to be drawn row by row, and at once."""

from pathlib import Path

import numpy as np
import pytest
import viz_rrd
from hypothesis import given
from hypothesis import strategies as st
from matplotlib.figure import Figure

from legbench.metrics.analysis import Analysis
from legbench.recording.reader import Recording
from legbench.viz.live import rrd
from legbench.viz.live.plots import ThinnedPoints
from legbench.viz.live.viewer import viewer_command
from legbench.viz.print import thinning
from legbench.viz.print.figures import phase_figure
from legbench.viz.print.thinning import draw_line, peaks, plane_stride, stride


@given(st.lists(st.floats(-9, 9) | st.just(np.nan), min_size=1, max_size=60), st.integers(1, 7))
def test_the_outline_of_a_thinned_line_is_that_of_the_whole(values: list[float], step: int) -> None:
    whole = np.array(values)
    rows = peaks(whole, step)
    assert (np.diff(rows) >= 0).all()
    assert len(rows) <= len(whole) / step + 2 * step
    for first in range(0, len(whole), 2 * step):
        part = whole[first : first + 2 * step]
        kept = whole[rows[(rows >= first) & (rows < first + 2 * step)]]
        if np.isfinite(part).any():
            assert (np.nanmin(kept), np.nanmax(kept)) == (np.nanmin(part), np.nanmax(part))


def test_strides_leave_short_lines_alone() -> None:
    most = thinning.MOST_POINTS
    assert [stride(rows) for rows in (0, 1, most, most + 1, 10 * most)] == [1, 1, 1, 2, 10]
    assert plane_stride(1e-3 * np.arange(most, dtype=np.float64)) == 1
    assert plane_stride(1e-3 * np.arange(3 * most, dtype=np.float64)) == 3
    # A jump has forty points however long the run is.
    assert plane_stride(1e-3 * np.arange(50 * most, dtype=np.float64)) == 5
    assert plane_stride(1e-2 * np.arange(50 * most, dtype=np.float64)) == 1


def test_a_long_line_is_drawn_in_parts_that_meet(monkeypatch: pytest.MonkeyPatch) -> None:
    panel = Figure().add_subplot()
    x = np.arange(100.0)
    draw_line(panel, x, x**2, label="whole")
    monkeypatch.setattr(thinning, "MOST_POINTS", 50)
    monkeypatch.setattr(thinning, "CHUNK_POINTS", 30)
    draw_line(panel, x, x**2, label="parts")
    whole, *parts = panel.get_lines()
    np.testing.assert_array_equal(whole.get_xydata(), np.stack([x, x**2], axis=1))
    assert [str(part.get_label())[0] for part in parts] == ["p", "_", "_", "_"]
    ends = [np.asarray(part.get_xdata())[[0, -1]].tolist() for part in parts]
    assert ends == [[0, 30], [30, 60], [60, 90], [90, 99]]


def test_the_figure_of_a_long_run_shows_the_same_ranges(
    hop: Recording, monkeypatch: pytest.MonkeyPatch
) -> None:
    whole = [panel.get_xlim() + panel.get_ylim() for panel in phase_figure(hop).axes[:3]]
    monkeypatch.setattr(thinning, "MOST_POINTS", 300)
    monkeypatch.setattr(thinning, "CHUNK_POINTS", 100)
    thin = phase_figure(Analysis(hop))
    for panel, limits in zip(thin.axes[:3], whole, strict=True):
        assert len(panel.get_lines()) > 4
        width, height = limits[1] - limits[0], limits[3] - limits[2]
        now = panel.get_xlim() + panel.get_ylim()
        off = np.subtract(now, limits) / [width, width, height, height]
        assert np.abs(off).max() < 0.03


def test_windows_publish_what_the_whole_run_publishes(
    hop: Recording, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    whole = rrd.write_rrd(hop, tmp_path / "whole.rrd", [hop])
    monkeypatch.setattr(rrd, "WINDOW_ROWS", 711)
    parts = rrd.write_rrd(hop, tmp_path / "parts.rrd", [hop])
    ours, theirs = viz_rrd.temporal(parts), viz_rrd.temporal(whole)
    assert ours.keys() == theirs.keys()
    for path, columns in theirs.items():
        order = np.argsort(ours[path]["t"], kind="stable")
        assert len(order) == len(columns["t"]), path
        if not path.startswith(("/series/rating", "/series/lost")):
            for component, rows in columns.items():
                assert [ours[path][component][row] for row in order] == list(rows), path
    properties = "/__properties"
    held = [viz_rrd.static(path) for path in (parts, whole)]
    assert all(each.pop(properties) for each in held)
    assert held[0] == held[1]


@given(st.lists(st.integers(0, 40), min_size=1, max_size=30))
def test_thinned_points_are_evenly_spread(sizes: list[int]) -> None:
    most, seen = 32, ThinnedPoints(32)
    line = np.stack([np.arange(sum(sizes)), -np.arange(sum(sizes))], axis=1).astype(float)
    place = 0
    for size in sizes:
        if size:
            seen.add(line[place : place + size])
            place += size
            np.testing.assert_array_equal(seen.last, line[place - 1 : place])
    if not seen:
        assert place == 0
        return
    kept = seen.points
    assert len(kept) <= most
    steps = np.diff(kept[:, 0])
    assert (steps == steps[:1]).all()
    assert kept[0, 0] == 0
    assert place - kept[-1, 0] <= (steps[0] if len(steps) else 1)
    assert len(kept) > min(place, most) / 2 - 1


def test_a_live_server_has_a_limit_to_its_memory() -> None:
    command = viewer_command(serve=True)
    assert command[command.index("--server-memory-limit") + 1] == "256MB"
