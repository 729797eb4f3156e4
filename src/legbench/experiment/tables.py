"""Tables of an experiment, from a file, a run or flags."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final, TypeVar

from legbench.control import CONTROLLERS
from legbench.design import LegDesign, load_design
from legbench.design.toml import UNITS, design_from_mapping, design_to_mapping
from legbench.errors import ConfigError
from legbench.experiment.format_1 import upgraded
from legbench.experiment.reading import Reader, Special, placed
from legbench.experiment.writing import Writer
from legbench.guests import load_text
from legbench.limits.safety import SafetyLimits
from legbench.reading import UnreadableError
from legbench.reading import read_toml as read_any_toml

Read = TypeVar("Read")
FORMAT: Final = 2
"""Version of the format; it rises when an older reader would misunderstand an experiment file.

Since 2 a step, a loop closure and bars that are not there are those that suit the leg, and a rating
reference that is not there is the one that suits the setup.
"""
USUAL_PLANT: Final = "sim"
"""Plant of an experiment whose file names none."""
_SEGMENT: Final = {"mass": 0, "length": 0, "com": 0, "inertia": 0}
_DESIGN: Final = {
    "name": "",
    "units": dict.fromkeys(UNITS, ""),
    "trunk": {"mass": 0},
    "thigh": _SEGMENT,
    "shank": _SEGMENT,
    "foot": _SEGMENT,
    "springs": {"stiffness": [], "damping": []},
    "limits": {"hip": [], "knee": []},
}


def _load_limits(path: Path) -> SafetyLimits:
    return load_text("legbench.drives.setup.bus_file:load_limits")(path)


SPECIALS: Final = {
    LegDesign: Special(
        load=load_design,
        decode=design_from_mapping,
        structure=_DESIGN,
    ),
    SafetyLimits: Special(load=_load_limits),
}
"""Values that may be given as a file, and the design, whose tables have units."""


def read_tables(
    kind: type[Read], tables: Mapping[str, Any], folder: Path, *, json: bool = False
) -> Read:
    """An experiment from its tables; without a setup it gets the controller's usual
    one, without a plant MuJoCo.

    Args:
        kind: class of the experiment.
        tables: what a file holds.
        folder: what paths in it are relative to.
        json: whether the tables come from JSON.

    Raises:
        ConfigError: a newer version wrote them, or something is wrong with them; all of it is told.
    """
    version = tables.get("format", FORMAT)
    if not isinstance(version, int) or isinstance(version, bool) or version < 1:
        raise ConfigError(f"format is {version!r}; it must be 1 to {FORMAT}")
    if version > FORMAT:
        raise ConfigError(
            f"format {version} was written by a newer legbench; this one reads up to {FORMAT}: "
            "upgrade"
        )
    content = {key: value for key, value in tables.items() if key != "format"}
    if version == 1:
        content = upgraded(content)
    reader = Reader(folder=folder, specials=SPECIALS, json=json)
    return reader.read(kind, _with_usual_setup(_with_usual_plant(content), folder))


def _with_usual_plant(tables: dict[str, Any]) -> dict[str, Any]:
    plant = tables.get("plant")
    if not isinstance(plant, Mapping) or "kind" in plant:
        return tables
    return tables | {"plant": {"kind": USUAL_PLANT} | dict(plant)}


def _with_usual_setup(tables: dict[str, Any], folder: Path) -> dict[str, Any]:
    controller, setup = tables.get("controller"), tables.get("setup", {})
    if not isinstance(controller, Mapping) or not isinstance(setup, Mapping) or "kind" in setup:
        return tables
    try:
        kind = CONTROLLERS.find(placed(str(controller.get("kind")), folder))
    except ConfigError:
        return tables  # the reader tells
    return tables | {"setup": {"kind": str(kind.usual_setup)} | dict(setup)}


def write_tables(experiment: Any, folder: Path | None = None, *, where: bool = True) -> Any:
    """Tables of an experiment in SI units, the design inline.

    Args:
        experiment: what to write.
        folder: what paths are made relative to; none: they are told as they are.
        where: whether to tell files, interface and channel, which say where, not what.

    Raises:
        ConfigError: a guest that lives in no file, so that nobody could find it again.
    """
    writer = Writer(tables_of={LegDesign: design_to_mapping}, folder=folder, where=where)
    return writer.write(experiment)


def read_toml(path: Path) -> dict[str, Any]:
    """The tables of a TOML file; raises ConfigError."""
    try:
        return read_any_toml(path)
    except FileNotFoundError:
        raise ConfigError(f"{path}: no such experiment file") from None
    except UnreadableError as error:
        raise ConfigError(f"{path}: {error}") from None
