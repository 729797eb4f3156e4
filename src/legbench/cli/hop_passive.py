"""`legbench hop --passive`: hops without motors, and the template beside them."""

from dataclasses import asdict
from typing import Any

import numpy as np

from legbench.analytic import LegModel
from legbench.analytic.taylor import TaylorLeg
from legbench.cli.hop_tables import point_content, point_lines
from legbench.cli.output import note
from legbench.design import LegDesign
from legbench.design.statics import Support
from legbench.kinematics import half_angle
from legbench.modes.drive import Passive
from legbench.modes.passive import FreeHop, depths, free_hop
from legbench.modes.scene import Holding, make_scene
from legbench.modes.slip import Slip, leg_groups, slip_groups

MATCHED = 1e-5
"""Polar set point of the motors that is smaller than a count of most encoders [rad]."""
DROPS = (0.02, 0.05, 0.1)
"""Heights of fall at which leg and template are compared [m]."""


def answer(design: LegDesign, rest: float) -> tuple[dict[str, Any], list[str]]:
    """Hops without impact of a leg that stands at z2 = `rest` [rad], as JSON and as lines."""
    scene = make_scene(design, Holding.JUMP, rest)
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
    content = {
        "design": design.name,
        "drive": "passive",
        "support": str(Support.FOOT),
        "motor_half": half,
        "fixed_points": [_free(found) for found in hops],
        "slip": asdict(slip) | {"firmness": slip.firmness},
        "compared": compared,
    }
    lines = [f"{design.name}, motors held around half angle {half:.4f} rad, undamped"]
    return content, [*lines, *_free_lines(hops), *_slip_lines(slip, compared)]


def _free_lines(hops: list[FreeHop]) -> list[str]:
    lines = ["", f"hops without impact: {len(hops)}"]
    if any(abs(found.motor_z1) > MATCHED for found in hops):
        lines += [
            "This leg is not quite matched: x1 = 0 does not stay, and a hop without impact needs",
            "the motors at a polar set point z1 of its own; at z1 = 0 there is none.",
        ]
    for found in hops:
        lines += point_lines(found.point, "indication only, the map is not smooth here")
        lines.append(
            f"  motors at z1 {found.motor_z1:+.6f} rad; at z1 = 0 the hop from there loses "
            f"{1e3 * found.symmetric_loss:.3g} mJ"
        )
    return lines


def _free(found: FreeHop) -> dict[str, Any]:
    return point_content(found.point) | {
        "motor": list(found.motor),
        "motor_z1": found.motor_z1,
        "symmetric_loss": found.symmetric_loss,
    }


def _slip_lines(slip: Slip, compared: list[dict[str, Any]]) -> list[str]:
    names = list(compared[0]["leg"])
    lines = [
        "",
        f"template: m = {slip.mass:.4g} kg, k = {slip.stiffness:.4g} N/m, "
        f"l = {slip.length:.4g} m, k l / m g = {slip.firmness:.3f}",
        "            " + " ".join(f"{name:>13}" for name in names),
    ]
    for entry in compared:
        for who in ("leg", "slip"):
            lines.append(f"{who:<12}" + " ".join(f"{entry[who][name]:13.4f}" for name in names))
    return lines
