"""A part of a run, its speed and its repetition mean the same in every picture."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import imageio.v3 as iio
import mujoco
import numpy as np
import pytest
from viz_rrd import temporal
from viz_runs import part

from legbench.errors import ConfigError, MissingExtraError
from legbench.recording.reader import Recording
from legbench.signals import Floats
from legbench.viz.facts import facts_of
from legbench.viz.film.render import render
from legbench.viz.live.blueprint import blueprint
from legbench.viz.live.mujoco_viewer import FPS, FrameClock, play_run
from legbench.viz.live.rrd import write_rrd
from legbench.viz.playback import WHOLE, Playback, cut
from legbench.viz.pose import PosedModel
from legbench.viz.run_model import model_of

TIME: Floats = np.arange(1000, dtype=np.float64) * 1e-3


def test_a_part_has_the_rows_at_its_times() -> None:
    assert Playback(begin=0.1, end=0.2).rows(TIME) == slice(100, 201)
    assert Playback(begin=0.1004).rows(TIME) == slice(101, 1000)
    assert Playback(end=5.0).rows(TIME) == slice(0, 1000)
    assert WHOLE.rows(TIME) == slice(0, 1000)
    assert Playback(begin=-1.0, end=0.0).rows(TIME) == slice(0, 1)


def test_frames_come_in_step_with_the_speed() -> None:
    assert Playback(begin=0.1, end=0.3, speed=0.5).frames(TIME, 50).tolist() == [
        *range(100, 301, 10)
    ]
    assert Playback(speed=10.0).frames(TIME, 50).tolist() == [0, 200, 400, 600, 800, 999]


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"speed": 0.0}, "speed is 0; it must be 0.001 to 1000"),
        ({"speed": float("nan")}, "speed is nan"),
        ({"begin": 2.0, "end": 1.0}, "from is 2 s, to is 1 s"),
        ({"begin": 1.0, "end": 1.0}, "played forwards"),
        ({"begin": float("inf")}, "from is inf s"),
    ],
)
def test_a_playback_that_makes_no_sense_is_refused(given: dict[str, Any], message: str) -> None:
    with pytest.raises(ConfigError, match=message):
        Playback(**given)


def test_a_part_outside_of_the_run_is_refused() -> None:
    for outside in (Playback(begin=2.0), Playback(begin=-2.0, end=-1.0)):
        with pytest.raises(ConfigError, match=r"nothing lies .*the run lasts from 0 to 0\.999 s"):
            outside.rows(TIME)


def test_a_part_in_the_viewer_is_that_of_the_whole(hop: Recording, tmp_path: Path) -> None:
    """Rows, colours and states are the whole run's; other runs are cut at the same times."""
    some = part(hop, 0, 1200)
    whole = temporal(write_rrd(some, tmp_path / "whole.rrd", [some]))
    playback = Playback(begin=0.6, end=0.9)
    found = temporal(write_rrd(some, tmp_path / "part.rrd", [some], playback))
    for entity in ("/series/joint/link", "/series/joint/other_1", "/series/torque"):
        assert (found[entity]["t"][0], found[entity]["t"][-1]) == (0.6, 0.9)
        rows = slice(600, 901)
        np.testing.assert_array_equal(whole[entity]["t"][rows], found[entity]["t"])
        assert whole[entity]["scalars"][rows] == found[entity]["scalars"]
    for entity, content in found.items():
        assert content["t"].min() >= 0.6 - 1e-9, entity
        assert content["t"].max() <= 0.9 + 1e-9, entity


def test_the_viewer_plays_at_the_speed_that_was_asked_for(hop: Recording) -> None:
    facts = facts_of(hop.description)
    slow = blueprint(facts, room=(0.0, 1.0), playback=Playback(speed=0.25, loop=True)).time_panel
    assert (slow.playback_speed, slow.play_state, slow.loop_mode) == (0.25, "playing", "all")
    once = blueprint(facts, room=(0.0, 1.0), playback=Playback(begin=0.5)).time_panel
    assert (once.playback_speed, once.loop_mode) == (1.0, "off")
    usual = blueprint(facts, room=(0.0, 1.0)).time_panel
    assert (usual.playback_speed, usual.play_state, usual.loop_mode) == (None, None, None)


