"""The experiment that `legbench run` is asked for: the file, then `--set`, then flags."""

from collections.abc import Sequence
from dataclasses import MISSING, dataclass, field, fields
from pathlib import Path
from typing import Any, Final, get_type_hints

from legbench.cli.parse import parse
from legbench.cli.run_arguments import (
    KEYS,
    CommonArguments,
    GuestFlag,
    arguments_with,
    guest_flags,
    said,
)
from legbench.control import CONTROLLERS
from legbench.errors import ConfigError
from legbench.experiment.data import Experiment
from legbench.experiment.overrides import overlaid, parse_setting
from legbench.experiment.reading import placed
from legbench.experiment.tables import read_tables, read_toml
from legbench.experiment.writing import Writer
from legbench.guests import Registry
from legbench.imperfections import Imperfections
from legbench.plants import PLANTS
from legbench.servo import ServoConfig
from legbench.shipped import locate

SCANNED = {"--setup": "setup.kind", "--linkage": "linkage.kind", "--plant": "plant.kind"}
"""Flags that choose a kind: they decide which other flags there are."""


@dataclass(slots=True, kw_only=True)
class ChosenWords:
    """Words of the command line that decide which flags there are."""

    subject: str | None = None
    """Name of a controller, or path of an experiment file."""
    settings: list[str] = field(default_factory=list)
    """Texts behind `--set`."""
    values: dict[str, str] = field(default_factory=dict)
    """Flag -> its value, of those that must be known first."""
    rest: list[str] = field(default_factory=list)
    """Words of the command line without the subject."""


def scan(words: Sequence[str]) -> ChosenWords:
    """Pick out of the command line what decides which flags there are."""
    found = ChosenWords()
    waiting = list(words)
    if waiting and not waiting[0].startswith("-"):
        found.subject = waiting.pop(0)
    while waiting:
        word = waiting.pop(0)
        flag, equals, value = word.partition("=")
        if flag == "--set" and (equals or waiting):
            found.settings.append(value if equals else waiting.pop(0))
            continue
        if flag in ("--again", "--design", *SCANNED) and (equals or waiting):
            found.values[flag] = value if equals else waiting[0]
        found.rest.append(word)
    return found


@dataclass(slots=True, kw_only=True)
class Tables:
    """Tables of an experiment on their way from file to flags."""

    content: dict[str, Any]
    folder: Path
    """Folder to which paths are relative."""
    json: bool = False

    def put(self, key: str, value: Any) -> None:
        """Replace the entry at a dotted key; raises ConfigError."""
        self.content = overlaid(self.content, key, value, self.folder)

    def here(self, path: Path) -> str:
        """Path of the command line, which is relative to the present folder, or a shipped file."""
        return str(path) if self.folder == Path() else str(locate(path).absolute())

    def here_guest(self, name: str) -> str:
        """Name of a kind on the command line; that of a file is relative to the present folder."""
        place, colon, guest = name.rpartition(":")
        return f"{self.here(Path(place))}:{guest}" if colon and place.endswith(".py") else name

    def at(self, key: str) -> Any:
        """Entry at a dotted key, None if there is none."""
        entry: Any = self.content
        for name in key.split("."):
            entry = entry.get(name) if isinstance(entry, dict) else None
        return entry


def first_tables(words: ChosenWords) -> Tables:
    """Tables of the file, the run or the controller that was named, with `--set` in them.

    Raises:
        LegbenchError: there is no such file or run, or a setting is none.
        ConfigError: nothing was named.
    """
    if "--again" in words.values:
        if words.subject is not None:
            raise ConfigError(f"--again runs its own experiment; leave '{words.subject}' out")
        from legbench.experiment.runs import tables_of_run

        content, folder = tables_of_run(Path(words.values["--again"]))
        tables = Tables(content=content, folder=folder, json=True)
    elif words.subject is None:
        raise ConfigError(
            f"run what? {', '.join(CONTROLLERS.names())}, path/to/mine.py:Class, an experiment "
            "FILE.toml, or --again RUN"
        )
    elif words.subject.endswith(".toml"):
        path = Path(words.subject)
        tables = Tables(content=read_toml(path), folder=path.parent)
    else:
        content = {"design": "models/optimal.toml", "controller": {"kind": words.subject}}
        tables = Tables(content=content, folder=Path())
    if design := words.values.get("--design"):
        tables.put("design", tables.here(Path(design)))
    for text in words.settings:
        tables.put(*parse_setting(text))
    if _edits_design(words.settings):
        # Another leg is not to be taken for the one of that name.
        tables.put("design.name", f"{tables.at('design.name')}-edited")
    for flag, key in SCANNED.items():
        if flag in words.values:
            tables.put(key, tables.here_guest(words.values[flag]))
    if words.subject is not None and tables.at("controller.kind") is None:
        raise ConfigError(
            f"{words.subject}: no experiment, as controller.kind is missing; there are "
            f"{', '.join(CONTROLLERS.names())}"
        )
    return tables


def _edits_design(settings: Sequence[str]) -> bool:
    """Whether entries of the design are replaced, and not its name."""
    keys = [setting.partition("=")[0].strip() for setting in settings]
    return any(key.startswith("design.") for key in keys) and "design.name" not in keys


@dataclass(frozen=True, slots=True, kw_only=True)
class Chosen:
    """Experiment and common flags that the command line asks for."""

    experiment: Experiment
    arguments: CommonArguments


