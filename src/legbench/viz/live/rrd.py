"""A run as a file for the viewer: derived from the recording, disposable."""

from collections.abc import Sequence
from pathlib import Path

from legbench.metrics.summary import summarise
from legbench.recording.reader import Recording
from legbench.viz.drafts import draft_of, require_rows
from legbench.viz.facts import facts_of
from legbench.viz.live._rerun import rr
from legbench.viz.live.ghost import other_of
from legbench.viz.live.publish import APPLICATION, Publisher
from legbench.viz.playback import WHOLE, Playback, cut


def write_rrd(
    recording: Recording,
    path: Path,
    against: Sequence[Recording] = (),
    playback: Playback = WHOLE,
) -> Path:
    """Write a run with its layout as an `.rrd` file; an older one is replaced when all is well.

    Args:
        recording: the run.
        path: path of the file.
        against: other runs, shown in the same views from the same t = 0, in its modal convention.
        playback: which rows the file holds, and how the viewer plays them; what came of the run,
            and the numbers of its periods, are those of the whole run.

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
        stream.save(draft)
        publisher = Publisher(stream, facts, others=others, playback=playback)
        publisher.pass_over(cut(recording, slice(0, rows.start)))
        publisher.push(cut(recording, rows))
        publisher.finish()
        publisher.describe(facts, summarise(recording))
        stream.disconnect()
    return path
