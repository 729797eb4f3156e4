"""`legbench render`: a video or a picture of a recorded run."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated

from tyro.conf import Positional

from legbench.cli.output import note, print_json, timed_progress
from legbench.cli.parse import parse
from legbench.cli.playback_arguments import PlaybackArguments
from legbench.recording.reader import load


@dataclass(frozen=True, slots=True, kw_only=True)
class RenderArguments:
    """Draw a recorded run with MuJoCo's renderer; needs no display."""

    run: Annotated[Path, Positional]
    """Run folder."""
    out: Path = Path("leg.mp4")
    """File to write: .mp4, .gif, or .png for stills of one jump."""
    time: float | None = None
    """Time of the one instant to draw instead, .png only [s]."""
    playback: PlaybackArguments = field(default_factory=PlaybackArguments)
    json: bool = False
    """Print one JSON object on stdout: the file."""


def main(arguments: list[str]) -> int:
    """Run `legbench render`."""
    chosen = parse(RenderArguments, "render", arguments)
    playback = chosen.playback.playback
    recording = load(chosen.run)
    from legbench.viz.film.render import render

    written = render(
        recording, chosen.out, time=chosen.time, progress=timed_progress(), playback=playback
    )
    note(f"wrote {written}")
    if chosen.json:
        print_json({"out": str(written)})
    return 0
