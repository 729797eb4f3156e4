"""A run as a video, an animation or a series of stills, drawn from its own MuJoCo model."""

from collections.abc import Callable, Iterable, Iterator
from pathlib import Path

import numpy as np

from legbench.errors import ConfigError
from legbench.metrics.analysis import Analysis
from legbench.metrics.periods import STILL as AT_REST
from legbench.recording.reader import Recording
from legbench.signals import Ints
from legbench.viz.drafts import draft_of
from legbench.viz.film._imageio import Image as Picture
from legbench.viz.film._imageio import av
from legbench.viz.film.frames import Film, Size
from legbench.viz.film.labels import labelled
from legbench.viz.film.offscreen import Image
from legbench.viz.playback import WHOLE, Playback

SUFFIXES = (".mp4", ".gif", ".png")
VIDEO, ANIMATION = Size(width=800, height=600), Size(width=480, height=360)
FRAME, STILL = Size(width=960, height=720), Size(width=240, height=420)
VIDEO_FPS, ANIMATION_FPS = 30, 20
"""Frame rates [1/s]: GIF counts in hundredths of a second, so 20 is exact there and 30 is not."""
PRESET = "veryfast"
"""Preset of the encoder: a third of the usual time, for files that are hardly larger."""
GAP = 3
"""Gap between two stills of a series [pixels]."""
SAME = 0.999
"""Share of the widest period's amplitude from which on a period counts as being as wide [-]."""
STILLS = 7
"""Number of stills in a series from one lower apex to the next, as in Fig. 7."""

Progress = Callable[[int, int], None]
"""Callback of a rendering's progress: number of frames done, number of frames in all."""


def render(
    recording: Recording,
    path: Path,
    *,
    time: float | None = None,
    progress: Progress | None = None,
    playback: Playback = WHOLE,
) -> Path:
    """Draw a run: .mp4 and .gif as a film, .png as stills of one jump, of one period, or of a part.

    Args:
        recording: the run, whose folder holds its model.
        path: file to write; an older one is replaced when the new one is whole.
        time: instant to draw, for a .png of a single one [s].
        progress: called after each frame.
        playback: part of the run that is drawn, and its speed; a .gif always begins again.

    Raises:
        ConfigError: another suffix, a `time` that is outside the run or not for a .png, or a
            playback that the run or the kind of file does not have.
        RecordingError: the run has no rows, or nothing can be written there.
        MissingExtraError: the machine has no OpenGL that works.
    """
    kind = path.suffix.lower()
    if kind not in SUFFIXES:
        known = ", ".join(SUFFIXES)
        raise ConfigError(f"a run cannot be rendered as {path.name!r}; choose from {known}")
    if time is not None and kind != ".png":
        raise ConfigError(f"time = {time:g} s draws one frame; write it to a .png, not a {kind}")
    _check_playback(kind, playback, time)
    film = Film(recording)
    with draft_of(path) as draft:
        if kind == ".png":
            rows = _still_rows(recording, playback) if time is None else _row_at(recording, time)
            _write_stills(draft, film, rows, progress, single=time is not None)
        else:
            fps, size = (VIDEO_FPS, VIDEO) if kind == ".mp4" else (ANIMATION_FPS, ANIMATION)
            rows = playback.frames(recording.time, fps)
            # In a video nobody sees the steps of an edge, and everybody waits for it.
            images = _shots(film, rows, size, smooth=kind == ".gif")
            write = _write_video if kind == ".mp4" else _write_animation
            write(draft, _told(images, len(rows), progress))
    return path


def _shots(
    film: Film, rows: Ints, size: Size, *, follow: bool = True, smooth: bool = True
) -> Iterator[Image]:
    """Images of the rows, each with its time and with the scale in its lower left corner."""
    scale = film.scale(size)
    images = film.shoot(rows, size, follow=follow, smooth=smooth)
    for row, image in zip(rows.tolist(), images, strict=True):
        yield labelled(image, float(film.time[row]), scale)


