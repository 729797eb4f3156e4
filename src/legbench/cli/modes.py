"""`legbench modes`: linear and nonlinear modes of a leg around an equilibrium."""

import math
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import tyro

from legbench.cli.output import note, print_json, results_in, timed_progress, write_json
from legbench.cli.parse import parse
from legbench.design import load_design
from legbench.errors import ConfigError
from legbench.modes.linear import linear_modes
from legbench.modes.scene import Holding, Scene, make_scene

if TYPE_CHECKING:
    from legbench.cli.modes_found import ModesFound


class Followed(StrEnum):
    """Choice of the modes that are followed."""

    RADIAL = "radial"
    POLAR = "polar"
    BOTH = "both"


@dataclass(frozen=True, slots=True, kw_only=True)
class ModesArguments:
    """Modes of a leg: linear, strict or not, nonlinear families with their stability; damped modes
    and the response to moving motors where they are asked for.
    """

    design: Annotated[Path, tyro.conf.Positional]
    """Design file."""
    setup: Holding = Holding.FFS
    """Setup in which the leg is held; `jump` means its stance."""
    z2: float = 0.9
    """Set point at which the link rests, orthonormal [rad]."""
    energy: float = 0.2
    """Energy above rest up to which the modes are followed [J]."""
    at: float | None = None
    """Show the orbits of just this energy instead of the last ones [J]."""
    family: Followed = Followed.BOTH
    """Mode that is followed, or both."""
    branches: bool = False
    """Follow the families that branch off where stability changes, too."""
    damped: bool = False
    """Follow the modes of the damped leg, too."""
    respond: tuple[float, ...] = ()
    """Amplitudes of motors that switch between z2 + dz2 and z2 - dz2: the damped leg's response
    over frequency [rad]."""
    ride: float | None = None
    """Largest dz2 up to which the limit cycles of bang-bang are followed [rad]."""
    threshold: float = 0.01
    """Modal spring torque at which bang-bang switches [N m]."""
    reach: float = 0.3
    """Range of z2 either way over which strictness is checked, within the joint limits [rad]."""
    out: Path | None = None
    """Folder for modes.json, pictures, and the orbits as trajectories (orbits.json and
    orbits.parquet); without it nothing is written."""
    json: bool = False
    """Whether to print one JSON object instead of tables."""


def main(arguments: list[str]) -> int:
    """Run `legbench modes`."""
    flags = parse(ModesArguments, "modes", arguments)
    _check(flags)
    scene = make_scene(load_design(flags.design), flags.setup, flags.z2)
    with results_in(flags.out):
        return _answer(flags, scene)


def _answer(flags: ModesArguments, scene: Scene) -> int:
    """Compute what was asked for, print it and write it."""
    found = _found(flags, scene)
    from legbench.cli.modes_content import content_of
    from legbench.cli.modes_tables import tables

    for family in found.families:
        for warning in family.warnings:
            note(f"{family.mode.name} mode: {warning}")
    if flags.json:
        print_json(content_of(found) | {"out": flags.out and str(flags.out)})
    else:
        print("\n".join(tables(found)))
    if flags.out is not None:
        _write(flags.out, found)
    return 0


def _check(flags: ModesArguments) -> None:
    """Refuse what would only be found after the modes have been followed."""
    for name in ("energy", "at", "reach", "ride", "threshold"):
        value = getattr(flags, name)
        if value is not None and not 0.0 < value < math.inf:
            unit = {"energy": "J", "at": "J", "threshold": "N m"}.get(name, "rad")
            raise ConfigError(f"{name} is {value:g} {unit}; it must be positive and finite")
    for dz2 in flags.respond:
        if not 0.0 < dz2 < math.inf:
            raise ConfigError(f"respond is {dz2:g} rad; it must be positive and finite")


def _found(flags: ModesArguments, scene: Scene) -> "ModesFound":
    """Everything that was asked for, in the order in which it is cheap to fail."""
    from legbench.cli.modes_found import ModesFound, damped_of, families_of, responses_of
    from legbench.modes.strict import check, radial_line, radial_reach

    linear = linear_modes(scene)
    reach = min(flags.reach, radial_reach(scene))
    if reach < flags.reach:
        note(f"strictness is checked {reach:.3f} rad either way: there a joint reaches its limit")
    strict = check(scene, radial_line(scene, reach), 2.0 / linear["radial"].freq)
    names = ("radial", "polar") if flags.family is Followed.BOTH else (str(flags.family),)
    curves, ridden = responses_of(scene, flags.respond, flags.ride, flags.threshold)
    families, shown, branched = families_of(
        scene, names, flags.energy, flags.at, branched=flags.branches, progress=timed_progress()
    )
    return ModesFound(
        scene=scene,
        linear=linear,
        strict=strict,
        reach=reach,
        families=families,
        shown=shown,
        branches=branched,
        damped=damped_of(scene, names, flags.energy) if flags.damped else (),
        curves=curves,
        ridden=ridden,
    )


def _write(out: Path, found: "ModesFound") -> None:
    from legbench.cli.modes_content import content_of
    from legbench.modes.trajectory import paths_to_json
    from legbench.modes.trajectory_file import write_paths
    from legbench.viz.print.modes import plot_modes
    from legbench.viz.print.responses import plot_responses

    paths = found.paths()
    write_json(out / "modes.json", content_of(found))
    write_json(out / "orbits.json", {"orbits": paths_to_json(paths)})
    write_paths(paths, out / "orbits.parquet")
    plot_modes(found.scene, found.families, found.branches, out / "modes.png")
    written = ["modes.json", "orbits.json", "orbits.parquet", "modes.png"]
    if found.damped or found.curves or found.ridden is not None:
        plot_responses(
            found.scene,
            found.families,
            found.damped,
            found.curves,
            found.ridden,
            out / "responses.png",
        )
        written.append("responses.png")
    note(f"wrote {', '.join(written)} to {out}")
