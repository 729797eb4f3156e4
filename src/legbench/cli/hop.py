"""`legbench hop`: the apex return map of a leg, its periodic hops and their basin."""

import math
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import tyro

from legbench.analytic import LegModel
from legbench.analytic.taylor import TaylorLeg
from legbench.cli.output import note, print_json, progress, write_json
from legbench.cli.parse import parse
from legbench.control import JumpConfig
from legbench.design import LegDesign, load_design
from legbench.design.statics import Support
from legbench.errors import ConfigError
from legbench.kinematics import half_angle
from legbench.modes.basin import Axis, Fate, Question, map_basin
from legbench.modes.drive import JumpLaw, Passive
from legbench.modes.fixed_point import FixedPoint, fixed_point
from legbench.modes.hop import Apex, Ending, return_map, settle
from legbench.modes.passive import FreeHop, depths, free_hop
from legbench.modes.scene import make_scene
from legbench.modes.slip import Slip, leg_groups, slip_groups
from legbench.signals import Ints

WHY = {
    Ending.STANDS: "it stays on the ground; take a larger --dz2, or a --height that is nearer",
    Ending.FELL: "it falls over; take a smaller --dz2, or a --height that is nearer",
    Ending.FAULT: "the controller has lost step, it takes vibration in flight for the ground; take "
    "a longer --touchdown-time",
}
"""Advice for each way in which a leg fails to come to its next apex."""
MATCHED = 1e-5
"""Polar set point of the motors that is smaller than a count of most encoders [rad]."""
DROPS = (0.02, 0.05, 0.1)
"""Heights of fall at which leg and template are compared [m]."""


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
    basin: int = 0
    """Number of points on each side of the basin map; 0 makes none."""
    across: str = "z1"
    """Coordinate that varies to the right in the basin map."""
    across_span: float = 0.3
    """Range of that coordinate to either side."""
    up: str = "height"
    """Coordinate that varies upwards in the basin map."""
    up_span: float = 0.08
    """Range of that coordinate to either side."""
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
    content = _passive(flags, design) if flags.passive else _driven(flags, design)
    if flags.json:
        print_json(content)
    if flags.out is not None:
        _save(flags.out, content)
    return 0


def _check(flags: HopArguments) -> None:
    """Refuse what would only be found after the leg has hopped."""
    if flags.hops < 1:
        raise ConfigError(f"hops is {flags.hops}; it must be 1 or more")
    if flags.height is not None and not 0.0 < flags.height < math.inf:
        raise ConfigError(f"height is {flags.height:g} m; an apex lies above the ground")
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
    for name, span in ((flags.across, flags.across_span), (flags.up, flags.up_span)):
        Axis(name=name, low=-span, high=span, count=flags.basin)


