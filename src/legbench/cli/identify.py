"""`legbench identify`: the parameters of a leg from its recordings."""

import math
from contextlib import ExitStack
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from tyro.conf import Positional, UseAppendAction

from legbench.cli.output import note, print_json, results_in
from legbench.cli.parse import parse
from legbench.design import load_design
from legbench.errors import ConfigError
from legbench.recording.reader import Recording

if TYPE_CHECKING:
    from legbench.identify import Identification, IdentificationTask


@dataclass(frozen=True, slots=True, kw_only=True)
class IdentifyArguments:
    """Learn the parameters of a leg from recorded runs, and say whether to trust them.

    Ends with status 1 if they are not to be trusted.
    """

    runs: Annotated[tuple[Path, ...], Positional]
    """Run folders, in the setups hfts, vfts and ffs, all of one leg."""
    free: str = "k1,k2,d1,d2"
    """What is free, with commas between: J1 J2 B s1 s2 k1 k2 d1 d2 mass f1 f2 link_zero1 link_zero2
    motor_zero1 motor_zero2 delay time_base; springs dampers inertia nine friction link_zero
    motor_zero are groups of them."""
    design: Path | None = None
    """Design file to start from; by default the design that the runs name."""
    mass: float | None = None
    """Mass of the whole leg as weighed [kg]; by default that of the design."""
    noise_deg: float | None = None
    """Standard deviation of the link encoders' noise [deg]; by default it is measured."""
    at_rest: bool = False
    """Whether runs begin exactly at the rest posture of the fitted leg, as simulated ones do."""
    starts: int = 3
    """Number of starts of the fit: the design, a regression, and legs beside it."""
    held_out: UseAppendAction[tuple[Path, ...]] = ()
    """Run to predict and not to fit, a hop too; may be repeated."""
    plan: Path | None = None
    """Write the experiment of 3 s that shrinks the intervals most to this file."""
    sharpen: str | None = None
    """Parameter whose interval the plan is to shrink; by default all that are free."""
    limits: Path | None = None
    """Safety limits that the planned run has to keep, by default those of the design [a limits
    file]."""
    peer: Literal["sysid"] | None = None
    """Fit stiffness and damping with mujoco.sysid, too, and show both."""
    out: Path | None = None
    """Write the identified leg to this design file."""
    figure: Path | None = None
    """Draw intervals and residuals: .png, .svg or .pdf."""
    json: bool = False
    """Print one JSON object on stdout."""


def main(arguments: list[str]) -> int:
    """Run `legbench identify`."""
    flags = parse(IdentifyArguments, "identify", arguments)
    from legbench.identify import parse_free, read_runs, task_of
    from legbench.identify.asking import check_same_leg

    free = parse_free([word for word in flags.free.split(",") if word], start=not flags.at_rest)
    noise = _noise(flags)
    runs = read_runs(flags.runs)
    held_out = [*(read_runs([path])[0] for path in flags.held_out)]
    for other in held_out:
        check_same_leg(runs[0], other)
    task = task_of(
        runs,
        free=free,
        design=None if flags.design is None else load_design(flags.design),
        held_out=held_out,
        mass=flags.mass,
        noise=noise,
        starts=flags.starts,
    )
    _check(flags, task)
    with ExitStack() as folders:
        for path in filter(None, (flags.out, flags.plan, flags.figure)):
            folders.enter_context(results_in(path.parent))
        return _answer(flags, task, held_out)


def _answer(flags: IdentifyArguments, task: "IdentificationTask", held_out: list[Recording]) -> int:
    """Identify, print and write what was asked for; returns the exit status."""
    from legbench.identify import UnidentifiableError, identify
    from legbench.identify.words import content_of, lines_of

    try:
        outcome = identify(task, say=note)
    except UnidentifiableError as error:
        if flags.plan is None:
            raise
        # What these runs cannot show is what the next one is planned for.
        lines, content = [f"refused           {error}"], {"refused": str(error)}
        _plan(flags.plan, flags, task, None, lines, content)
        _show(flags, lines, content)
        return 1
    lines, content = lines_of(outcome), content_of(outcome)
    good = outcome.trusted
    if outcome.estimates:
        good &= _hops(held_out, task, outcome, lines, content)
        _extras(flags, task, outcome, lines, content)
    _show(flags, lines, content)
    return 0 if good else 1


