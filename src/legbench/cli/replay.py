"""`legbench replay`: a recorded run, rated again, shown, and made to happen again."""

import os
import tempfile
from contextlib import suppress
from pathlib import Path

from legbench.cli.output import note, print_json
from legbench.cli.parse import parse
from legbench.cli.replay_again import Again, print_again, replayed
from legbench.cli.replay_arguments import ReplayArguments
from legbench.cli.replay_source import loaded, source_of
from legbench.cli.table import print_comparison, print_summary
from legbench.metrics import Analysis, Comparison, Summary, compare, summarise
from legbench.recording.reader import Recording

SHOWN = 4
"""Largest number of entries in which two experiments differ that a note lists."""


def main(arguments: list[str]) -> int:
    """Run `legbench replay`.

    Returns:
        0, also for a run that a fault has ended; 1 when the recorded controller gives other
        commands than were recorded.
    """
    chosen = parse(ReplayArguments, "replay", arguments)
    chosen.check()
    recording = source_of(chosen)
    others = [loaded(path) for path in chosen.against]
    again = replayed(recording, chosen)
    if again is not None and again.moved is not None:
        others.append(again.moved)
    run, *against = [Analysis(each) for each in (recording, *others)]
    summary = summarise(run)
    comparisons = [_compared(run, other) for other in against[: len(chosen.against)]]
    if chosen.figure is not None:
        _draw(chosen, run, against, again)
    if chosen.json:
        added = {"against": [each.to_json() for each in comparisons]} if comparisons else {}
        added |= {} if again is None else {"replay": again.to_json()}
        print_json(summary.to_json() | added)
    else:
        print_summary(summary)
        for comparison in comparisons:
            print_comparison(comparison)
        if again is not None:
            print_again(again)
    if chosen.rrd is not None or chosen.view or chosen.serve:
        # Signals that were read for the figures make room for those that are shown.
        del run, against
        show(recording, others, chosen, summary)
    if chosen.mujoco:
        from legbench.viz.live.mujoco_viewer import play_run

        play_run(recording, chosen.playback.playback)
    return 0 if again is None else again.status


def _compared(run: Analysis, other: Analysis) -> Comparison:
    comparison = compare(run, other)
    if unlike := comparison.unlike:
        listed = ", ".join(unlike[:SHOWN]) + (
            f" and {len(unlike) - SHOWN} more entries" if len(unlike) > SHOWN else ""
        )
        note(f"legbench: {comparison.other} is another experiment: it differs in {listed}")
    return comparison


def _draw(
    chosen: ReplayArguments, run: Analysis, against: list[Analysis], again: Again | None
) -> None:
    """Write the figure: of a replay its signals over time, else the planes of the runs."""
    from legbench.viz.print.save import save_figure

    if chosen.figure is None:
        return
    if again is None:
        from legbench.viz.print.figures import phase_figure

        figure = phase_figure(run, against)
    else:
        from legbench.viz.print.replays import replay_figure

        figure = replay_figure(again.signals, f"{run.path.name}: {again.title}")
    note(f"wrote {save_figure(figure, chosen.figure)}")


def show(
    recording: Recording, others: list[Recording], chosen: ReplayArguments, summary: Summary
) -> None:
    """Write the rerun file, and open it where that was asked for."""
    from legbench.viz.live.rrd import write_rrd
    from legbench.viz.live.viewer import open_viewer

    playback, watched = chosen.playback.playback, chosen.view or chosen.serve
    rrd = chosen.rrd or _beside(recording.path, watched)
    write_rrd(recording, rrd, others, playback, summary=summary)
    note(f"wrote {rrd}")
    if not watched:
        return
    viewer = open_viewer(rrd, serve=chosen.serve)
    if viewer.url is not None:
        note(f"look at {viewer.url}; ^C ends it")
        with suppress(KeyboardInterrupt):
            viewer.wait()
        viewer.stop()


def _beside(run: Path, watched: bool) -> Path:
    """File for the viewer in the folder of a run, or elsewhere where that is read-only."""
    path = run / "view.rrd" if run.is_dir() else run.with_suffix(".rrd")
    if not watched or os.access(path.parent, os.W_OK):
        return path
    folder = Path(tempfile.mkdtemp(prefix="legbench-"))
    note(f"legbench: {path.parent} cannot be written; what the viewer reads goes to {folder}")
    return folder / f"{run.stem}.rrd"
