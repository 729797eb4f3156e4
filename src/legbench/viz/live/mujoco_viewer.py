"""MuJoCo's own viewer, to look at a model and pull at it, and to see a run again."""

import time
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager
from dataclasses import dataclass
from typing import Final, Protocol

import mujoco

from legbench.errors import ConfigError, MissingExtraError
from legbench.recording.reader import Recording
from legbench.signals import Floats
from legbench.viz.display import has_display
from legbench.viz.drafts import require_rows
from legbench.viz.facts import facts_of
from legbench.viz.hip import hip_of
from legbench.viz.playback import WHOLE, Playback
from legbench.viz.pose import PosedModel
from legbench.viz.run_model import model_of

try:
    import mujoco.viewer
except ImportError as error:
    raise MissingExtraError(
        "glfw is not installed; MuJoCo's viewer needs it: pip install 'legbench[render]'"
    ) from error

FPS: Final = 60.0
"""Frames that are shown of a run [1/s]."""


class Window(Protocol):
    """The part of MuJoCo's passive viewer that a run needs."""

    def is_running(self) -> bool:
        """Whether the window is still open."""
        ...

    def sync(self) -> None:
        """Show the data as it is now."""
        ...


Open = Callable[[mujoco.MjModel, mujoco.MjData], AbstractContextManager[Window]]


@dataclass(frozen=True, slots=True, kw_only=True)
class FrameClock:
    """Time by which frames are shown."""

    now: Callable[[], float] = time.perf_counter
    """Present time [s]."""
    sleep: Callable[[float], None] = time.sleep
    """Wait for so long [s]."""


def view_model(xml: str) -> None:
    """Show a model in a window until it is closed.

    Raises:
        MissingExtraError: there is no display.
        ConfigError: MuJoCo refuses the model.
    """
    if not has_display():
        raise MissingExtraError(
            "no display: write the model with --out FILE and open it on a machine that has one"
        )
    try:
        model = mujoco.MjModel.from_xml_string(xml)
    except ValueError as error:
        raise ConfigError(f"MuJoCo refuses the model: {error}") from error
    mujoco.viewer.launch(model)


def play_run(
    recording: Recording,
    playback: Playback = WHOLE,
    *,
    window: Open = mujoco.viewer.launch_passive,
    clock: FrameClock | None = None,
) -> None:
    """Show a run in a window until it is closed; at its end the last posture stays.

    Args:
        recording: the run.
        playback: part of it, speed, and whether it begins again.
        window: what opens the window.
        clock: time of the frames, by default the machine's.

    Raises:
        MissingExtraError: there is no display.
        FormatError: the run describes no model that can be drawn.
        RecordingError: it has no rows.
        ConfigError: it has none at the times that are to be played.
    """
    if window is mujoco.viewer.launch_passive and not has_display():
        raise MissingExtraError(
            "no display: write a video with `legbench render`, or open the run on a machine that "
            "has one"
        )
    require_rows(recording)
    posed, clock = PosedModel(model_of(recording.description)), clock or FrameClock()
    rows = playback.frames(recording.time, FPS)
    hip = posed.hip(hip_of(recording, facts_of(recording.description)))[rows]
    postures = posed.positions(hip, recording["joint_pos"][rows])
    with window(posed.model, posed.data) as shown:
        for qpos in _paced(postures, playback.loop, shown, clock):
            posed.data.qpos[:] = qpos
            mujoco.mj_forward(posed.model, posed.data)
            shown.sync()
        while shown.is_running():
            clock.sleep(1.0 / FPS)


def _paced(postures: Floats, loop: bool, window: Window, clock: FrameClock) -> Iterator[Floats]:
    """Yield postures (n, nq) in step with the time while the window is open, once or in a loop."""
    began, shown = clock.now(), 0
    while True:
        for qpos in postures:
            if not window.is_running():
                return
            clock.sleep(max(0.0, began + shown / FPS - clock.now()))
            yield qpos
            shown += 1
        if not loop:
            return
