"""`legbench design`: from requirements to a leg that can be built."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from legbench.cli.output import (
    duration_text,
    end_status_line,
    note,
    pace,
    print_json,
    status_line,
)
from legbench.cli.parse import OrNone, parse
from legbench.design import load_design, save_design
from legbench.design.dependent import INFEASIBLE
from legbench.design.requirements import PAPER, Requirements, load_requirements
from legbench.design.scaling import quadruped
from legbench.errors import ConfigError

if TYPE_CHECKING:
    from legbench.synthesis.solve import Solution
    from legbench.synthesis.trace import Trace

ROUNDING = 1e-12
"""Ratio up to which a condition of the result counts as met [-]."""
SAME_OPTIMUM = 1e-4
"""Difference of objectives above which two methods have not found the same leg [-]."""
ROBUST_EVALUATIONS = 800
"""Default limit where every evaluation is a simulation."""


@dataclass(frozen=True, slots=True, kw_only=True)
class DesignArguments:
    """Find the leg that meets requirements and modal matching, best by objective (11)."""

    requirements: str = "paper"
    """`paper`, `quadruped` (with --mass), or a requirements file."""
    mass: OrNone[float] = None
    """Body mass of the quadruped [kg]."""
    seed: int = 0
    """Seed of the search."""
    restarts: int = 0
    """Further searches with doubled populations; the best counts."""
    evaluations: OrNone[int] = None
    """Limit of evaluations; by default 20000, with --tolerances 800."""
    trace: OrNone[Path] = None
    """File that keeps every evaluation; a search whose file exists is continued."""
    overhang: OrNone[float] = None
    """Largest reach of mass beyond both joints of its segment [m]; the paper does not ask."""
    cross_check: bool = True
    """Whether to search by differential evolution as well, and compare; without it the search takes
    half the time, and nothing says that another leg is not better."""
    tolerances: OrNone[str] = None
    """`default` or a tolerance file: candidates also pay for the P^r that scatter costs them, and
    the yield of the result is measured."""
    legs: int = 1000
    """Number of legs on which the yield is measured."""
    measured: OrNone[Path] = None
    """Design file of a leg that was built: prints the weights that bring it to the result."""
    out: OrNone[Path] = None
    """Design file to write."""
    drawing: OrNone[Path] = None
    """Drawing to scale to write, .svg, .png or .pdf."""
    plot: OrNone[Path] = None
    """Plot of the search to write, .svg, .png or .pdf."""
    json: bool = False
    """Print one JSON object on stdout."""


def main(arguments: list[str]) -> int:
    """Run `legbench design`: search a leg, judge it, write it."""
    chosen = parse(DesignArguments, "design", arguments)
    for picture in filter(None, (chosen.plot, chosen.drawing)):
        from legbench.viz.print.save import check_suffix

        check_suffix(picture)
    if chosen.tolerances is not None:
        from legbench.synthesis.yields import check_sample

        check_sample(chosen.legs, chosen.seed)
    from legbench.synthesis.manufacture import manufacture_table, table_to_json
    from legbench.synthesis.search import SearchSettings, identity_of
    from legbench.synthesis.trace import Trace

    measured = None if chosen.measured is None else load_design(chosen.measured)
    requirements = requirements_of(chosen)
    usual = 20_000 if chosen.tolerances is None else ROBUST_EVALUATIONS
    settings = SearchSettings(
        seed=chosen.seed,
        restarts=chosen.restarts,
        evaluations=usual if chosen.evaluations is None else chosen.evaluations,
    )
    trace = Trace(identity_of(_problem(requirements, chosen.tolerances), settings), chosen.trace)
    solution, stopped = _solve(chosen, requirements, settings, trace)
    rows = manufacture_table(solution.design)
    content = {**solution.to_json(), "manufacture": table_to_json(rows)}
    lines = _lines(solution, rows)
    if measured is not None:
        from legbench.cli.check import add_adjustments

        add_adjustments(measured, solution.design, content, lines)
    if chosen.tolerances is not None and not stopped:
        from legbench.cli.check import add_yield

        add_yield(solution.design, chosen.tolerances, chosen.legs, chosen.seed, content, lines)
    _write(chosen, solution, trace)
    if chosen.json:
        print_json(content | {"out": chosen.out and str(chosen.out)})
    else:
        print("\n".join(lines))
    return 0


def requirements_of(chosen: DesignArguments) -> Requirements:
    """Requirements of the preset or file that the flags name, with the constraint of a flag.

    Raises:
        DesignError: a file or a body mass that makes no sense.
        ConfigError: a preset without its mass, or a mass without its preset.
    """
    found = _named(chosen)
    return found if chosen.overhang is None else replace(found, overhang=chosen.overhang)


def _named(chosen: DesignArguments) -> Requirements:
    if chosen.requirements == "quadruped":
        if chosen.mass is None:
            raise ConfigError("preset 'quadruped' needs the body's --mass [kg]; the paper's is 4")
        return quadruped(chosen.mass)
    if chosen.mass is not None:
        raise ConfigError(
            f"--mass belongs to --requirements quadruped, not to '{chosen.requirements}'"
        )
    return PAPER if chosen.requirements == "paper" else load_requirements(Path(chosen.requirements))


def _problem(requirements: Requirements, tolerances: str | None) -> dict[str, Any]:
    from legbench.design.requirements import requirements_to_mapping

    problem = requirements_to_mapping(requirements)
    if tolerances is not None:
        from dataclasses import asdict

        from legbench.cli.check import tolerances_named

        problem["tolerances"] = asdict(tolerances_named(tolerances))
    return problem


def _solve(
    chosen: DesignArguments, requirements: Requirements, settings: Any, trace: "Trace"
) -> tuple["Solution", bool]:
    """Solution of the search, and whether ^C ended the search early."""
    from legbench.interrupts import stop_on_interrupt
    from legbench.synthesis.solve import solve

    scatter_cost = None
    if chosen.tolerances is not None:
        from legbench.cli.check import tolerances_named
        from legbench.synthesis.yields import ScatterCost

        scatter_cost = ScatterCost(tolerances=tolerances_named(chosen.tolerances))
    with stop_on_interrupt() as stop:
        solution = solve(
            requirements,
            settings,
            trace=trace,
            scatter_cost=scatter_cost,
            cross_check=chosen.cross_check,
            stop=stop,
            progress=_progress(settings.evaluations),
        )
    if not solution.complete:
        again = f"; the same command continues {chosen.trace}" if chosen.trace else ""
        note(f"the search has not converged: this is the best of {len(trace)} evaluations{again}")
    if solution.check is not None and abs(solution.check.cost - solution.cost) > SAME_OPTIMUM:
        note(
            f"differential evolution ends at {solution.check.cost:.6f} instead of "
            f"{solution.cost:.6f}: try another --seed or --restarts"
        )
    return solution, stop.is_set


def _progress(limit: int) -> Callable[[int, float], None]:
    """Return a line that tells the best leg, and how long the rest takes at the most."""
    left_after = pace()

    def tell(evaluations: int, best: float) -> None:
        words = f"{best:.6f}" if best < INFEASIBLE else "no leg yet"
        left = left_after(evaluations, limit)
        rest = "" if left is None else f", {duration_text(max(left, 0.0))} left at the most"
        status_line(f"{evaluations:6d} of at most {limit} evaluations, best {words}{rest}")

    return tell


def _lines(solution: "Solution", rows: Any) -> list[str]:
    from legbench.synthesis.report import condition_lines, solution_lines, table_lines

    end_status_line()
    angle = _angle(solution)
    return [
        f"leg '{solution.design.name}' for requirements '{solution.requirements.name}'",
        "",
        *solution_lines(solution),
        "",
        *condition_lines(solution.design, solution.conditions, angle, ROUNDING),
        "",
        *table_lines(rows),
    ]


def _angle(solution: "Solution") -> float:
    from legbench.design.matching import standing_angle

    return standing_angle(solution.design, solution.requirements.relaxed_length)


def _write(chosen: DesignArguments, solution: "Solution", trace: "Trace") -> None:
    """Write the design file, the drawing and the plot that the flags name."""
    if chosen.out is not None:
        save_design(solution.design, chosen.out)
        note(f"wrote {chosen.out}")
    if chosen.drawing is not None:
        _draw(chosen.drawing, solution)
    if chosen.plot is not None:
        _plot(chosen.plot, solution, trace)


def _draw(path: Path, solution: "Solution") -> None:
    from legbench.viz.print._matplotlib import Figure, FigureCanvasAgg, styled
    from legbench.viz.print.designs import PAGE, draw_leg
    from legbench.viz.print.save import save_figure

    with styled():
        figure = Figure(figsize=(PAGE[0] / 25.4, PAGE[1] / 25.4))
        FigureCanvasAgg(figure)
        draw_leg(figure.add_axes((0.0, 0.0, 1.0, 1.0)), solution.design, _angle(solution))
    note(f"wrote {save_figure(figure, path)}")


def _plot(path: Path, solution: "Solution", trace: "Trace") -> None:
    from legbench.viz.print._matplotlib import Figure, FigureCanvasAgg, styled
    from legbench.viz.print.designs import draw_trace
    from legbench.viz.print.save import save_figure

    with styled():
        figure = Figure(figsize=(8.0, 6.4), layout="constrained")
        FigureCanvasAgg(figure)
        upper, lower = figure.add_subplot(2, 1, 1), figure.add_subplot(2, 1, 2)
        draw_trace(upper, lower, trace, solution.requirements.bounds)
        figure.legend(*lower.get_legend_handles_labels(), loc="outside right lower", frameon=False)
    note(f"wrote {save_figure(figure, path)}")
