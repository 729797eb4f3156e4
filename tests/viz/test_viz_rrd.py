from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import rerun as rr
import viz_rrd
from viz_runs import PROTOTYPE, part, record

from legbench.control.jump_rules import JumpPhase
from legbench.design.setup import SetupKind
from legbench.errors import FormatError, RecordingError
from legbench.kinematics import joint_to_modal, joint_to_polar, leg_points
from legbench.metrics.analysis import Analysis
from legbench.metrics.source import Reference
from legbench.recording.reader import Recording, described
from legbench.viz.facts import facts_of
from legbench.viz.live.axes import HEIGHT, WIDTH
from legbench.viz.live.publish import APPLICATION, Publisher
from legbench.viz.live.rrd import write_rrd

Entities = dict[str, dict[str, Any]]


@pytest.fixture(scope="module")
def hop_file(hop: Recording, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_rrd(hop, tmp_path_factory.mktemp("rrd") / "hop.rrd")


@pytest.fixture(scope="module")
def shown(hop_file: Path) -> Entities:
    return viz_rrd.temporal(hop_file)


@pytest.fixture(scope="module")
def fixed(hop_file: Path) -> Entities:
    return viz_rrd.static(hop_file)


def test_series_hold_every_row_unchanged(hop: Recording, shown: Entities) -> None:
    for path, signal in (
        ("/series/joint/link", "joint_pos"),
        ("/series/joint/target", "command_pos"),
        ("/series/torque", "spring_torque"),
        ("/series/force", "contact_force"),
        ("/series/energy", "energy"),
        ("/series/cycle/cycle", "cycle_us"),
    ):
        values = np.array(shown[path]["scalars"]).reshape(hop[signal].shape)
        np.testing.assert_array_equal(values, hop[signal])
        np.testing.assert_allclose(shown[path]["t"], hop.time, atol=1e-9)


def test_trails_are_raw_values_at_200_hz(hop: Recording, shown: Entities) -> None:
    joint = hop["joint_pos"]
    z2 = joint_to_modal(joint)[:, 1]
    rate = joint_to_modal(hop["joint_vel"])[:, 1]
    planes = {
        "polar": joint_to_polar(joint, PROTOTYPE.shank.length),
        "joint": joint,
        "periods": np.stack([z2, rate], axis=-1),
        "phases": np.stack([z2, rate], axis=-1),
    }
    for name, points in planes.items():
        trail = shown[f"/plots/{name}/data/trail"]
        strips = np.array(trail["strips"]).reshape(-1, 2, 2)
        np.testing.assert_allclose(trail["t"], hop.time[::5], atol=1e-9)
        np.testing.assert_allclose(strips[:, 1], points[::5], rtol=1e-6, atol=1e-6)
        np.testing.assert_array_equal(strips[1:, 0], strips[:-1, 1])
        head = np.array(shown[f"/plots/{name}/data/head"]["positions"]).reshape(-1, 2)
        np.testing.assert_array_equal(head, strips[:, 1])


def test_axes_put_the_run_into_the_box_with_y_up(hop: Recording, fixed: Entities) -> None:
    points = joint_to_polar(hop["joint_pos"], PROTOTYPE.shank.length)
    stretch = fixed["/plots/polar/data"]
    matrix = np.array(stretch["mat3x3"][0]).reshape(3, 3).T
    placed = points @ matrix[:2, :2].T + np.array(stretch["translation"][0])[:2]
    assert np.all(placed[:, 0] > 0.0)
    assert np.all(placed[:, 0] < WIDTH)
    assert np.all(placed[:, 1] < 0.0)
    assert np.all(placed[:, 1] > -HEIGHT)
    assert placed[np.argmax(points[:, 1]), 1] == placed[:, 1].min()


def test_ticks_stand_where_their_values_are(fixed: Entities) -> None:
    labels = fixed["/plots/periods/axes/labels"]
    stretch = fixed["/plots/periods/data"]
    scale = np.array(stretch["mat3x3"][0]).reshape(3, 3)[0, 0]
    offset = stretch["translation"][0][0]
    on_x = [
        (float(text), place[0])
        for text, place in zip(labels["labels"], labels["positions"], strict=True)
        if place[1] == pytest.approx(0.14)
    ]
    assert len(on_x) >= 3
    for value, place in on_x:
        assert place == pytest.approx(value * scale + offset, abs=1e-4)


def test_joint_space_has_equal_axes_and_both_modes(fixed: Entities) -> None:
    matrix = np.array(fixed["/plots/joint/data"]["mat3x3"][0]).reshape(3, 3)
    assert matrix[0, 0] == pytest.approx(-matrix[1, 1])
    modes = np.array(fixed["/plots/joint/data/modes"]["strips"])
    slopes = (modes[:, 1, 1] - modes[:, 0, 1]) / (modes[:, 1, 0] - modes[:, 0, 0])
    np.testing.assert_allclose(slopes, [1.0, -1.0], rtol=1e-5)
    assert fixed["/plots/joint/data/modes/names"]["labels"] == ["w1", "w2"]


def test_leg_stands_where_the_kinematics_put_it(hop: Recording, shown: Entities) -> None:
    points = hop["trunk_pos"][:, None] + leg_points(hop["joint_pos"], PROTOTYPE.lengths)
    segments = np.array(shown["/leg/plane/segments"]["strips"]).reshape(-1, 4, 2)
    np.testing.assert_allclose(segments, points[::10], atol=1e-7)
    np.testing.assert_allclose(shown["/leg/plane/segments"]["t"], hop.time[::10], atol=1e-9)
    green = np.array(shown["/leg/plane/bar_green"]["strips"]).reshape(-1, 3, 2)
    shank = points[::10, 2] - points[::10, 1]
    pivot = points[::10, 1] + 0.02 * shank / PROTOTYPE.shank.length
    np.testing.assert_allclose(green[:, 2], pivot, atol=1e-7)


def test_states_change_when_they_change(hop: Recording, shown: Entities) -> None:
    contact, phase = hop["contact"], hop["phase"]
    foot = shown["/states/foot"]
    changes = np.flatnonzero(np.diff(contact, prepend=~contact[:1]))
    np.testing.assert_allclose(foot["t"], hop.time[changes], atol=1e-9)
    names = [state[0] for state in foot["state"]]
    assert names == ["stance" if contact[row] else "flight" for row in changes]
    controller = shown["/states/controller"]
    changes = np.flatnonzero(np.diff(phase, prepend=-1))
    assert [state[0] for state in controller["state"]] == [
        JumpPhase(phase[row]).name.lower() for row in changes
    ]


def check_ratings(run: Recording, shown: Entities) -> None:
    """Compare what is shown about both references with the metrics."""
    for reference in Reference:
        ratings = asdict(Analysis(run).ratings.about(reference))
        for name in ("stance", "flight"):
            values = np.array(shown[f"/series/rating/{reference.value}/{name}"]["scalars"]).ravel()
            np.testing.assert_allclose(values, ratings[name], rtol=1e-12)
            lost = np.array(shown[f"/series/lost/{reference.value}/{name}"]["scalars"]).ravel()
            np.testing.assert_allclose(10.0**lost, 1.0 - np.array(ratings[name]), rtol=1e-6)


def test_ratings_are_those_of_the_metrics(hop: Recording, shown: Entities) -> None:
    check_ratings(hop, shown)


def test_contact_that_chatters_splits_no_rating(hop: Recording, tmp_path: Path) -> None:
    contact = np.asarray(hop["contact"], dtype=bool)
    chatter = np.random.default_rng(8)
    for event in np.flatnonzero(np.diff(contact))[:-1]:
        contact[event - 4 : event + 5] = chatter.random(9) < 0.5
    rough = replace(hop, columns={**hop.columns, "contact": contact.astype(np.int8)})
    check_ratings(rough, viz_rrd.temporal(write_rrd(rough, tmp_path / "rough.rrd")))


@pytest.mark.parametrize("landed_ms", [3, 20])
def test_a_foot_that_bounces_splits_no_rating(
    hop: Recording, landed_ms: int, tmp_path: Path
) -> None:
    contact = np.asarray(hop["contact"], dtype=bool)
    for touchdown in Analysis(hop).gait.flight.stop.tolist()[:-1]:
        contact[touchdown : touchdown + landed_ms] = True
        contact[touchdown + landed_ms : touchdown + landed_ms + 18] = False
        contact[touchdown + landed_ms + 18] = True
    bounced = replace(hop, columns={**hop.columns, "contact": contact.astype(np.int8)})
    assert len(Analysis(bounced).gait.flight) == len(Analysis(hop).gait.flight)
    check_ratings(bounced, viz_rrd.temporal(write_rrd(bounced, tmp_path / "bounced.rrd")))


def test_facts_tell_design_controller_and_ratings(fixed: Entities) -> None:
    text = fixed["/run"]["text"][0]
    for words in ("prototype · jump · z2 = 1, dz2 = 0.15", "P^r stance", "64 + 133 + 69 mm"):
        assert words in text


@pytest.mark.parametrize("name", ["hop", "swing", "real_hop"])
def test_slices_publish_what_the_whole_run_publishes(
    name: str, tmp_path: Path, request: pytest.FixtureRequest
) -> None:
    run: Recording = request.getfixturevalue(name)
    whole = viz_rrd.temporal(write_rrd(run, tmp_path / "whole.rrd"))
    stream = rr.RecordingStream(APPLICATION, recording_id="slices")
    stream.save(tmp_path / "slices.rrd")
    publisher = Publisher(stream, facts_of(run.description), live=True)
    for first in range(0, len(run.time), 333):
        publisher.push(part(run, first, first + 333))
    publisher.finish()
    stream.disconnect()
    slices = viz_rrd.temporal(tmp_path / "slices.rrd")
    assert slices.keys() == whole.keys()
    for path, columns in whole.items():
        order = np.argsort(slices[path]["t"], kind="stable")
        for component, rows in columns.items():
            got = [slices[path][component][row] for row in order]
            if component == "scalars" and path.startswith(("/series/rating", "/series/lost")):
                np.testing.assert_allclose(np.array(got), np.array(rows), rtol=1e-9)
            elif component == "t":
                np.testing.assert_array_equal(got, rows)
            else:
                assert got == rows, (path, component)


def test_a_real_leg_shows_no_truth(real_hop: Recording, tmp_path: Path) -> None:
    shown = viz_rrd.temporal(write_rrd(real_hop, tmp_path / "real.rrd"))
    for path in ("/series/force", "/series/energy", "/series/height", "/leg/plane/force"):
        assert path not in shown
    tips = np.array(shown["/leg/plane/tip"]["positions"])
    np.testing.assert_allclose(tips, 0.0, atol=1e-7)


@pytest.mark.parametrize("kind", list(SetupKind))
def test_every_setup_is_drawn(kind: SetupKind, tmp_path: Path) -> None:
    shown = viz_rrd.temporal(write_rrd(record(tmp_path, kind, 300), tmp_path / "run.rrd"))
    assert len(shown["/scene/model/foot"]["t"]) == 30


def test_an_older_file_survives_a_failure(hop: Recording, tmp_path: Path) -> None:
    target = tmp_path / "view.rrd"
    target.write_bytes(b"older")
    moon = {**hop.manifest["experiment"], "setup": {"kind": "moon"}}
    broken = Recording(
        path=tmp_path,
        manifest={},
        described=described({**hop.manifest, "experiment": moon}, tmp_path),
        time=hop.time,
        columns=hop.columns,
        events=(),
    )
    with pytest.raises(FormatError, match=r"setup\.kind is 'moon'"):
        write_rrd(broken, target)
    tables = {**hop.description.experiment, "linkage": {"crank_length": "far"}}
    astray = replace(broken, described=replace(hop.description, experiment=tables))
    with pytest.raises(FormatError, match=r"linkage\.crank_length is 'far'"):
        write_rrd(astray, target)
    assert target.read_bytes() == b"older"
    assert sorted(path.name for path in tmp_path.iterdir()) == ["view.rrd"]


def test_a_run_without_rows_is_refused(hop: Recording, tmp_path: Path) -> None:
    with pytest.raises(RecordingError, match="has no rows"):
        write_rrd(part(hop, 0, 0), tmp_path / "view.rrd")
