"""`legbench hop`: the apex return map of a leg, its periodic hops, their families and basin."""

import math
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import tyro

from legbench.analytic import LegModel
from legbench.analytic.taylor import TaylorLeg
from legbench.cli.hop_tables import (
    cycle_content,
    cycle_lines,
    family_content,
    family_lines,
    hop_lines,
)
from legbench.cli.output import note, print_json, progress, results_in, write_json
from legbench.cli.parse import parse
from legbench.control import JumpConfig
from legbench.design import LegDesign, load_design
from legbench.errors import ConfigError
from legbench.modes.basin import Axis, Fate, Question, map_basin
from legbench.modes.cycles import LONGEST, Cycle, end_of, find_cycle, repeats
from legbench.modes.drive import JumpLaw
from legbench.modes.hop import Apex, Ending, return_map, settle
from legbench.modes.hop_family import HopFamily, follow_hop
from legbench.modes.hop_setting import Setting, tools_at
from legbench.signals import Ints

WHY = {
    Ending.STANDS: "it stays on the ground; take a larger --dz2, or a --height that is nearer",
    Ending.FELL: "it falls over; take a smaller --dz2, or a --height that is nearer",
    Ending.FAULT: "the controller has lost step, it takes vibration in flight for the ground; take "
    "a longer --touchdown-time",
}
"""Advice for each way in which a leg fails to come to its next apex."""
LARGE = 250_000
"""Cells of a basin map beyond which it is asked whether that was meant [-]."""
CELL_TIME = 0.004
"""Time that one cell takes one process, about [s]."""
ENDING_HOPS = 400
"""Number of hops after which one that is not stable should have come to its end [-]."""


@dataclass(frozen=True, slots=True, kw_only=True)
class HopArguments:
    """Compute the hopping of a leg as a map from apex to apex."""

    design: Annotated[Path, tyro.conf.Positional]
    """Design file."""
    passive: bool = False
    """Whether motors are held and damping is left out, instead of the jump controller."""
    rest: float = 0.9
    """Set point z2 of the standing leg, orthonormal, for passive hops [rad]."""
    jump: JumpConfig = field(default_factory=JumpConfig)
    height: float | None = None
    """Apex of the centre of mass to start from [m]; none: 30 mm over standing."""
    hops: int = 60
    """Number of hops after which the leg should be periodic."""
    period: int | None = None
    """Number of hops after which the motion is to repeat; none: as it settles."""
    family: Setting | None = None
    """Setting over which the periodic hop is followed, from its present value to --to."""
    to: float | None = None
    """Value of that setting at which the family ends [rad, or a factor]."""
    basin: int = 0
    """Number of points on each side of the basin map; 0 makes none."""
    across: str = "z1"
    """Coordinate that varies to the right in the basin map."""
    across_span: float = 0.6
    """Range of that coordinate to either side, in metres, radians and seconds."""
    up: str = "speed"
    """Coordinate that varies upwards in the basin map."""
    up_span: float = 2.5
    """Range of that coordinate to either side, in metres, radians and seconds."""
    large: bool = False
    """Whether to map a basin of more than 250 000 cells all the same."""
    workers: int = 2
    """Number of processes that compute the basin map."""
    out: Path | None = None
    """Folder for hop.json, pictures and the basin's rows; a map begun there is continued."""
    json: bool = False
    """Whether to print one JSON object instead of tables."""


def main(arguments: list[str]) -> int:
    """Run `legbench hop`."""
    flags = parse(HopArguments, "hop", arguments)
    _check(flags)
    design = load_design(flags.design)
    with results_in(flags.out):
        if flags.passive:
            from legbench.cli.hop_passive import answer

            content, lines = answer(design, flags.rest)
        else:
            content, lines = _driven(flags, design)
        if flags.json:
            print_json(content)
        else:
            print("\n".join(lines))
        if flags.out is not None:
            write_json(flags.out / "hop.json", content)
            note(f"wrote {flags.out / 'hop.json'}")
    # Who asks for a map and gets none is told so by the status, too.
    return int(flags.basin > 0 and "basin" not in content)


