import subprocess
import sys
from pathlib import Path

import imageio.v3 as iio
import mujoco
import numpy as np
import pytest
from viz_runs import PROTOTYPE, manifest_of, part, record

from legbench.design.setup import SetupKind
from legbench.errors import ConfigError, MissingExtraError, RecordingError
from legbench.kinematics import leg_points
from legbench.recording.description import describe
from legbench.recording.reader import Recording
from legbench.viz.film.offscreen import OffScreen, backend
from legbench.viz.film.render import FRAME, STILL, STILLS, VIDEO, render
from legbench.viz.pose import PosedModel
from legbench.viz.run_model import model_of


def gl_works() -> bool:
    """Whether this machine can draw without a display; tried in a process that may crash."""
    program = (
        "import mujoco, legbench.viz.film.offscreen as o;"
        "m = mujoco.MjModel.from_xml_string('<mujoco/>');"
        "o.OffScreen(m, 8, 8).__exit__(None, None, None)"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, check=False)
    return done.returncode == 0


@pytest.fixture(scope="module")
def gl() -> None:
    """OpenGL without a display, which is looked for when the first test needs it."""
    if not gl_works():
        pytest.skip("no OpenGL without a display")


needs_gl = pytest.mark.usefixtures("gl")


@pytest.mark.parametrize("kind", list(SetupKind))
def test_the_model_takes_the_recorded_posture(kind: SetupKind, tmp_path: Path) -> None:
    run = record(tmp_path, kind, 300)
    posed = PosedModel(model_of(run.description))
    points = run["trunk_pos"][:, None] + leg_points(run["joint_pos"], PROTOTYPE.lengths)
    for row, qpos in enumerate(posed.positions(run["trunk_pos"], run["joint_pos"])):
        posed.pose(qpos)
        places = [posed.data.body(name).xpos for name in ("thigh", "shank", "foot")]
        places.append(posed.data.site("tip").xpos)
        np.testing.assert_allclose(np.array(places)[:, [0, 2]], points[row], atol=1e-9)
        for loop in ("loop_thigh", "loop_foot"):
            equality = posed.model.equality(loop)
            first, second = equality.obj1id[0], equality.obj2id[0]
            gap = posed.data.site_xpos[first] - posed.data.site_xpos[second]
            assert np.linalg.norm(gap) < 1e-9


def test_a_boom_carries_the_hip_where_it_was() -> None:
    setup = {"kind": "ffs", "boom_radius": 1.2}
    posed = PosedModel(model_of(describe(manifest_of(SetupKind.FFS, setup=setup))))
    hip = np.array([[0.02, 0.21], [-0.03, 0.17]])
    joint = np.array([[-0.6, 0.7], [-0.5, 0.6]])
    for row, qpos in enumerate(posed.positions(hip, joint)):
        posed.pose(qpos)
        np.testing.assert_allclose(posed.data.site("hip").xpos[[0, 2]], hip[row], atol=1e-12)


@needs_gl
def test_a_video_lasts_as_long_as_the_run(hop: Recording, tmp_path: Path) -> None:
    told: list[tuple[int, int]] = []
    path = render(
        part(hop, 300, 501), tmp_path / "a.mp4", progress=lambda done, of: told.append((done, of))
    )
    frames = iio.imread(path, plugin="pyav")
    assert frames.shape == (7, VIDEO.height, VIDEO.width, 3)
    assert told == [(done, 7) for done in range(1, 8)]
    assert [file.name for file in tmp_path.iterdir()] == ["a.mp4"]
    assert np.abs(frames[0].astype(int) - frames[6]).max() > 50


@needs_gl
def test_an_animation_plays_in_real_time(hop: Recording, tmp_path: Path) -> None:
    path = render(part(hop, 0, 301), tmp_path / "a.gif")
    assert iio.improps(path, plugin="pillow").n_images == 7
    assert iio.immeta(path, plugin="pillow")["duration"] == 50


@needs_gl
def test_stills_show_one_jump_and_come_back_to_its_start(hop: Recording, tmp_path: Path) -> None:
    image = iio.imread(render(hop, tmp_path / "a.png"))
    assert image.shape[0] == STILL.height
    stills = [
        image[:, place : place + STILL.width].astype(int)
        for place in range(0, image.shape[1], STILL.width + 3)
    ]
    assert len(stills) == STILLS
    apart = [np.abs(still - stills[0]).mean() for still in stills]
    assert apart[-1] < 0.5 * min(apart[1:-1])


@needs_gl
def test_one_instant_is_one_picture(hop: Recording, tmp_path: Path) -> None:
    first = iio.imread(render(hop, tmp_path / "a.png", time=1.0))
    again = iio.imread(render(hop, tmp_path / "b.png", time=1.0))
    later = iio.imread(render(hop, tmp_path / "c.png", time=1.1))
    assert first.shape == (FRAME.height, FRAME.width, 3)
    np.testing.assert_array_equal(first, again)
    assert np.abs(first.astype(int) - later).max() > 50


def test_wrong_wishes_say_what_is_possible(hop: Recording, tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match=r"'a\.avi'; choose from \.mp4, \.gif, \.png"):
        render(hop, tmp_path / "a.avi")
    with pytest.raises(ConfigError, match=r"time = 1 s draws one frame; write it to a \.png"):
        render(hop, tmp_path / "a.gif", time=1.0)
    with pytest.raises(RecordingError, match="has no rows"):
        render(part(hop, 0, 0), tmp_path / "a.gif")


@needs_gl
def test_a_time_outside_the_run_is_refused(hop: Recording, tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match=r"time is 99 s; the run lasts from 0 to 2\.499 s"):
        render(hop, tmp_path / "a.png", time=99.0)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("wish", ["off", "glfw"])
def test_no_opengl_names_the_packages(wish: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("MUJOCO_GL", wish)
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    with pytest.raises(MissingExtraError, match="install libegl1 and libgl1-mesa-dri"):
        OffScreen(mujoco.MjModel.from_xml_string("<mujoco/>"), 8, 8)


def test_the_backend_is_what_the_machine_has(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("MUJOCO_GL", raising=False)
    monkeypatch.setattr(sys, "platform", "linux")
    for found, expected in (({"EGL", "OSMesa"}, "egl"), ({"OSMesa"}, "osmesa")):
        libraries = frozenset(found)
        monkeypatch.setattr(
            "legbench.viz.film.offscreen.find_library",
            lambda name, known=libraries: name if name in known else None,
        )
        assert backend() == expected
    monkeypatch.setenv("MUJOCO_GL", "osmesa")
    assert backend() == "osmesa"
