from pathlib import Path

import numpy as np
import pytest
import rerun as rr
import viz_rrd
from viz_runs import stream_of

from legbench.errors import RecordingError
from legbench.recording.archive import write_archive
from legbench.recording.layout import STREAM
from legbench.recording.reader import Recording
from legbench.recording.stream import END_MARK, WholeBatches
from legbench.viz.live.follow import CLOSING_LOOKS, Pace, follow
from legbench.viz.live.publish import APPLICATION
from legbench.viz.live.tail import Tail, rows_of


@pytest.mark.parametrize("chunk", [1 << 20, 40_000, 777])
def test_a_growing_stream_is_read_once_whatever_its_tears(
    chunk: int, hop: Recording, tmp_path: Path
) -> None:
    whole = b"".join(stream_of(hop)) + END_MARK
    path = tmp_path / STREAM
    path.touch()
    tail = Tail(path)
    times: list[float] = []
    with path.open("ab", buffering=0) as file:
        for first in range(0, len(whole), chunk):
            assert not tail.ended
            file.write(whole[first : first + chunk])
            if batches := tail.read():
                times += rows_of(batches, hop.description, hop.path).time.tolist()
    assert tail.ended
    assert tail.read() == []
    tail.close()
    np.testing.assert_allclose(times, hop.time, atol=1e-9)


@pytest.mark.parametrize("name", ["hop", "real_hop"])
def test_rows_are_those_of_the_run(
    name: str, tmp_path: Path, request: pytest.FixtureRequest
) -> None:
    run: Recording = request.getfixturevalue(name)
    (tmp_path / STREAM).write_bytes(b"".join(stream_of(run)))
    tail = Tail(tmp_path / STREAM)
    rows = rows_of(tail.read(), run.description, run.path)
    tail.close()
    assert not tail.ended
    assert rows.has_truth == run.has_truth
    for signal in ("joint_pos", "phase", "contact", "contact_force"):
        np.testing.assert_array_equal(rows[signal], run[signal])


class Writer:
    """Plays the run's process: does one thing a look, then goes."""

    def __init__(self, run: Path, steps: list[bytes], *, archive: bool) -> None:
        self.run, self.steps, self.archive = run, steps, archive
        self.looks, self.gone = 0, False

    def wait(self) -> None:
        self.looks += 1
        if self.steps:
            with (self.run / STREAM).open("ab") as file:
                file.write(self.steps.pop(0))
        elif self.archive:
            write_archive(self.run, WholeBatches(self.run / STREAM), {})
            (self.run / STREAM).unlink()
            self.archive = False
        else:
            self.gone = True

    def over(self) -> bool:
        return self.gone


def watched(hop: Recording, folder: Path, writer: Writer) -> tuple[int, dict]:
    (folder / "run.json").write_bytes((hop.path / "run.json").read_bytes())
    stream = rr.RecordingStream(APPLICATION, recording_id="watched")
    stream.save(folder / "live.rrd")
    count = follow(folder, stream, Pace(wait=writer.wait, over=writer.over))
    stream.disconnect()
    return count, viz_rrd.temporal(folder / "live.rrd")


def test_following_ends_with_the_run_and_its_ratings(hop: Recording, tmp_path: Path) -> None:
    steps = [*stream_of(hop), END_MARK]
    (tmp_path / STREAM).write_bytes(steps.pop(0))
    count, shown = watched(hop, tmp_path, Writer(tmp_path, steps, archive=True))
    assert count == len(hop.time)
    np.testing.assert_allclose(shown["/series/joint/link"]["t"], hop.time, atol=1e-9)
    fixed = viz_rrd.static(tmp_path / "live.rrd")
    assert "P^r stance" in fixed["/run"]["text"][0]
    assert len(fixed["/plots/polar/data/backdrop"]["strips"][0]) == len(hop.time[::5])


def test_a_writer_that_was_killed_ends_it_too(hop: Recording, tmp_path: Path) -> None:
    steps = stream_of(hop)[:11]
    steps[-1] = steps[-1][:1000]
    (tmp_path / STREAM).write_bytes(steps.pop(0))
    count, shown = watched(hop, tmp_path, Writer(tmp_path, steps, archive=False))
    assert count == 450
    assert len(shown["/series/joint/link"]["t"]) == 450


def test_a_writer_that_never_closes_is_not_waited_for(hop: Recording, tmp_path: Path) -> None:
    (tmp_path / STREAM).write_bytes(b"".join(stream_of(hop)) + END_MARK)
    writer = Writer(tmp_path, [b""] * 1000, archive=False)
    count, _ = watched(hop, tmp_path, writer)
    assert (count, writer.looks) == (len(hop.time), CLOSING_LOOKS + 1)


def test_a_run_that_is_over_already_is_shown_whole(hop: Recording, tmp_path: Path) -> None:
    writer = Writer(tmp_path, [], archive=True)
    (tmp_path / STREAM).write_bytes(b"".join(stream_of(hop)) + END_MARK)
    writer.wait()
    count, shown = watched(hop, tmp_path, writer)
    assert count == 0
    assert len(shown["/series/joint/link"]["t"]) == len(hop.time)


def test_a_folder_without_a_run_is_refused(tmp_path: Path) -> None:
    stream = rr.RecordingStream(APPLICATION, recording_id="none")
    with pytest.raises(RecordingError, match="is no run folder"):
        follow(tmp_path, stream, Pace(wait=lambda: None, over=lambda: True))