def _check(flags: HopArguments) -> None:
    """Refuse what would only be found after the leg has hopped."""
    if flags.hops < 1:
        raise ConfigError(f"hops is {flags.hops}; it must be 1 or more")
    if flags.height is not None and not 0.0 < flags.height < math.inf:
        raise ConfigError(f"height is {flags.height:g} m; an apex lies above the ground")
    for name, span in ((flags.across, flags.across_span), (flags.up, flags.up_span)):
        Axis(name=name, low=-span, high=span, count=max(flags.basin, 2))
    if flags.across == flags.up:
        raise ConfigError(f"both axes are {flags.up}; a map needs two different ones")
    if flags.period is not None and not 1 <= flags.period <= LONGEST:
        raise ConfigError(f"period is {flags.period} hops; it must be 1 to {LONGEST}")
    if (flags.family is None) != (flags.to is None):
        raise ConfigError("a family needs both --family, what is varied, and --to, how far")
    if flags.passive and (flags.family is not None or flags.period is not None):
        raise ConfigError("--family and --period are for driven hops; leave --passive away")
    if flags.basin == 0:
        return
    if flags.basin < 2:
        raise ConfigError(f"basin is {flags.basin} points a side; it must be 0 (none), 2 or more")
    if flags.out is None:
        raise ConfigError("a basin map needs --out, the folder that it is written to")
    if flags.passive:
        raise ConfigError(
            "a passive leg gains no energy, so no hop draws others from all sides and there is no "
            "basin to map; leave --basin or --passive away"
        )
    if flags.workers < 1:
        raise ConfigError(f"workers is {flags.workers}; a map needs 1 process or more")
    if flags.basin**2 > LARGE and not flags.large:
        hours = flags.basin**2 * CELL_TIME / flags.workers / 3600.0
        raise ConfigError(
            f"basin is {flags.basin} x {flags.basin} = {flags.basin**2} cells, some {hours:.2g} h "
            f"with {flags.workers} processes; take up to {math.isqrt(LARGE)} points a side, or say "
            "--large"
        )


def _driven(flags: HopArguments, design: LegDesign) -> tuple[dict[str, Any], list[str]]:
    """Hops under the jump controller, as JSON and as lines."""
    law = JumpLaw(flags.jump, design)
    if flags.family is not None and flags.to is not None:
        tools_at(design, flags.jump, flags.family, flags.to)
    leg = TaylorLeg(LegModel.of(design), probe=law.probe)
    apexes = _hopped(leg, law, _start(flags, leg.model), flags.hops)
    cycles = _cycles(leg, law, apexes)
    chosen = _chosen(cycles, flags.period)
    content: dict[str, Any] = {
        "design": design.name,
        "drive": "jump",
        "jump": asdict(flags.jump),
        "apexes": [asdict(apex) for apex in apexes],
        "fixed_points": [cycle_content(cycle) for cycle in cycles],
    }
    lines = hop_lines(design, apexes)
    for cycle in cycles:
        lines += cycle_lines(cycle)
    if flags.family is not None and flags.to is not None:
        family = follow_hop(design, flags.jump, flags.family, chosen, flags.to, progress=progress)
        content["family"] = family_content(family)
        lines += family_lines(family)
        if flags.out is not None:
            _plot_family(flags.out, design, family)
    if flags.out is not None:
        _plot_return(flags.out, design, apexes, chosen)
    if flags.basin and not chosen.stable:
        note(
            f"no basin: the periodic hop is not stable, its largest multiplier is "
            f"{abs(chosen.multipliers[0]):.4g}; no start stays there; --family finds settings at "
            "which it is"
        )
    elif flags.basin and flags.out is not None:
        share = _share(_basin(flags, design, chosen, flags.out))
        content["basin"] = share
        lines += ["", "basin   " + ", ".join(f"{k} {v:.1%}" for k, v in share.items())]
    return content, lines


