"""`legbench model`: the MuJoCo model of a design."""

from dataclasses import dataclass
from pathlib import Path

from legbench.cli.output import note, print_json
from legbench.cli.parse import parse
from legbench.design import load_design
from legbench.design.setup import Setup, SetupKind
from legbench.errors import RecordingError
from legbench.mjcf import BuildOptions, Linkage, LinkageKind, build_spec, to_xml, xml_hash
from legbench.mjcf.plain import plain_xml
from legbench.writing import reason, write_whole


@dataclass(frozen=True, slots=True, kw_only=True)
class ModelArguments:
    """Write or view the MuJoCo model of a design."""

    design: Path = Path("models/optimal.toml")
    """Design file of the leg."""
    setup: SetupKind = SetupKind.JUMP
    """Setup in which the leg is held."""
    boom_radius: float | None = None
    """Length of the boom that guides the trunk in ffs [m]; by default a plane."""
    linkage: LinkageKind = LinkageKind.BARS
    """Linkage of the segments: physical parallel bars, or the constraint that they make."""
    plain: bool = False
    """Whether to leave out what MJX and MuJoCo Warp refuse: the contact sensor, the energy flag and
    autoreset, none of which changes the motion."""
    out: Path | None = None
    """MJCF file to write; by default it goes to stdout."""
    view: bool = False
    """Whether to open the model in MuJoCo's viewer."""
    json: bool = False
    """Print one JSON object on stdout: file and SHA-256."""


def main(arguments: list[str]) -> int:
    """Run `legbench model`: build the model, then write or view it."""
    chosen = parse(ModelArguments, "model", arguments)
    options = BuildOptions(
        setup=Setup(kind=chosen.setup, boom_radius=chosen.boom_radius),
        linkage=Linkage(kind=chosen.linkage),
    )
    spec = build_spec(load_design(chosen.design), options)
    xml = plain_xml(spec) if chosen.plain else to_xml(spec)
    if chosen.out is not None:
        _write(chosen.out, xml)
        note(f"wrote {chosen.out}")
    if chosen.view:
        from legbench.viz.live.mujoco_viewer import view_model

        view_model(xml)
    if chosen.json:
        print_json({"out": chosen.out and str(chosen.out), "mjcf_sha256": xml_hash(xml)})
    elif chosen.out is None and not chosen.view:
        print(xml, end="")
    return 0


def _write(path: Path, xml: str) -> None:
    """Write a file that is whole or not there; a pipe or a device is written to as it is."""
    try:
        if path.is_file() or not path.exists():
            write_whole(path.resolve(), xml.encode())
        else:
            path.write_text(xml, encoding="utf-8")
    except OSError as error:
        raise RecordingError(f"cannot write {path}: {reason(error)}") from None
