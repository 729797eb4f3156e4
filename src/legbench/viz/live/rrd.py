"""A run as a file for the viewer: derived from the recording, disposable."""

from collections.abc import Sequence
from pathlib import Path

from legbench.metrics.summary import Summary, summarise
from legbench.metrics.window import RowWindow
from legbench.recording.reader import Recording
from legbench.viz.drafts import draft_of, require_rows
from legbench.viz.facts import facts_of
from legbench.viz.live._rerun import rr
from legbench.viz.live.overlay import other_of
from legbench.viz.live.publish import APPLICATION, WINDOW_ROWS, Publisher
from legbench.viz.live.rrd_sink import saved
from legbench.viz.playback import WHOLE, Playback, cut


def write_rrd(
    recording: Recording,
    path: Path,
    against: Sequence[Recording] = (),
    playback: Playback = WHOLE,
    *,
    summary: Summary | None = None,
) -> Path:
    """Write a run with its layout as an `.rrd` file; an older one is replaced when all is well.

    Args:
        recording: the run.
        path: path of the file.
        against: other runs, shown in the same views from the same t = 0, in its modal convention.
        playback: which rows the file holds, and how the viewer plays them; what came of the run,
            and the numbers of its periods, are those of the whole run.
        summary: the run's figures, where they are known already.

    Raises:
        ConfigError: the run has no rows at the times that are to be played.
        FormatError: a run describes no leg that can be drawn.
        RecordingError: a run has no rows, or nothing can be written there.
    """
    for run in (recording, *against):
        require_rows(run)
    facts = facts_of(recording.description)
    rows = playback.rows(recording.time)
    shown = enumerate(playback.parts(against))
    others = [other_of(run, place, facts) for place, run in shown]
    with draft_of(path) as draft:
        stream = rr.RecordingStream(APPLICATION, recording_id=facts.run.id)
        with saved(stream, draft):
            publisher = Publisher(stream, facts, others=others, playback=playback, rows=WINDOW_ROWS)
            publisher.lay_out(RowWindow(recording, rows.start, rows.stop))
            _push(publisher, recording, rows)
            publisher.finish()
            publisher.describe(facts, summarise(recording) if summary is None else summary)
    return path


def _push(publisher: Publisher, recording: Recording, rows: slice) -> None:
    """Publish some rows of a run in windows, after those before them have been passed over."""
    first = 0
    for part in recording.windows(WINDOW_ROWS):
        begin, end = (min(max(row - first, 0), len(part.time)) for row in (rows.start, rows.stop))
        publisher.pass_over(cut(part, slice(0, begin)))
        publisher.push(cut(part, slice(begin, end)))
        first += len(part.time)
