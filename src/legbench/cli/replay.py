"""`legbench replay`: a recorded run, rated again and shown."""

from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from tyro.conf import Positional, UseAppendAction

from legbench.cli.output import note, print_json
from legbench.cli.parse import parse
from legbench.cli.table import print_comparison, print_summary
from legbench.metrics import Analysis, Comparison, Summary, compare, summarise
from legbench.recording.reader import Recording, load

SHOWN = 4
"""Largest number of entries in which two experiments differ that a note lists."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ReplayArguments:
    """Rate a recorded run again, from its file alone; show it."""

    run: Annotated[Path, Positional]
    """Run folder; a torn one is read as far as it goes."""
    against: UseAppendAction[tuple[Path, ...]] = ()
    """Another run to compare with and to draw over this one; may be repeated."""
    view: bool = False
    """Whether to open the run in rerun."""
    serve: bool = False
    """Whether to show the run in a browser on this machine, until ^C."""
    rrd: Path | None = None
    """Write a rerun file that anyone can open."""
    figure: Path | None = None
    """Write the phase plots of Fig. 4 or 6: .png, .svg or .pdf."""
    json: bool = False
    """Print one JSON object on stdout."""


def main(arguments: list[str]) -> int:
    """Run `legbench replay`; its exit status is 0 also for a run that a fault has ended."""
    chosen = parse(ReplayArguments, "replay", arguments)
    recording, *others = [_loaded(path) for path in (chosen.run, *chosen.against)]
    run, *against = [Analysis(each) for each in (recording, *others)]
    summary = summarise(run)
    comparisons = [_compared(run, other) for other in against]
    if chosen.figure is not None:
        from legbench.viz.print.figures import phase_figure
        from legbench.viz.print.save import save_figure

        note(f"wrote {save_figure(phase_figure(run, against), chosen.figure)}")
    if chosen.json:
        added = {"against": [each.to_json() for each in comparisons]} if others else {}
        print_json(summary.to_json() | added)
    else:
        print_summary(summary)
        for comparison in comparisons:
            print_comparison(comparison)
    if chosen.rrd is not None or chosen.view or chosen.serve:
        # Signals that were read for the figures make room for those that are shown.
        del run, against
        show(recording, others, chosen, summary)
    return 0


def _loaded(path: Path) -> Recording:
    recording = load(path)
    if recording.torn is not None:
        note(f"legbench: {path} is torn ({recording.torn}); read as far as it goes")
    return recording


def _compared(run: Analysis, other: Analysis) -> Comparison:
    comparison = compare(run, other)
    if unlike := comparison.unlike:
        listed = ", ".join(unlike[:SHOWN]) + (
            f" and {len(unlike) - SHOWN} more entries" if len(unlike) > SHOWN else ""
        )
        note(f"legbench: {comparison.other} is another experiment: it differs in {listed}")
    return comparison


def show(
    recording: Recording, others: list[Recording], chosen: ReplayArguments, summary: Summary
) -> None:
    """Write the rerun file, and open it where that was asked for."""
    from legbench.viz.live.rrd import write_rrd
    from legbench.viz.live.viewer import open_viewer

    rrd = write_rrd(recording, chosen.rrd or recording.path / "view.rrd", others, summary=summary)
    note(f"wrote {rrd}")
    if not (chosen.view or chosen.serve):
        return
    viewer = open_viewer(rrd, serve=chosen.serve)
    if viewer.url is not None:
        note(f"look at {viewer.url}; ^C ends it")
        with suppress(KeyboardInterrupt):
            viewer.wait()
        viewer.stop()