def _check_playback(kind: str, playback: Playback, time: float | None) -> None:
    """Refuse what a kind of file cannot do; raises ConfigError."""
    if playback.loop and kind != ".gif":
        raise ConfigError(f"a {kind} does not begin again by itself: write a .gif, or leave loop")
    if playback.speed != WHOLE.speed and kind == ".png":
        raise ConfigError(f"speed is {playback.speed:g}; a .png stands still: write .mp4 or .gif")
    if time is not None and not playback.whole:
        raise ConfigError(f"time = {time:g} s is one instant; leave from and to out")


def _told(images: Iterable[Image], count: int, progress: Progress | None) -> Iterator[Image]:
    for done, image in enumerate(images, start=1):
        yield image
        if progress is not None:
            progress(done, count)


def _write_video(path: Path, images: Iterator[Image]) -> None:
    with av.open(str(path), "w") as file:
        stream = file.add_stream("libx264", rate=VIDEO_FPS, options={"preset": PRESET})
        stream.width, stream.height, stream.pix_fmt = VIDEO.width, VIDEO.height, "yuv420p"
        for image in images:
            file.mux(stream.encode(av.VideoFrame.from_ndarray(image, format="rgb24")))
        file.mux(stream.encode())


def _write_animation(path: Path, images: Iterator[Image]) -> None:
    pictures = (Picture.fromarray(image).quantize(128) for image in images)
    first = next(pictures)
    first.save(
        path,
        format="GIF",
        save_all=True,
        append_images=pictures,
        duration=1000 // ANIMATION_FPS,
        loop=0,
    )


def _write_stills(
    path: Path,
    film: Film,
    rows: Ints,
    progress: Progress | None,
    *,
    single: bool,
) -> None:
    size = FRAME if single else STILL
    images = list(_told(_shots(film, rows, size, follow=False), len(rows), progress))
    white = np.full((size.height, GAP, 3), 255, dtype=np.uint8)
    strip = np.concatenate([part for image in images for part in (white, image)][1:], axis=1)
    Picture.fromarray(strip).save(path, format="PNG")


def _row_at(recording: Recording, time: float) -> Ints:
    first, last = recording.time[0], recording.time[-1]
    if not first <= time <= last:
        raise ConfigError(f"time is {time:g} s; the run lasts from {first:g} to {last:g} s")
    return np.atleast_1d(np.searchsorted(recording.time, time))


def _still_rows(recording: Recording, playback: Playback) -> Ints:
    """Rows of the stills, evenly spread over a part of the run that was asked for.

    Otherwise they show the last jump; without jumps the widest period, which is the first of a step
    that dies away, and one of the last of an oscillation that builds up.
    """
    begin, end = playback.span(recording.time) if not playback.whole else stills_span(recording)
    instants = np.linspace(begin, end, STILLS)
    return np.minimum(np.searchsorted(recording.time, instants), len(recording.time) - 1)


def stills_span(recording: Recording) -> tuple[float, float]:
    """Begin and end of the last jump, of the widest period, or of the motion without either [s]."""
    run = Analysis(recording)
    jumps, periods = run.gait.jumps, run.periods
    if len(jumps):
        return float(jumps.start[-1]), float(jumps.end[-1])
    if len(periods):
        # Turning points lie between rows: periods as wide as the widest but for that are as good.
        widest = int(np.flatnonzero(periods.amplitude > SAME * periods.amplitude.max())[-1])
        return float(periods.start[widest]), float(periods.end[widest])
    rate = np.abs(run.trajectory.modal_rate[:, 1])
    moving = np.flatnonzero(rate > AT_REST * rate.max(initial=0.0))
    begin, end = (moving[0], moving[-1]) if len(moving) > 1 else (0, -1)
    return float(run.time[begin]), float(run.time[end])