def chosen_by(words: Sequence[str]) -> Chosen:
    """Understand a command line; `--help` needs neither design nor settings that make sense.

    Raises:
        LegbenchError: a file is not there, or an experiment makes no sense; all of it is told.
        ConfigError: it names no controller, file or plant that exists.
        SystemExit: help was asked for (0), or the flags make no sense (2).
    """
    scanned = scan(words)
    asks_help = bool({"-h", "--help"} & set(words))
    if asks_help and scanned.subject is None and "--again" not in scanned.values:
        parse(arguments_with([], {}), "run", scanned.rest, CONTROLLER_HELP)
    tables = first_tables(scanned)
    flags = _flags(tables)
    _check_bench(words, str(tables.at("plant.kind") or "sim"), {flag.name for flag in flags})
    arguments = parse(arguments_with(flags, _said(tables)), _command(scanned), scanned.rest)
    _put_flags(tables, arguments, flags)
    experiment = read_tables(Experiment, tables.content, tables.folder, json=tables.json)
    return Chosen(experiment=experiment, arguments=arguments)


CONTROLLER_HELP = (
    "Run CONTROLLER, an experiment FILE.toml, or --again RUN. Controllers: "
    f"{', '.join(CONTROLLERS.builtin)}, installed ones, or path/to/mine.py:Class; "
    "`legbench run CONTROLLER --help` tells the flags of one."
)


def _command(scanned: ChosenWords) -> str:
    return "run" if scanned.subject is None else f"run {scanned.subject}"


_ROOMS: Final = {"servo": ServoConfig, "imperfections": Imperfections}
"""Tables of an experiment all of whose entries are flags, and what they make."""


def _flags(tables: Tables) -> list[GuestFlag]:
    """Flags of servo and imperfections, and of the chosen controller and plant."""
    taken = {entry.name for entry in fields(CommonArguments)}
    found: list[GuestFlag] = []
    for place, kind in (
        *_ROOMS.items(),
        ("controller.settings", _kind(CONTROLLERS, tables, "controller")),
        ("plant.settings", _kind(PLANTS, tables, "plant")),
    ):
        content = tables.at(place)
        content = content if isinstance(content, dict) else {}
        found += guest_flags(place, kind, taken, content, tables.folder)
        taken |= {flag.name for flag in found}
    return found


def _kind(registry: Registry, tables: Tables, room: str) -> type[Any]:
    name = tables.at(f"{room}.kind")
    if name is None and room == "plant":
        name = "sim"
    if not isinstance(name, str):
        raise ConfigError(f"{room}.kind is missing; there are {', '.join(registry.names())}")
    place = placed(name, tables.folder)
    own = ":" in name or name.endswith(".py") or name in registry.builtin
    if not own and name not in registry.names():
        raise ConfigError(
            f"no {room} '{name}'; there are {', '.join(registry.names())}, or a class of your own "
            "as path/to/mine.py:Class"
        )
    return registry.find(place)


def _check_bench(words: Sequence[str], plant: str, known: set[str]) -> None:
    """Name the plant to which a flag belongs that the chosen one does not have."""
    given = {word.partition("=")[0].removeprefix("--") for word in words if word.startswith("--")}
    ours = {entry.name for entry in fields(CommonArguments)} | known
    strangers = given - {name.replace("_", "-") for name in ours} - {"help"}
    if not strangers:
        return
    for kind in PLANTS.builtin:
        own = {name.replace("_", "-") for name in _field_names(PLANTS.find(kind))}
        if kind != plant and strangers & own:
            names = ", ".join(sorted(strangers & own))
            raise ConfigError(
                f"{names}: settings of plant {kind}; plant {plant} has none, add --plant {kind}"
            )


def _field_names(kind: type[Any]) -> list[str]:
    return [entry.name for entry in fields(kind)]


def _said(tables: Tables) -> dict[str, Any]:
    """Values that the tables hold for the common flags."""
    hints = get_type_hints(CommonArguments)
    found: dict[str, Any] = {}
    places = KEYS | {"setup": "setup.kind", "linkage": "linkage.kind", "plant": "plant.kind"}
    for name, key in places.items():
        raw = tables.at(key)
        if raw is not None and name != "limits":
            found[name] = said(hints[name], raw, tables.folder, MISSING)
    if not isinstance(tables.at("design"), str):
        found["design"] = None
    return {name: value for name, value in found.items() if value is not MISSING}


def _put_flags(tables: Tables, arguments: Any, flags: list[GuestFlag]) -> None:
    """Put the flags that say something new into the tables."""
    said_before = {entry.name: entry.default for entry in fields(arguments)}
    writer = Writer(tables_of={})
    hints = get_type_hints(CommonArguments)
    for name, key in KEYS.items():
        value = getattr(arguments, name)
        if name == "limits" and value is not None:
            tables.put(key, tables.here(value))
        elif value != said_before[name]:
            tables.put(key, writer.plain(hints[name], value))
    given: dict[str, dict[str, Any]] = {room: {} for room in _ROOMS}
    for flag in flags:
        value = getattr(arguments, flag.attribute)
        if flag.default is MISSING or value != flag.default:
            told = tables.here(value) if isinstance(value, Path) else writer.plain(flag.hint, value)
            tables.put(flag.key, told)
            room, _, name = flag.key.partition(".")
            if room in _ROOMS:
                given[room][name] = value
    for room, kind in _ROOMS.items():
        kind(**given[room])  # It refuses what describes no servo, or no imperfections.
