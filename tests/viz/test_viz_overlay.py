from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import viz_rrd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from viz_runs import PROTOTYPE, part

from legbench.errors import RecordingError
from legbench.kinematics import joint_to_polar, leg_points
from legbench.metrics.analysis import Analysis
from legbench.metrics.compare import differences
from legbench.recording.reader import Recording, described
from legbench.viz.live.axes import HEIGHT, WIDTH
from legbench.viz.live.rrd import write_rrd
from legbench.viz.print.figures import phase_figure
from legbench.viz.print.overlay import DECADES, LEAST, look_of
from legbench.viz.print.save import save_figure

Entities = dict[str, dict[str, Any]]


def swayed(recording: Recording, by: float, **entries: Any) -> Recording:
    """The same run with other hip angles, made by something else."""
    columns = dict(recording.columns)
    columns["joint_pos_1"] = columns["joint_pos_1"] + by * np.sin(9.0 * recording.time)
    experiment = {**recording.manifest["experiment"], **entries}
    manifest: Mapping[str, Any] = {**recording.manifest, "id": "other", "experiment": experiment}
    path = recording.path.with_name("other")
    return replace(recording, path=path, described=described(dict(manifest), path), columns=columns)


@pytest.fixture(scope="module")
def other(hop: Recording) -> Recording:
    return swayed(hop, 0.3, plant={"kind": "sim"}, linkage={"kind": "reduced"})


def dashed(panel: Axes, place: int) -> np.ndarray:
    """Points of the other run at a place in the order given."""
    (line,) = (line for line in panel.lines if line.get_color() == look_of(place).colour)
    return np.asarray(line.get_xydata())


def legend(figure: Figure) -> list[str]:
    return [text.get_text() for text in figure.legends[0].get_texts()]


def test_the_other_run_is_drawn_over_the_planes(hop: Recording, other: Recording) -> None:
    figure = phase_figure(hop, [other])
    jumps = Analysis(other).gait.jumps
    first, stop = np.searchsorted(other.time, [jumps.start[-3], jumps.end[-1]])
    np.testing.assert_array_equal(dashed(figure.axes[1], 0), other["joint_pos"][first : stop + 1])
    polar = joint_to_polar(other["joint_pos"], PROTOTYPE.shank.length)
    np.testing.assert_array_equal(dashed(figure.axes[0], 0), polar[first : stop + 1])
    assert legend(figure) == [
        "bars / prototype:",
        "stance",
        "flight",
        "earlier",
        "sim / reduced / prototype",
    ]


def test_a_second_row_shows_differences_over_time(hop: Recording, other: Recording) -> None:
    *_, radial, joint = phase_figure(hop, [other]).axes
    apart = differences(hop, other)
    lines = (
        (radial.lines[0], apart.z2),
        (joint.lines[0], apart.joint[:, 0]),
        (joint.lines[1], apart.joint[:, 1]),
    )
    for line, values in lines:
        drawn = np.maximum(np.abs(values), LEAST)
        np.testing.assert_array_equal(line.get_xydata(), np.stack([hop.time, drawn], axis=-1))
    low, high = radial.get_ylim()
    assert low < np.abs(apart.z2).max() < high
    assert low == pytest.approx(10.0**-DECADES * np.abs(apart.z2).max())
    assert [text.get_text() for text in radial.texts] == ["first touchdown"]


def test_a_run_without_others_keeps_its_one_row(hop: Recording) -> None:
    figure = phase_figure(hop, [])
    assert len(figure.axes) == len(phase_figure(hop).axes) == 3
    assert figure.get_figheight() == phase_figure(hop).get_figheight()


@pytest.mark.long
def test_overlays_are_the_same_bytes_each_time(
    hop: Recording, other: Recording, tmp_path: Path
) -> None:
    first, second = (
        save_figure(phase_figure(hop, [other]), tmp_path / name) for name in ("a.png", "b.png")
    )
    assert first.read_bytes() == second.read_bytes()