def _show(flags: IdentifyArguments, lines: list[str], content: dict[str, Any]) -> None:
    if flags.json:
        print_json(content | {"out": flags.out and str(flags.out)})
    else:
        print("\n".join(lines))


def _noise(flags: IdentifyArguments) -> float | None:
    if flags.noise_deg is None:
        return None
    if not 0.0 < flags.noise_deg < 90.0:
        raise ConfigError(f"noise_deg is {flags.noise_deg:g} deg; it must be above 0 and below 90")
    return math.radians(flags.noise_deg)


def _check(flags: IdentifyArguments, task: "IdentificationTask") -> None:
    """Refuse what would only be found after the fit."""
    if flags.sharpen is not None and flags.plan is None:
        raise ConfigError("--sharpen says what a plan is for; give --plan, the file to write")
    if flags.sharpen is not None and flags.sharpen not in task.free.names:
        raise ConfigError(
            f"--sharpen is {flags.sharpen}; it must be free: {', '.join(task.free.names)}"
        )
    if flags.figure is not None:
        from legbench.viz.print.save import check_suffix

        check_suffix(flags.figure)


def _hops(
    held_out: list[Recording],
    task: "IdentificationTask",
    outcome: "Identification",
    lines: list[str],
    content: dict[str, Any],
) -> bool:
    """Repeat held-out hops with the identified leg; whether it hops as the recorded one."""
    from legbench.identify import repeat, written_back

    hops = [each for each in held_out if each.description.jumps]
    if not hops:
        return True
    leg = written_back(task.design, outcome, task.bars)
    repeated = [repeat(each, leg) for each in hops]
    lines += ["", *(f"held-out hop      {each.text}" for each in repeated)]
    lines += [
        f"not predicted     {each.run}: {'; '.join(each.misses)}; a hop that has not settled yet "
        "differs more: record it for longer"
        for each in repeated
        if not each.good
    ]
    content["held_out_hops"] = [
        asdict(each) | {"good": each.good, "misses": each.misses} for each in repeated
    ]
    return all(each.good for each in repeated)


def _extras(
    flags: IdentifyArguments,
    task: "IdentificationTask",
    outcome: "Identification",
    lines: list[str],
    content: dict[str, Any],
) -> None:
    """Write the files that were asked for, and ask the peer."""
    if flags.peer is not None:
        from legbench.identify.peer import ask_peer

        note("asking mujoco.sysid")
        answer = ask_peer(task)
        lines += ["", *answer.lines(outcome)]
        content["peer"] = asdict(answer)
    if flags.plan is not None:
        _plan(flags.plan, flags, task, outcome, lines, content)
    if flags.out is not None:
        from legbench.identify import design_text, written_back
        from legbench.writing import save_whole

        leg = written_back(task.design, outcome, task.bars)
        save_whole(flags.out, design_text(leg, outcome))
        note(f"wrote {flags.out}")
    if flags.figure is not None:
        from legbench.viz.print.identified import identified_figure
        from legbench.viz.print.save import save_figure

        note(f"wrote {save_figure(identified_figure(task, outcome), flags.figure)}")


def _plan(
    path: Path,
    flags: IdentifyArguments,
    task: "IdentificationTask",
    outcome: "Identification | None",
    lines: list[str],
    content: dict[str, Any],
) -> None:
    """Rank experiments, and write the best one that the leg can do."""
    from legbench.experiment import save_experiment
    from legbench.identify.plan import best_of, plan_lines, ranked
    from legbench.plants import limits_for

    limits = None if flags.limits is None else limits_for(flags.limits, task.design)
    note("predicting experiments")
    plans = ranked(task, outcome, sharpen=flags.sharpen)
    best = best_of(plans, limits, say=note)
    save_experiment(best.experiment, path)
    lines += ["", *plan_lines(plans), f"next run          {best.name}"]
    content["plan"] = [each.to_json() for each in plans]
    content["next"] = best.name
    note(f"wrote {path}; run it by: legbench run {path}")
