"""Strict reading of a campaign file; every mistake is told at once."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from legbench.campaign.data import Campaign, CellBlock, Settings
from legbench.errors import ConfigError
from legbench.experiment.files import load_experiment
from legbench.experiment.reading import Reader, joined
from legbench.experiment.tables import FORMAT, read_toml, write_tables
from legbench.reading import UnreadableError, parse_toml, read_file
from legbench.shipped import locate

CAMPAIGN_FORMAT: Final = 1
"""Version of campaign files; it rises when an older reader would misunderstand one."""
BLOCK_KEYS: Final = ("name", "trials", "set", "grid", "list")
KEYS: Final = ("format", "name", "base", "trials", "infeasible", "grid", "list", "cells", "exclude")
LARGEST_FILE: Final = 1 << 24
"""Largest campaign file [bytes]: a list of some 100 000 cells."""
MOST_TRIALS: Final = 1_000_000
"""Largest number of trials of a cell."""


def load_campaign(path: Path | str, changes: Settings | None = None) -> Campaign:
    """Read a campaign file.

    Args:
        path: the file; one that comes with the package is found from any folder.
        changes: settings that replace those of every cell, by dotted key, as from the command line.

    Raises:
        ConfigError: it is missing, no TOML, of a newer version, or something in it is wrong; all
            of it is told, each with its dotted key. What single cells make of their experiments is
            told by `plan_campaign`.
    """
    path = locate(Path(path))
    try:
        source = read_file(path, LARGEST_FILE)
        tables = parse_toml(source)
    except FileNotFoundError:
        raise ConfigError(f"{path}: no such campaign file") from None
    except UnreadableError as error:
        raise ConfigError(f"{path}: {error}") from None
    version = tables.get("format", CAMPAIGN_FORMAT)
    if version != CAMPAIGN_FORMAT:
        raise ConfigError(
            f"{path}: format is {version!r}; this legbench reads campaign format {CAMPAIGN_FORMAT}"
        )
    folder = path.parent.resolve()
    reader = Reader(folder=folder, specials={})
    reader.unknown(tables, KEYS, "")
    campaign = Campaign(
        name=_text(reader, tables.get("name", path.stem), "name"),
        source=source.decode(),
        folder=folder,
        base=_base(reader, tables.get("base", {}), folder),
        blocks=_blocks(reader, tables, dict(changes or {})),
        excluded=_entries(reader, tables.get("exclude", []), "exclude"),
        infeasible=_choice(reader, tables.get("infeasible", "refuse")),
    )
    if reader.problems:
        raise ConfigError(f"{path}: {'; '.join(reader.problems)}")
    return campaign


def _text(reader: Reader, raw: object, at: str) -> str:
    if isinstance(raw, str) and raw.strip() and "/" not in raw:
        return raw
    reader.refuse(at, f"is {raw!r}; it must be a text without '/'")
    return ""


def _choice(reader: Reader, raw: object) -> Any:
    if raw not in ("refuse", "skip"):
        reader.refuse("infeasible", f"is {raw!r}; known are refuse, skip")
    return raw


def _base(reader: Reader, raw: object, folder: Path) -> Mapping[str, Any]:
    """Tables of the base, those of another file with paths as they are seen from here."""
    if isinstance(raw, Mapping):
        return raw
    if not isinstance(raw, str):
        reader.refuse("base", f"is {raw!r}; it must be a table or the path of an experiment file")
        return {}
    path = folder / raw
    try:
        experiment = load_experiment(path)
        told = read_toml(path)
    except ConfigError as error:
        reader.refuse("base", str(error))
        return {}
    tables: dict[str, Any] = {"format": FORMAT} | write_tables(experiment, folder)
    setup = told.get("setup", {})
    if isinstance(setup, Mapping) and "kind" not in setup:
        # As in the file itself, a cell with another controller gets that controller's usual setup.
        tables["setup"] = setup
    return tables


@dataclass(frozen=True, slots=True, kw_only=True)
class _Common:
    """What the file says outside of its blocks, and what the command line replaces."""

    trials: int
    grid: Mapping[str, list[Any]]
    entries: tuple[Settings, ...]
    changes: Settings


def _blocks(reader: Reader, tables: Mapping[str, Any], changes: Settings) -> tuple[CellBlock, ...]:
    """Blocks of the file; what stands outside of them holds for each, or is the only one."""
    common = _Common(
        trials=_trials(reader, tables.get("trials", 1), "trials"),
        grid=_grid(reader, tables.get("grid", {}), "grid"),
        entries=_entries(reader, tables.get("list", [{}]), "list"),
        changes=changes,
    )
    if "cells" not in tables:
        return (_block(reader, common, {}, ""),)
    raw = tables["cells"]
    if not isinstance(raw, list) or not raw or not all(isinstance(each, Mapping) for each in raw):
        reader.refuse("cells", f"is {raw!r}; it must be a list of tables, as under [[cells]]")
        return ()
    for number, each in enumerate(raw):
        reader.unknown(each, BLOCK_KEYS, f"cells.{number}")
    return tuple(_block(reader, common, each, f"cells.{number}") for number, each in enumerate(raw))


def _block(reader: Reader, common: _Common, raw: Mapping[str, Any], at: str) -> CellBlock:
    own = _grid(reader, raw.get("grid", {}), joined(at, "grid"))
    settings = _settings(reader, raw.get("set", {}), joined(at, "set"))
    entries = common.entries
    if "list" in raw:
        entries = _entries(reader, raw["list"], joined(at, "list"))
    trials = common.trials
    if "trials" in raw:
        trials = _trials(reader, raw["trials"], joined(at, "trials"))
    listed = {key for entry in entries for key in entry}
    keys = [*common.grid, *own, *settings, *listed]
    for key in sorted({key for key in keys if keys.count(key) > 1}):
        reader.refuse(joined(at, key), "is given twice, in set, grid or list; leave one out")
    changed = common.changes
    return CellBlock(
        name=_text(reader, raw.get("name", at or "cells"), joined(at, "name")),
        trials=trials,
        settings=_without(settings, changed) | dict(changed),
        grid=_without({**common.grid, **own}, changed),
        entries=tuple(_without(entry, changed) for entry in entries),
    )


def _without(settings: Mapping[str, Any], changes: Settings) -> dict[str, Any]:
    """Settings less those that the command line replaces."""
    return {key: value for key, value in settings.items() if key not in changes}


def _trials(reader: Reader, raw: object, at: str) -> int:
    if isinstance(raw, int) and not isinstance(raw, bool) and 1 <= raw <= MOST_TRIALS:
        return raw
    reader.refuse(at, f"is {raw!r}; it must be a whole number from 1 to {MOST_TRIALS}")
    return 1


def _settings(reader: Reader, raw: object, at: str) -> Settings:
    """Settings by dotted key, whether the file nests them or quotes the keys."""
    if isinstance(raw, Mapping):
        return _nested(raw)
    reader.refuse(at, f"is {raw!r}; it must be a table of settings")
    return {}


def _grid(reader: Reader, raw: object, at: str) -> dict[str, list[Any]]:
    found = {}
    for key, values in _nested(raw).items() if isinstance(raw, Mapping) else ():
        if isinstance(values, list) and values:
            found[key] = values
        else:
            reader.refuse(f"{at}.{key}", f"is {values!r}; it must be a list of values")
    if not isinstance(raw, Mapping):
        reader.refuse(at, f"is {raw!r}; it must be a table of lists")
    return found


def _nested(raw: Mapping[str, Any], at: str = "") -> dict[str, Any]:
    """Value by dotted key; a list is one value, whatever is in it."""
    found: dict[str, Any] = {}
    for key, value in raw.items():
        name = joined(at, key)
        found |= _nested(value, name) if isinstance(value, Mapping) else {name: value}
    return found


def _entries(reader: Reader, raw: object, at: str) -> tuple[Settings, ...]:
    if not isinstance(raw, list) or not all(isinstance(each, Mapping) for each in raw):
        reader.refuse(at, f"is {raw!r}; it must be a list of tables of settings")
        return ()
    return tuple(_nested(each) for each in raw)
