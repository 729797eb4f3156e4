"""`legbench modes`: linear and nonlinear modes of a leg around an equilibrium."""

import math
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Annotated, Any

import tyro

from legbench.cli.output import note, print_json, progress, write_json
from legbench.cli.parse import parse
from legbench.design import load_design
from legbench.design.setup import SetupKind
from legbench.errors import ConfigError
from legbench.modes.brake import BrakeOrbit, Family, at_energy, floquet, follow
from legbench.modes.linear import LinearMode, linear_modes
from legbench.modes.scene import Scene, make_scene
from legbench.modes.strict import Strictness, check, radial_line, radial_reach


@dataclass(frozen=True, slots=True, kw_only=True)
class ModesArguments:
    """Modes of an undamped leg: linear, strict or not, nonlinear by continuation in energy."""

    design: Annotated[Path, tyro.conf.Positional]
    """Design file."""
    setup: SetupKind = SetupKind.FFS
    """Setup in which the leg is held; `jump` means its stance."""
    z2: float = 0.9
    """Set point at which the link rests, orthonormal [rad]."""
    energy: float = 0.2
    """Energy above rest up to which the modes are followed [J]."""
    at: float | None = None
    """Show the orbits of just this energy instead of the last ones [J]."""
    reach: float = 0.3
    """Range of z2 either way over which strictness is checked, within the joint limits [rad]."""
    out: Path | None = None
    """Folder for modes.json and modes.png; without it nothing is written."""
    json: bool = False
    """Whether to print one JSON object instead of tables."""


def main(arguments: list[str]) -> int:
    """Run `legbench modes`."""
    flags = parse(ModesArguments, "modes", arguments)
    for name in ("energy", "at", "reach"):
        value = getattr(flags, name)
        if value is not None and not 0.0 < value < math.inf:
            unit = "rad" if name == "reach" else "J"
            raise ConfigError(f"{name} is {value:g} {unit}; it must be positive")
    scene = make_scene(load_design(flags.design), flags.setup, flags.z2)
    linear = linear_modes(scene)
    reach = min(flags.reach, radial_reach(scene))
    if reach < flags.reach:
        note(f"strictness is checked {reach:.3f} rad either way: there a joint reaches its limit")
    strict = check(scene, radial_line(scene, reach), 2.0 / linear["radial"].freq)
    families = [
        follow(scene, name, max(flags.energy, flags.at or 0.0), progress=progress)
        for name in ("radial", "polar")
    ]
    shown = {}
    for family in families:
        found = family.orbits[-1] if flags.at is None else at_energy(scene, family, flags.at)
        shown[family.mode.name] = (found, floquet(scene, found))
    content = _content(scene, linear, strict, families, shown) | {"reach": reach}
    if flags.json:
        print_json(content)
    else:
        _tables(scene, linear, strict, families, shown)
    if flags.out is not None:
        _write(flags.out, content, scene, families)
    return 0


Shown = dict[str, tuple[BrakeOrbit, tuple[complex, ...]]]


def _content(
    scene: Scene,
    linear: dict[str, LinearMode],
    strict: Strictness,
    families: list[Family],
    shown: Shown,
) -> dict[str, Any]:
    return {
        "design": scene.design.name,
        "setup": str(scene.kind),
        "rest": list(scene.rest),
        "motor": list(scene.motor),
        "strictness": asdict(strict),
        "modes": {
            family.mode.name: {
                "freq": family.mode.freq,
                "shape": linear[family.mode.name].shape.tolist(),
                "alignment": family.mode.alignment,
                "ended": family.ended,
                "orbits": [_orbit(found) for found in family.orbits],
                "shown": _orbit(shown[family.mode.name][0])
                | {"multipliers": [[m.real, m.imag] for m in shown[family.mode.name][1]]},
            }
            for family in families
        },
    }


def _orbit(found: BrakeOrbit) -> dict[str, Any]:
    return {
        "energy": found.energy,
        "period": found.period,
        "start": found.start.tolist(),
        "end": found.end.tolist(),
        "bend": found.bend,
    }


def _tables(
    scene: Scene,
    linear: dict[str, LinearMode],
    strict: Strictness,
    families: list[Family],
    shown: Shown,
) -> None:
    q1, q2 = scene.rest
    print(f"{scene.design.name}, {scene.kind}, undamped, at rest at q = ({q1:.4f}, {q2:.4f}) rad")
    print("\nlinear      freq [Hz]   shape (q1, q2)        alignment")
    for mode in linear.values():
        shape = f"({mode.shape[0]:+.4f}, {mode.shape[1]:+.4f})"
        print(f"{mode.name:<10} {mode.freq:10.4f}   {shape}   {mode.alignment:12.8f}")
    print("\nx1 = 0 as a strict mode")
    print(f"  geodesic residual   {strict.geodesic:10.2e} 1/rad")
    print(f"  force off the line  {strict.force:10.2e}")
    print(f"  leaves the line by  {strict.invariance:10.2e} rad in two periods")
    for family in families:
        print(f"\n{family.mode.name} mode   energy [J]   freq [Hz]   bend [rad]   ends at (q1, q2)")
        for found in family.orbits[:: max(1, len(family.orbits) // 8)]:
            _line(found)
        print(f"  followed to {family.largest:.4g} J: {family.ended}")
        found, multipliers = shown[family.mode.name]
        sizes = ", ".join(f"{abs(value):.6f}" for value in multipliers)
        print(f"  Floquet multipliers at {found.energy:.4g} J: {sizes}")


def _line(found: BrakeOrbit) -> None:
    ends = ", ".join(f"({end[0]:+.3f}, {end[1]:+.3f})" for end in (found.start, found.end))
    print(f"{'':<13} {found.energy:10.5f} {1.0 / found.period:11.5f} {found.bend:12.2e}   {ends}")


def _write(out: Path, content: dict[str, Any], scene: Scene, families: list[Family]) -> None:
    from legbench.viz.print.modes import plot_modes

    write_json(out / "modes.json", content)
    plot_modes(scene, families, out / "modes.png")
    note(f"wrote {out / 'modes.json'} and {out / 'modes.png'}")