def _start(flags: HopArguments, model: LegModel) -> Apex:
    """The apex to begin with: relaxed and upright, by default 30 mm over standing."""
    z2 = flags.jump.z2 + flags.jump.dz2
    q = (-z2 * math.sqrt(0.5), z2 * math.sqrt(0.5))
    standing = model.mass_centre_from_hip(q)[1] - model.foot_from_hip(q)[1]
    height = standing + 0.03 if flags.height is None else flags.height
    return Apex(height=height, speed=0.0, z1=0.0, z2=z2, dz1=0.0, dz2=0.0)


def _hopped(leg: TaylorLeg, law: JumpLaw, start: Apex, hops: int) -> list[Apex]:
    """Apexes of so many hops in a row, the start first; tells how many are done.

    Raises:
        ConfigError: the leg stops hopping before.
    """
    apexes = [start]
    progress(0, hops)
    for done in range(hops):
        after = settle(leg, law, apexes[-1], 1)[1:]
        if not after:
            ending = return_map(leg, law, apexes[-1]).ending
            raise ConfigError(
                f"the leg stops hopping after {done} of {hops} hops from an apex of "
                f"{start.height:.4g} m: {WHY[ending]}"
            )
        apexes += after
        progress(done + 1, hops)
    return apexes


def _cycles(leg: TaylorLeg, law: JumpLaw, apexes: list[Apex]) -> list[Cycle]:
    """The periodic hop near the last ones, and, if it is not stable, the one it ends in."""
    period = repeats(apexes) or 1
    found = [find_cycle(leg, law, apexes[-period:])]
    if not found[0].stable:
        way, end = end_of(leg, law, found[0], ENDING_HOPS)
        if end is not None:
            found.append(end)
        elif len(way) <= ENDING_HOPS:
            note(f"nudged off the periodic hop, the leg stops hopping after {len(way) - 1} hops")
        else:
            note(f"nudged off the periodic hop, the leg does not repeat within {LONGEST} hops")
    return found


def _chosen(cycles: list[Cycle], period: int | None) -> Cycle:
    """The cycle that was asked for.

    Raises:
        ConfigError: none has that period.
    """
    if period is None:
        return cycles[0]
    for cycle in cycles:
        if cycle.period == period:
            return cycle
    found = " and ".join(str(cycle.period) for cycle in cycles)
    raise ConfigError(
        f"no hop of period {period} is found: there is one of period {found}; take another "
        "--height, more --hops, or settings beyond a change of stability (--family)"
    )


def _plot_return(out: Path, design: LegDesign, apexes: list[Apex], cycle: Cycle) -> None:
    from legbench.viz.print.hops import plot_return

    heights = np.array([apex.height for apex in apexes])
    pairs = np.stack([heights[:-1], heights[1:]], axis=-1)
    title = f"{design.name}: apex return map"
    around = np.array([apex.height for apex in cycle.apexes])
    fixed = np.stack([around, np.roll(around, -1)], axis=-1)
    plot_return(pairs, fixed, title, out / "return.png")
    note(f"wrote {out / 'return.png'}")


def _plot_family(out: Path, design: LegDesign, family: HopFamily) -> None:
    from legbench.viz.print.hops import plot_family

    plot_family(family, f"{design.name}: periodic hops over {family.setting}", out / "family.png")
    note(f"wrote {out / 'family.png'}")


def _basin(flags: HopArguments, design: LegDesign, cycle: Cycle, out: Path) -> Ints:
    from legbench.viz.print.hops import plot_basin

    def axis(name: str, span: float) -> Axis:
        middle = getattr(cycle.apexes[0], name, 0.0)
        return Axis(name=name, low=middle - span, high=middle + span, count=flags.basin)

    question = Question(
        design=design,
        jump=flags.jump,
        motor=(0.0, 0.0),
        undamped=False,
        centre=cycle.apexes[0],
        across=axis(flags.across, flags.across_span),
        up=axis(flags.up, flags.up_span),
    )
    rows = out / "basin.jsonl"
    fates = map_basin(question, rows, workers=flags.workers, progress=progress)
    plot_basin(question, fates, out / "basin.png")
    note(f"wrote {rows} and {out / 'basin.png'}")
    return fates


def _share(fates: Ints) -> dict[str, float]:
    return {fate.name.lower(): float(np.mean(fates == fate)) for fate in Fate if fate in fates}
