"""The prototype jumps: run, table beside the paper's figures, recording, `.rrd` and phase plots."""

import math
import os
import sys
from pathlib import Path

from legbench.cli.output import note, progress, report_error
from legbench.control import JumpConfig
from legbench.design import load_design
from legbench.errors import LegbenchError
from legbench.experiment import Experiment, record
from legbench.interrupts import stop_on_interrupt
from legbench.metrics import Summary, summarise
from legbench.paper import published
from legbench.recording.reader import load
from legbench.viz.live.rrd import write_rrd
from legbench.viz.print.figures import phase_figure
from legbench.viz.print.save import save_figure

ROOT = Path(__file__).parent.parent
OUT = Path(os.environ.get("LEGBENCH_RUNS", ROOT / "runs"))


def table(summary: Summary) -> str:
    """Our figures beside the paper's."""
    paper = {key: number.value for key, number in published().items()}
    stance, flight = min(summary.rating_stance), min(summary.rating_flight)
    rows = [
        ("P^r, every stance", f"> {_below(stance)}", f"> {paper['jump_rating_stance']}"),
        ("P^r, every flight", f"> {_below(flight)}", f"> {paper['jump_rating_flight']}"),
        ("foot clearance", _mm(summary.foot_clearance), _mm(paper["foot_clearance"])),
        ("trunk excursion", _mm(summary.trunk_excursion), _mm(paper["trunk_excursion"])),
        ("drift over three jumps", _mm(summary.drift), _mm(paper["drift"])),
        ("foot travel in flight", _mm(summary.foot_travel), _mm(paper["foot_travel"])),
        ("hopping frequency", f"{summary.hop_freq:.2f} Hz", ""),
        ("polar angle, largest", f"{summary.polar_max:.4f} rad", ""),
        ("loop gap, largest", f"{1e6 * summary.loop_gap_max:.1f} um", ""),
        ("energy unexplained", f"{100 * summary.energy_residual:.3f} %", ""),
    ]
    lines = [f"{'':<24}{'simulated':>16}{'paper':>12}"]
    lines += [f"{name:<24}{ours:>16}{theirs:>12}" for name, ours, theirs in rows]
    budget = ", ".join(
        f"{name} {1e3 * value:.0f} mJ"
        for name, value in (
            ("motors", summary.motor_work),
            ("dampers", -summary.damper_loss),
            ("impact", -summary.impact_loss),
            ("knee stop", -summary.stop_loss),
        )
    )
    return "\n".join([*lines, "", f"energy of a jump        {budget}"])


def _below(rating: float) -> str:
    """Four digits that the rating is not below."""
    return f"{math.floor(1e4 * rating) / 1e4:.4f}"


def _mm(value: float) -> str:
    return f"{1e3 * value:.1f} mm"


def main() -> int:
    """Run and show; 1 if the leg did not come through."""
    experiment = Experiment(
        design=load_design(ROOT / "models" / "prototype.toml"), controller=JumpConfig()
    )
    with stop_on_interrupt() as stop:
        finished = record(experiment, OUT, stop=stop, progress=progress)
    if finished.outcome.status != "complete":
        report_error(f"{finished.outcome.message or finished.outcome.status}; see {finished.path}")
        return 1
    recording = load(finished.path)
    summary = summarise(recording)
    if not summary.jumps:
        report_error(f"the leg did not leave the ground; see {finished.path}")
        return 1
    print(table(summary))
    rrd = write_rrd(recording, finished.path / "view.rrd")
    figure = save_figure(phase_figure(recording), finished.path / "phase.png")
    run = os.path.relpath(finished.path)
    note("")
    note(f"recording    {run}")
    note(f"phase plots  {os.path.relpath(figure)}")
    note(f"in motion    .venv/bin/legbench replay {run} --view     ({os.path.relpath(rrd)})")
    note(f"as a video   .venv/bin/legbench render {run} --out leg.mp4")
    return 0


if __name__ == "__main__":
    try:
        sys.exit(main())
    except LegbenchError as error:
        report_error(str(error))
        sys.exit(1)
