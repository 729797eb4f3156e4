"""`legbench check`: whether a leg's radial motion is a mode, and what would make it one."""

from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Annotated, Any

from tyro.conf import Positional

from legbench.cli.output import note, print_json, timed_progress
from legbench.cli.parse import OrNone, parse
from legbench.design import LegDesign, load_design
from legbench.design.matching import TOLERANCE, Parameters, check_conditions, standing_angle
from legbench.design.mending import mends
from legbench.design.realisable import reaches
from legbench.errors import ConfigError
from legbench.strict_json import null_for_nan


@dataclass(frozen=True, slots=True, kw_only=True)
class CheckArguments:
    """Check a design against the conditions of modal matching, by algebra and on its model.

    Ends with status 1 if a condition is violated, or if model and algebra disagree.
    """

    design: Annotated[Path, Positional] = Path("models/optimal.toml")
    """Design file of the leg."""
    relaxed_length: OrNone[float] = None
    """Leg length at which stability is asked for [m]; by default the longest that the stops
    allow, where it is hardest."""
    tolerance: float = TOLERANCE
    """Ratio up to which a decoupling condition counts as met [-]."""
    model: bool = True
    """Whether to measure the conditions on the generated MuJoCo model, too; without it they are
    computed from the design's numbers alone."""
    target: OrNone[Path] = None
    """Design file of the planned leg: prints the weights that bring the built one there."""
    tolerances: OrNone[str] = None
    """`default` or a tolerance file: makes legs with that scatter and counts those that work."""
    legs: int = 1000
    """Number of scattered legs."""
    seed: int = 0
    """Seed of the scatter."""
    json: bool = False
    """Print one JSON object on stdout."""


def main(arguments: list[str]) -> int:
    """Run `legbench check`: print the verdict on each condition."""
    chosen = parse(CheckArguments, "check", arguments)
    if not chosen.tolerance >= 0.0:
        raise ConfigError(f"tolerance is {chosen.tolerance:g}; it must be zero or more")
    if chosen.tolerances is not None:
        from legbench.synthesis.yields import check_sample

        check_sample(chosen.legs, chosen.seed)
    from legbench.synthesis.report import condition_lines, reach_lines

    design = load_design(chosen.design)
    angle = standing_angle(design, chosen.relaxed_length)
    conditions = check_conditions(Parameters.of(design), angle)
    met = all(condition.is_met(chosen.tolerance) for condition in conditions)
    lines = condition_lines(design, conditions, angle, chosen.tolerance)
    content: dict[str, Any] = {
        "design": design.name,
        "met": met,
        "conditions": {
            condition.name: {
                **asdict(condition),
                "ratio": condition.ratio,
                "met": condition.is_met(chosen.tolerance),
                "mends": [
                    {**asdict(mend), "share": mend.share if mend.value else None}
                    for mend in mends(design, condition, angle)
                ],
            }
            for condition in conditions
        },
    }
    lines += reach_lines(design)
    content["reaches"] = [
        {**asdict(reach), "realisable": reach.realisable} for reach in reaches(design)
    ]
    agrees = True
    if chosen.model:
        agrees = _model(design, content, lines)
    if chosen.target is not None:
        add_adjustments(design, load_design(chosen.target), content, lines)
    if chosen.tolerances is not None:
        add_yield(design, chosen.tolerances, chosen.legs, chosen.seed, content, lines)
    if chosen.json:
        print_json(content)
    else:
        print("\n".join(lines))
    return 0 if met and agrees else 1


def _model(design: LegDesign, content: dict[str, Any], lines: list[str]) -> bool:
    from legbench.synthesis.model_check import check_model
    from legbench.synthesis.report import model_lines

    check = check_model(design)
    lines += ["", *model_lines(check)]
    content["model"] = {
        "coupling": check.coupling,
        "agrees": check.agrees,
        "leg_length": [check.shortest, check.longest],
        "rows": [asdict(row) for row in check.rows],
    }
    return check.agrees


def add_adjustments(
    measured: LegDesign, target: LegDesign, content: dict[str, Any], lines: list[str]
) -> None:
    """Report the weights that move a measured leg to its target."""
    from legbench.synthesis.manufacture import adjust_leg
    from legbench.synthesis.report import adjustment_lines
    from legbench.synthesis.solve import conditions_to_json

    adjusted = adjust_leg(measured, target)
    lines += ["", *adjustment_lines(adjusted)]
    content["weights"] = [null_for_nan(asdict(weight)) for weight in adjusted.adjustments]
    content["residuals_with_weights"] = conditions_to_json(adjusted.after)


def add_yield(
    design: LegDesign,
    tolerances: str,
    legs: int,
    seed: int,
    content: dict[str, Any],
    lines: list[str],
) -> None:
    """Report how many scattered legs keep their mode."""
    from legbench.synthesis.report import yield_lines
    from legbench.synthesis.yields import measure_yield

    scatter = tolerances_named(tolerances)
    note(f"simulating {legs} legs with all tolerances, then some with each alone")
    result = measure_yield(design, scatter, legs=legs, seed=seed, progress=timed_progress())
    lines += ["", *yield_lines(result)]
    content["yield"] = asdict(result)


def tolerances_named(name: str) -> Any:
    """Tolerances by name: the default ones, or those of a file."""
    from legbench.synthesis.tolerance import Tolerances, load_tolerances

    return Tolerances() if name == "default" else load_tolerances(Path(name))
