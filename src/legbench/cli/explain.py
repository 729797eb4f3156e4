"""`legbench explain`: which imperfections of a leg reproduce the ratings that were measured."""

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Literal, final

from legbench.cli.output import (
    note,
    pace,
    print_json,
    progress,
    report_error,
    results_in,
    write_json,
)
from legbench.cli.parse import parse
from legbench.design import load_design

if TYPE_CHECKING:
    from legbench.explain.engine import Watch
    from legbench.explain.explanation import Explanation


@dataclass(frozen=True, slots=True, kw_only=True)
class ExplainArguments:
    """Find which imperfections of a leg explain how its ratings decay, period by period.

    Each cause is tried alone, fitted to the whole shape of the ratings, and what fits is tried
    against everything else that the paper says: bang-bang, the order of the setups, the jump. ^C
    ends with what has been found by then.
    """

    against: str = "paper"
    """`paper`, or a file of published numbers with the same columns and keys (.csv)."""
    reading: Literal["text", "caption"] = "text"
    """Which of the paper's two descriptions of the step counts: z2 from 1.7 to 1.4 rad (text), or
    from 0.7 to 1.0 rad (caption)."""
    design: Path = Path("prototype")
    """Design file of the leg that the controller believes in, or the name of a design that comes
    with the package."""
    causes: tuple[str, ...] = field(default_factory=tuple)
    """Causes to consider, by name; by default all."""
    pairs: bool = False
    """Whether to fit every two causes together, too; takes minutes."""
    screen: Literal["none", "morris", "sobol"] = "none"
    """Method that weighs the causes with all of them there at once; needs the extra
    `screening`."""
    setups: bool = True
    """Whether to try the best fits against everything else that was measured; without it they are
    ranked by the step's ratings alone."""
    jump: bool = True
    """Whether to simulate the jump of the best fits, too; without it the other setups alone are
    tried, and no jump is run."""
    seed: int = 0
    """Seed of the screening; nothing else is drawn."""
    out: Path | None = None
    """Folder for explain.json, explained.toml (an experiment on the leg that explains best),
    explain.png and explain.svg."""
    json: bool = False
    """Print one JSON object on stdout."""


def main(arguments: list[str]) -> int:
    """Run `legbench explain`: print what explains the ratings; 130 if it was stopped."""
    flags = parse(ExplainArguments, "explain", arguments)
    from legbench.explain.causes import causes_named
    from legbench.explain.content import explanation_content
    from legbench.explain.explanation import Scope, explain
    from legbench.explain.screening import ScreeningMethod
    from legbench.explain.targets import step_target
    from legbench.explain.words import explanation_lines
    from legbench.interrupts import stop_on_interrupt
    from legbench.paper import PAPER, published

    path = PAPER if flags.against == "paper" else Path(flags.against)
    target, causes = step_target(flags.reading, path), causes_named(flags.causes)
    design, numbers = load_design(flags.design), published(path)
    scope = Scope(
        pairs=flags.pairs,
        method=None if flags.screen == "none" else ScreeningMethod(flags.screen),
        setups=flags.setups,
        jump=flags.jump,
        seed=flags.seed,
    )
    with results_in(flags.out), stop_on_interrupt() as stop:
        watch = StageProgress(lambda: stop.is_set).watch()
        found = explain(design, target, causes, numbers, scope, watch)
        if flags.out is not None:
            write_explanation(found, flags.out)
    if flags.json:
        print_json(explanation_content(found) | {"out": flags.out and str(flags.out)})
    else:
        print("\n".join(explanation_lines(found)))
    if not found.complete:
        report_error("interrupted; what had been found by then is above")
        return 130
    return 0


def write_explanation(found: "Explanation", out: Path) -> None:
    """Write numbers, experiment and figure of an explanation into a folder."""
    from legbench.experiment import save_experiment
    from legbench.explain.content import explanation_content
    from legbench.viz.print.explanations import plot_explanation

    write_json(out / "explain.json", explanation_content(found))
    written = ["explain.json"]
    if found.experiment is not None:
        save_experiment(found.experiment, out / "explained.toml")
        written.append("explained.toml")
    for suffix in ("png", "svg"):
        plot_explanation(found, out / f"explain.{suffix}")
        written.append(f"explain.{suffix}")
    note(f"wrote {', '.join(str(out / name) for name in written)}")


@final
class StageProgress:
    """Progress of the present stage on stderr, with the time that it will still take."""

    def __init__(self, stopped: Callable[[], bool]) -> None:
        self._stopped = stopped
        self._done, self._total, self._left_after = 0, 1, pace()

    def watch(self) -> "Watch":
        """Return what a long computation is given."""
        from legbench.explain.engine import Watch

        return Watch(begin=self._begin, advance=self._advance, stopped=self._stopped)

    def _begin(self, stage: str, legs: int) -> None:
        """Begin a stage; the bar of the one before is full, whatever was estimated."""
        if 0 < self._done < self._total:
            progress(self._total, self._total)
        if not self._stopped():
            note(f"{stage}: {legs} legs")
        self._done, self._total, self._left_after = 0, max(legs, 1), pace()
        self._left_after(0, self._total)

    def _advance(self, legs: int) -> None:
        self._done = min(self._done + legs, self._total)
        progress(self._done, self._total, self._left_after(self._done, self._total))
