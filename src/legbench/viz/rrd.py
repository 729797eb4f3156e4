"""A run as a file for the viewer: derived from the recording, disposable."""

from pathlib import Path

from legbench.metrics.summary import summarise
from legbench.recording.reader import Recording
from legbench.viz._rerun import rr
from legbench.viz.drafts import draft_of, require_rows
from legbench.viz.facts import facts_of
from legbench.viz.publish import APPLICATION, Publisher


def write_rrd(recording: Recording, path: Path) -> Path:
    """Write a run with its layout as an `.rrd` file; an older one is replaced when all is well.

    Raises:
        FormatError: the run's manifest cannot be drawn.
        RecordingError: the run has no rows or a damaged model, or nothing can be written there.
    """
    require_rows(recording)
    facts = facts_of(recording.manifest, recording.path)
    with draft_of(path) as draft:
        stream = rr.RecordingStream(APPLICATION, recording_id=facts.run_id)
        stream.save(draft)
        publisher = Publisher(stream, facts)
        publisher.push(recording)
        publisher.finish()
        publisher.describe(facts, summarise(recording))
        stream.disconnect()
    return path
