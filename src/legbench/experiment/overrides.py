"""Single entries of an experiment's tables replaced, as `--set` and flags do."""

import re
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from legbench.errors import ConfigError
from legbench.experiment.tables import read_toml
from legbench.shipped import locate

_WORD = re.compile(r"[A-Za-z_][\w./:+-]*")


def parse_setting(text: str) -> tuple[str, Any]:
    """Key and value of `dotted.key=value`; the value is TOML, a single word may go unquoted.

    Raises:
        ConfigError: it is neither.
    """
    key, equals, value = (part.strip() for part in text.partition("="))
    if not key or not equals:
        raise ConfigError(f"--set {text}: write dotted.key=value, such as controller.settings.z2=1")
    try:
        return key, tomllib.loads(f"value = {value}")["value"]
    except (ValueError, KeyError):
        if _WORD.fullmatch(value):
            return key, value
        raise ConfigError(
            f'--set {key}: {value!r} is no value; write a number, true, a [list] or a "text"'
        ) from None


def overlaid(tables: Mapping[str, Any], key: str, value: Any, folder: Path) -> dict[str, Any]:
    """Tables with one entry replaced; those given are left as they are.

    A file that stands for a table on the way is read, so that one of its entries can be replaced.
    None takes an entry out. A new `kind` replaces its whole table, since settings of another kind
    mean nothing to it.

    Raises:
        ConfigError: the key leads through a value that is no table, or a file that is none.
    """
    name, _, rest = key.partition(".")
    found = dict(tables)
    if not rest:
        if name == "kind" and found.get("kind", value) != value:
            return {"kind": value}
        found[name] = value
        return {key: entry for key, entry in found.items() if entry is not None}
    below = found.get(name, {})
    if isinstance(below, str):
        below = read_toml(locate(Path(below), folder))
    if not isinstance(below, Mapping):
        raise ConfigError(f"--set: '{name}' is {below!r}, no table; '{key}' leads nowhere")
    return found | {name: overlaid(below, rest, value, folder)}