class FakeWindow:
    """A window that is closed after some frames, on a clock of its own."""

    def __init__(self, frames: int) -> None:
        self.frames, self.time, self.slept = frames, 0.0, 0
        self.shown: list[tuple[float, np.ndarray]] = []
        self.data: mujoco.MjData | None = None

    def is_running(self) -> bool:
        return len(self.shown) < self.frames and self.slept < self.frames

    def sync(self) -> None:
        assert self.data is not None
        self.shown.append((self.time, self.data.qpos.copy()))

    def sleep(self, seconds: float) -> None:
        self.slept += seconds == 1.0 / FPS
        self.time += seconds

    @contextmanager
    def opened(self, model: mujoco.MjModel, data: mujoco.MjData) -> Iterator["FakeWindow"]:
        self.data = data
        yield self


def played(run: Recording, playback: Playback, frames: int) -> FakeWindow:
    window = FakeWindow(frames)
    clock = FrameClock(now=lambda: window.time, sleep=window.sleep)
    play_run(run, playback, window=window.opened, clock=clock)
    return window


def test_mujocos_viewer_shows_the_part_at_its_speed(hop: Recording) -> None:
    playback = Playback(begin=0.5, end=0.7, speed=0.5)
    window = played(hop, playback, 100)
    times = [time for time, _ in window.shown]
    assert len(times) == 25
    np.testing.assert_allclose(np.diff(times), 1.0 / FPS)
    posed = PosedModel(model_of(hop.description))
    rows = playback.frames(hop.time, FPS)
    wanted = posed.positions(posed.hip(hop["trunk_pos"])[rows], hop["joint_pos"][rows])
    np.testing.assert_array_equal([qpos for _, qpos in window.shown], wanted)


def test_mujocos_viewer_begins_again_until_it_is_closed(hop: Recording) -> None:
    window = played(hop, Playback(begin=0.5, end=0.6, loop=True), 17)
    assert len(window.shown) == 17
    np.testing.assert_array_equal(window.shown[7][1], window.shown[0][1])
    np.testing.assert_allclose(np.diff([time for time, _ in window.shown]), 1.0 / FPS)


def test_no_display_is_told(hop: Recording, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    with pytest.raises(MissingExtraError, match="no display: write a video with `legbench render`"):
        play_run(hop)


@pytest.mark.parametrize(
    ("name", "playback", "message"),
    [
        ("a.mp4", Playback(loop=True), r"a \.mp4 does not begin again by itself"),
        ("a.png", Playback(speed=2.0), r"a \.png stands still"),
    ],
)
def test_what_a_file_cannot_do_is_refused(
    name: str, playback: Playback, message: str, hop: Recording, tmp_path: Path
) -> None:
    with pytest.raises(ConfigError, match=message):
        render(hop, tmp_path / name, playback=playback)
    with pytest.raises(ConfigError, match="is one instant"):
        render(hop, tmp_path / "b.png", time=0.5, playback=Playback(begin=0.1))
    assert list(tmp_path.iterdir()) == []


def test_a_video_of_a_part_is_slow_and_short(hop: Recording, tmp_path: Path) -> None:
    pytest.importorskip("OpenGL")
    try:
        path = render(hop, tmp_path / "a.gif", playback=Playback(begin=0.5, end=0.7, speed=0.5))
    except MissingExtraError:
        pytest.skip("no OpenGL without a display")
    assert iio.improps(path, plugin="pillow").n_images == 9


def test_cut_rows_are_a_run_of_their_own(hop: Recording) -> None:
    some = cut(hop, slice(10, 20))
    np.testing.assert_array_equal(some["joint_pos"], hop["joint_pos"][10:20])
    assert some.path == hop.path
    assert [each.time[0] for each in Playback(begin=1.0).parts([hop, some])] == [1.0]