def test_several_runs_have_looks_and_names_of_their_own(swing: Recording) -> None:
    others = [
        swayed(swing, 0.05, plant={"kind": "sim"}),
        swayed(swing, 0.1, plant={"kind": "can"}),
        swing,
    ]
    figure = phase_figure(swing, others)
    assert len({look_of(place).colour for place in range(3)}) == 3
    for place in range(3):
        assert len(dashed(figure.axes[2], place)) > 1000
    folder = f"bars / prototype {swing.path.name}"
    *named, unrated = legend(figure)
    assert named == [folder, "sim / bars / prototype", "can / bars / prototype", folder]
    assert unrated.startswith("not rated")


def test_other_setups_stubs_and_itself_are_drawn(
    hop: Recording, swing: Recording, real_hop: Recording, tmp_path: Path
) -> None:
    figure = phase_figure(hop, [swing, real_hop, part(hop, 0, 20), part(hop, 0, 1), hop])
    save_figure(figure, tmp_path / "many.png", dpi=60)
    write_rrd(hop, tmp_path / "many.rrd", [swing, real_hop, part(hop, 0, 1), hop])


def test_others_without_rows_are_refused(hop: Recording, tmp_path: Path) -> None:
    with pytest.raises(RecordingError, match="has no rows"):
        phase_figure(hop, [part(hop, 0, 0)])
    with pytest.raises(RecordingError, match="has no rows"):
        write_rrd(hop, tmp_path / "a.rrd", [part(hop, 0, 0)])
    assert list(tmp_path.iterdir()) == []


@pytest.fixture(scope="module")
def overlaid(hop: Recording, other: Recording, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_rrd(hop, tmp_path_factory.mktemp("overlay") / "both.rrd", [other])


def test_the_viewer_has_the_others_joints_trails_and_leg(overlaid: Path, other: Recording) -> None:
    shown = viz_rrd.temporal(overlaid)
    joint = other["joint_pos"]
    series = shown["/series/joint/other_1"]
    np.testing.assert_array_equal(np.array(series["scalars"]).reshape(-1, 2), joint)
    np.testing.assert_allclose(series["t"], other.time, atol=1e-9)
    trail = shown["/plots/joint/data/other_1/trail"]
    strips = np.array(trail["strips"]).reshape(-1, 2, 2)
    np.testing.assert_allclose(strips[:, 1], joint[::5], atol=1e-6)
    np.testing.assert_array_equal(strips[1:, 0], strips[:-1, 1])
    points = other["trunk_pos"][:, None] + leg_points(joint, PROTOTYPE.lengths)
    leg = np.array(shown["/leg/plane/other_1/segments"]["strips"]).reshape(-1, 4, 2)
    np.testing.assert_allclose(leg, points[::10], atol=1e-7)


def test_the_axes_make_room_for_the_others(overlaid: Path, other: Recording) -> None:
    fixed = viz_rrd.static(overlaid)
    points = joint_to_polar(other["joint_pos"], PROTOTYPE.shank.length)
    stretch = fixed["/plots/polar/data"]
    matrix = np.array(stretch["mat3x3"][0]).reshape(3, 3).T
    placed = points @ matrix[:2, :2].T + np.array(stretch["translation"][0])[:2]
    assert placed[:, 0].min() > 0.0
    assert placed[:, 0].max() < WIDTH
    assert placed[:, 1].min() > -HEIGHT
    assert placed[:, 1].max() < 0.0
    (text,) = fixed["/run"]["text"]
    assert "other 1: sim / reduced / prototype, run `other`" in text


def test_the_run_itself_is_as_it_is_alone(overlaid: Path, hop: Recording, tmp_path: Path) -> None:
    both = viz_rrd.temporal(overlaid)
    alone = viz_rrd.temporal(write_rrd(hop, tmp_path / "alone.rrd"))
    assert both.keys() > alone.keys()
    assert all("/other_1" in path for path in both.keys() - alone.keys())
    for path, rows in alone.items():
        assert str(both[path]) == str(rows), path