def _driven(flags: HopArguments, design: LegDesign) -> dict[str, Any]:
    model, law = LegModel.of(design), JumpLaw(flags.jump, design)
    leg = TaylorLeg(model, probe=law.probe)
    z2 = flags.jump.z2 + flags.jump.dz2
    q = (-z2 * math.sqrt(0.5), z2 * math.sqrt(0.5))
    standing = model.mass_centre_from_hip(q)[1] - model.foot_from_hip(q)[1]
    height = standing + 0.03 if flags.height is None else flags.height
    start = Apex(height=height, speed=0.0, z1=0.0, z2=z2, dz1=0.0, dz2=0.0)
    apexes = settle(leg, law, start, flags.hops)
    if len(apexes) <= flags.hops:
        ending = return_map(leg, law, apexes[-1]).ending
        raise ConfigError(
            f"the leg stops hopping after {len(apexes) - 1} of {flags.hops} hops from an apex of "
            f"{height:.4g} m: {WHY[ending]}"
        )
    point = fixed_point(leg, law, apexes[-1])
    content: dict[str, Any] = {
        "design": design.name,
        "drive": "jump",
        "jump": asdict(flags.jump),
        "apexes": [asdict(apex) for apex in apexes],
        "fixed_points": [_point(point)],
    }
    if not flags.json:
        print(f"{design.name} under the jump controller (continuous time)")
        print("\nhop   apex height [m]   speed [m/s]   z1 [rad]")
        for index in range(0, len(apexes), max(1, len(apexes) // 12)):
            apex = apexes[index]
            print(f"{index:3d} {apex.height:17.5f} {apex.speed:13.5f} {apex.z1:10.5f}")
        _print_point(point)
    if flags.out is not None:
        _plot_return(flags.out, design, apexes, point)
    if flags.basin and not point.stable:
        note(
            f"no basin: the periodic hop is not stable, its largest multiplier is "
            f"{abs(point.multipliers[0]):.4g}; no start stays there"
        )
    elif flags.basin and flags.out is not None:
        fates = _basin(flags, design, point, flags.out)
        content["basin"] = _share(fates)
        if not flags.json:
            print("\nbasin   " + ", ".join(f"{k} {v:.1%}" for k, v in _share(fates).items()))
    return content


def _passive(flags: HopArguments, design: LegDesign) -> dict[str, Any]:
    from legbench.design.setup import SetupKind

    scene = make_scene(design, SetupKind.JUMP, flags.rest)
    half = float(half_angle(np.array(scene.motor)))
    leg = TaylorLeg(LegModel.of(design, undamped=True), probe=Passive.probe)
    hops = []
    for depth in depths(leg, half, np.linspace(scene.rest[1], 0.5 * design.limits.knee[1], 150)):
        found = free_hop(leg, half, depth)
        if found is None:
            note(
                f"no hop without impact near a stance folded to {depth:.3f} rad: a joint meets "
                "its stop on the way, or the leg is too far from matched"
            )
        else:
            hops.append(found)
    slip = Slip.of(leg.model, half)
    compared = [
        {"drop": drop, "leg": asdict(leg_groups(leg, slip, half, drop))}
        | {"slip": asdict(slip_groups(slip, drop))}
        for drop in DROPS
    ]
    if not flags.json:
        print(f"{design.name}, motors held around half angle {half:.4f} rad, undamped")
        _print_free(hops)
        _print_slip(slip, compared)
    return {
        "design": design.name,
        "drive": "passive",
        "support": str(Support.FOOT),
        "motor_half": half,
        "fixed_points": [_free(found) for found in hops],
        "slip": asdict(slip) | {"firmness": slip.firmness},
        "compared": compared,
    }


def _print_free(hops: list[FreeHop]) -> None:
    print(f"\nhops without impact: {len(hops)}")
    if any(abs(found.motor_z1) > MATCHED for found in hops):
        print(
            "This leg is not quite matched: x1 = 0 does not stay, and a hop without impact needs\n"
            "the motors at a polar set point z1 of its own; at z1 = 0 there is none."
        )
    for found in hops:
        _print_point(found.point, "indication only, the map is not smooth here")
        print(
            f"  motors at z1 {found.motor_z1:+.6f} rad; at z1 = 0 the hop from there loses "
            f"{1e3 * found.symmetric_loss:.3g} mJ"
        )


def _free(found: FreeHop) -> dict[str, Any]:
    return _point(found.point) | {
        "motor": list(found.motor),
        "motor_z1": found.motor_z1,
        "symmetric_loss": found.symmetric_loss,
    }


def _print_slip(slip: Slip, compared: list[dict[str, Any]]) -> None:
    print(
        f"\ntemplate: m = {slip.mass:.4g} kg, k = {slip.stiffness:.4g} N/m, "
        f"l = {slip.length:.4g} m, k l / m g = {slip.firmness:.3f}"
    )
    names = list(compared[0]["leg"])
    print("            " + " ".join(f"{name:>13}" for name in names))
    for entry in compared:
        for who in ("leg", "slip"):
            print(f"{who:<12}" + " ".join(f"{entry[who][name]:13.4f}" for name in names))


def _print_point(point: FixedPoint, verdict: str = "") -> None:
    apex, done = point.apex, point.hop
    flight = done.duration - (done.liftoff - done.touchdown)
    sizes = ", ".join(f"{abs(value):.4g}" for value in point.multipliers)
    print(
        f"\nperiodic hop   apex {apex.height:.5f} m, speed {apex.speed:+.5f} m/s, "
        f"z1 {apex.z1:+.5f} rad, z2 {apex.z2:.5f} rad"
    )
    print(
        f"  period {done.duration:.5f} s, flight {flight:.5f} s, impact {1e3 * done.impact:.3g} mJ"
    )
    print(f"  multipliers {sizes}: {verdict or ('stable' if point.stable else 'not stable')}")


def _point(point: FixedPoint) -> dict[str, Any]:
    return {
        "apex": asdict(point.apex),
        "period": point.hop.duration,
        "touchdown": point.hop.touchdown,
        "liftoff": point.hop.liftoff,
        "impact": point.hop.impact,
        "multipliers": [[value.real, value.imag] for value in point.multipliers],
        "residual": point.residual,
    }


def _plot_return(out: Path, design: LegDesign, apexes: list[Apex], point: FixedPoint) -> None:
    from legbench.viz.print.modes import plot_return

    heights = np.array([apex.height for apex in apexes])
    pairs = np.stack([heights[:-1], heights[1:]], axis=-1)
    title = f"{design.name}: apex return map"
    plot_return(pairs, point.apex.height, title, out / "return.png")
    note(f"wrote {out / 'return.png'}")


def _basin(flags: HopArguments, design: LegDesign, point: FixedPoint, out: Path) -> Ints:
    from legbench.viz.print.modes import plot_basin

    def axis(name: str, span: float) -> Axis:
        middle = getattr(point.apex, name, 0.0)
        return Axis(name=name, low=middle - span, high=middle + span, count=flags.basin)

    question = Question(
        design=design,
        jump=flags.jump,
        motor=(0.0, 0.0),
        undamped=False,
        centre=point.apex,
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


def _save(out: Path, content: dict[str, Any]) -> None:
    write_json(out / "hop.json", content)
    note(f"wrote {out / 'hop.json'}")
