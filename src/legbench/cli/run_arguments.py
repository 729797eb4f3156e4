"""Flags of `legbench run`: those of every run, and those of the chosen controller and plant."""

from collections.abc import Iterator, Mapping
from dataclasses import MISSING, dataclass, field, fields, make_dataclass
from enum import Enum
from pathlib import Path
from types import NoneType, UnionType
from typing import Annotated, Any, Literal, Union, get_args, get_origin, get_type_hints

import tyro

from legbench.control import SetpointMeaning
from legbench.design.setup import SetupKind
from legbench.experiment.docs import field_docs
from legbench.experiment.reading import BAD, Reader
from legbench.experiment.tables import SPECIALS
from legbench.kinematics import ModalConvention
from legbench.mjcf.options import Ground, LinkageKind


@dataclass(frozen=True, slots=True, kw_only=True)
class CommonArguments:
    """Run a controller on a leg, record it, rate it."""

    design: Path | None = Path("models/optimal.toml")
    """Design file of the leg."""
    setup: SetupKind | None = None
    """How the leg is held; by default where the controller is at home: jump for jump, ffs for the
    others that are built in."""
    boom_radius: float | None = None
    """Length of the boom that guides the trunk in ffs [m]; by default a plane."""
    linkage: LinkageKind = LinkageKind.BARS
    """Linkage of the segments: physical parallel bars, or the constraint that they make."""
    tip_radius: float = Ground().tip_radius
    """Radius of the rolling foot tip [m]."""
    plant: str = "sim"
    """What is controlled: sim (MuJoCo), analytic (the paper's equations), can (the drives on a
    bus), an installed one, or path/to/mine.py:Class."""
    limits: Path | None = None
    """Safety limits; on can by default limits.toml beside the bus file, elsewhere none."""
    setpoint: SetpointMeaning = SetpointMeaning.LINK
    """Meaning of z2: the link's equilibrium, or the motor's position."""
    convention: ModalConvention = ModalConvention.ORTHONORMAL
    """Reading of eq. (15), which scales the modal coordinates."""
    duration: float = 8.0
    """Length of the run [s]."""
    seed: int = 0
    """Source of all randomness, which is the noise of encoders."""
    set: str | None = None
    """Replace an entry of the experiment, in the words of its file, such as
    design.springs.stiffness="[2.5, 2.3]"; may be repeated, other flags come after it."""
    again: Path | None = None
    """Run folder whose experiment is run again, instead of a controller or a file."""
    out: Path = Path("runs")
    """Folder of the runs."""
    real_time: bool = False
    """Whether to pace the simulation by the wall clock; watching does so, too."""
    view: bool = False
    """Whether to watch the run live in rerun, from a process of its own."""
    serve: bool = False
    """Whether to watch the run live in a browser on this machine."""
    json: bool = False
    """Print one JSON object on stdout."""


KEYS = {
    "boom_radius": "setup.boom_radius",
    "tip_radius": "ground.tip_radius",
    "limits": "plant.settings.limits",
    "setpoint": "conventions.setpoint",
    "convention": "conventions.modal",
    "duration": "duration",
    "seed": "seed",
}
"""Flag -> its place in an experiment file; those of kinds and files are scanned before."""
PLAIN = (float, int, bool, str, Path)


@dataclass(frozen=True, slots=True, kw_only=True)
class GuestFlag:
    """Flag that stands for a field of the settings of a controller, a plant or the servo."""

    attribute: str
    """Name of the field in the parsed arguments."""
    key: str
    """Dotted key in an experiment file."""
    name: str
    """Name of the flag without its dashes."""
    hint: Any
    default: Any
    """Default: the value of the file, else that of the class; MISSING where neither has one."""
    doc: str


def guest_flags(
    place: str, kind: type[Any], taken: set[str], settings: Mapping[str, Any], folder: Path
) -> Iterator[GuestFlag]:
    """Flags of the fields of some settings; a field whose name is taken keeps its prefix.

    Args:
        place: where they stand in a file, such as `controller.settings`.
        kind: class of the settings.
        taken: names of flags that are there already.
        settings: what a file says of them.
        folder: what paths in it are relative to.
    """
    hints, docs = get_type_hints(kind), field_docs(kind)
    room = place.partition(".")[0]
    for entry in fields(kind):
        hint = hints[entry.name]
        if not entry.init or not _is_plain(hint):
            continue
        default = entry.default
        if default is MISSING and entry.default_factory is not MISSING:
            default = entry.default_factory()
        yield GuestFlag(
            attribute=f"{room}_{entry.name}",
            key=f"{place}.{entry.name}",
            name=f"{room}.{entry.name}" if entry.name in taken else entry.name,
            hint=hint,
            default=_value(said(hint, settings.get(entry.name), folder, default)),
            doc=docs.get(entry.name, ""),
        )


def said(hint: Any, raw: Any, folder: Path, default: Any) -> Any:
    """Value that a file has for a field, or the default where the file has none of its type."""
    if raw is None:
        return default
    value = Reader(folder=folder, specials=SPECIALS).value(hint, raw, "")
    return default if value is BAD else value


def arguments_with(flags: list[GuestFlag], defaults: Mapping[str, Any]) -> type[Any]:
    """Dataclass whose fields are all flags of the command.

    Args:
        flags: those of the guests.
        defaults: what a file says of the common ones.
    """
    common = [(entry.name, entry) for entry in fields(CommonArguments)]
    hints, docs = get_type_hints(CommonArguments, include_extras=True), field_docs(CommonArguments)
    made: list[Any] = []
    for name, entry in common:
        value = _value(defaults.get(name, entry.default))
        shown, described = quick(hints[name]), tyro.conf.arg(help=docs[name])
        made.append((name, Annotated[shown, described], field(default=value)))
    for flag in flags:
        given = field() if flag.default is MISSING else field(default=flag.default)
        described = tyro.conf.arg(name=flag.name.replace("_", "-"), help=flag.doc)
        shown = quick(flag.hint)
        made.append((flag.attribute, Annotated[shown, described], given))
    namespace = {"__doc__": CommonArguments.__doc__}
    return make_dataclass("RunArguments", made, kw_only=True, frozen=True, namespace=namespace)


def quick(hint: Any) -> Any:
    """Type that tyro understands without its type checker, which is slow to import.

    An enum becomes the choice of its values, `X | Y` becomes `Union[X, Y]`, None first: tyro takes
    the first that a default fits, and asks its type checker about tuples.
    """
    if get_origin(hint) in (Union, UnionType):
        sorted_hints = sorted(get_args(hint), key=lambda each: each is not NoneType)
        members = tuple(quick(each) for each in sorted_hints)
        # pyrefly: ignore[not-a-type]
        return Union[members]  # noqa: UP007
    if isinstance(hint, type) and issubclass(hint, Enum):
        return Literal[tuple(member.value for member in hint)]  # pyrefly: ignore[invalid-literal]
    return hint


def _value(default: Any) -> Any:
    return default.value if isinstance(default, Enum) else default


def _is_plain(hint: Any) -> bool:
    """Whether a type can be written behind a flag."""
    origin = get_origin(hint)
    if origin in (Union, UnionType, tuple):
        inner = [each for each in get_args(hint) if each not in (NoneType, Ellipsis)]
        return all(map(_is_plain, inner))
    if origin is Literal:
        return True
    return isinstance(hint, type) and (issubclass(hint, Enum) or hint in PLAIN)
