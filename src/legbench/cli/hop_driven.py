"""`legbench hop` under the jump controller: apexes, periodic hops, their family and basin."""

import math
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from legbench.analytic import LegModel
from legbench.analytic.taylor import TaylorLeg
from legbench.cli.hop_arguments import HopArguments
from legbench.cli.hop_tables import (
    cycle_content,
    cycle_lines,
    family_content,
    family_lines,
    hop_lines,
)
from legbench.cli.output import note, timed_progress
from legbench.design import LegDesign
from legbench.errors import ConfigError
from legbench.modes.basin import BasinTask, Fate, GridAxis, map_basin
from legbench.modes.cycles import LONGEST, HopCycle, end_of, find_cycle, repeats
from legbench.modes.drive import JumpLaw
from legbench.modes.hop import Apex, Ending, return_map, settle
from legbench.modes.hop_family import HopFamily, follow_hop
from legbench.modes.hop_setting import tools_at
from legbench.signals import Ints

WHY = {
    Ending.STANDS: "it stays on the ground; take a larger --dz2, or a --height that is nearer",
    Ending.FELL: "it falls over; take a smaller --dz2, or a --height that is nearer",
    Ending.FAULT: "the controller has lost step, it takes vibration in flight for the ground; take "
    "a longer --touchdown-time",
}
"""Advice for each way in which a leg fails to come to its next apex."""
ENDING_HOPS = 400
"""Number of hops after which one that is not stable should have come to its end [-]."""


def answer(flags: HopArguments, design: LegDesign) -> tuple[dict[str, Any], list[str]]:
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
        family = follow_hop(
            design, flags.jump, flags.family, chosen, flags.to, progress=timed_progress()
        )
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
    tell = timed_progress()
    tell(0, hops)
    for done in range(hops):
        after = settle(leg, law, apexes[-1], 1)[1:]
        if not after:
            ending = return_map(leg, law, apexes[-1]).ending
            raise ConfigError(
                f"the leg stops hopping after {done} of {hops} hops from an apex of "
                f"{start.height:.4g} m: {WHY[ending]}"
            )
        apexes += after
        tell(done + 1, hops)
    return apexes


def _cycles(leg: TaylorLeg, law: JumpLaw, apexes: list[Apex]) -> list[HopCycle]:
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


def _chosen(cycles: list[HopCycle], period: int | None) -> HopCycle:
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


def _plot_return(out: Path, design: LegDesign, apexes: list[Apex], cycle: HopCycle) -> None:
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


def _basin(flags: HopArguments, design: LegDesign, cycle: HopCycle, out: Path) -> Ints:
    from legbench.viz.print.hops import plot_basin

    def axis(name: str, span: float) -> GridAxis:
        middle = getattr(cycle.apexes[0], name, 0.0)
        return GridAxis(name=name, low=middle - span, high=middle + span, count=flags.basin)

    task = BasinTask(
        design=design,
        jump=flags.jump,
        motor=(0.0, 0.0),
        undamped=False,
        centre=cycle.apexes[0],
        across=axis(flags.across, flags.across_span),
        up=axis(flags.up, flags.up_span),
    )
    rows = out / "basin.jsonl"
    fates = map_basin(task, rows, workers=flags.workers, progress=timed_progress())
    plot_basin(task, fates, out / "basin.png")
    note(f"wrote {rows} and {out / 'basin.png'}")
    return fates


def _share(fates: Ints) -> dict[str, float]:
    return {fate.name.lower(): float(np.mean(fates == fate)) for fate in Fate if fate in fates}
