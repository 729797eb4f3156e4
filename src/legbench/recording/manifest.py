"""`run.json`: what ran, on what, and how it ended."""

import json
import math
import platform
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from legbench import __version__
from legbench.errors import ConfigError, FormatError, RecordingError
from legbench.guests import load_text
from legbench.reading import LARGEST_JSON, UnreadableError, parse_json, read_file
from legbench.recording.description import layout_of
from legbench.recording.layout import FORMAT, RUN, RUNNING
from legbench.writing import write_whole

Manifest = dict[str, Any]

OWN_KEYS = ("format", "legbench", "id", "created", "status", "cause", "units", "rows", "duration")
"""Keys that the recording fills in itself; to the versions of provenance it adds some."""


def plain(value: Any) -> Any:
    """Return `value` made of JSON's own types alone.

    Arrays become lists, keys strings, and a number that JSON lacks its text ("nan", "inf"),
    which `float` reads back. Anything else becomes its `str`.
    """
    if isinstance(value, np.ndarray | np.generic):
        value = value.tolist()
    if isinstance(value, float):
        return value if math.isfinite(value) else str(value)
    if value is None or isinstance(value, bool | int | str):
        return value
    if isinstance(value, Mapping):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [plain(item) for item in value]
    return str(value)


def new_manifest(given: Mapping[str, Any], *, id: str, created: str) -> Manifest:
    """Return the manifest of a run that starts now.

    Raises:
        ConfigError: the caller's part names a key that the recording fills in itself.
        FormatError: it declares signals that no run can have.
    """
    taken = [key for key in OWN_KEYS if key in given]
    if taken:
        raise ConfigError(f"the manifest's {', '.join(taken)} are filled in by the recording")
    told = dict(given.get("provenance", {}))
    named = dict(told.get("versions", {}))
    versions = {name: _version(name) for name in ("numpy", "pyarrow") if name not in named}
    provenance = {**told, "versions": {"python": platform.python_version()} | versions | named}
    head = {"format": FORMAT, "legbench": __version__, "id": id, "created": created}
    end = {"status": RUNNING, "cause": None}
    said = {**given, "provenance": provenance, "units": layout_of(given).units}
    return plain({**head, **end, **said})


def _version(package: str) -> str:
    """Version of an installed package; what looks it up is slow to import."""
    return load_text("importlib.metadata:version")(package)


def to_json(manifest: Mapping[str, Any]) -> bytes:
    """Return the manifest as indented UTF-8 JSON."""
    return json.dumps(plain(manifest), indent=2, allow_nan=False, ensure_ascii=False).encode()


def write_manifest(run: Path, manifest: Mapping[str, Any]) -> None:
    """Write `run.json` into the folder `run`, or leave the old one and raise OSError."""
    write_whole(run / RUN, to_json(manifest) + b"\n")


def read_manifest(run: Path) -> Manifest | None:
    """Return the manifest of the folder `run`, or None where there is no `run.json`.

    Raises:
        RecordingError: it cannot be read or is no JSON object.
        FormatError: a newer version wrote it.
    """
    path = run / RUN
    try:
        content = read_file(path, LARGEST_JSON)
    except FileNotFoundError:
        return None
    except UnreadableError as error:
        raise RecordingError(f"{path}: {error}") from error
    return parse_manifest(content, source=str(path))


def parse_manifest(content: bytes, *, source: str) -> Manifest:
    """Return the manifest in `content`; raises as `read_manifest`."""
    try:
        manifest = parse_json(content)
    except UnreadableError as error:
        raise RecordingError(
            f"{source} is damaged: {error}; move it away and the copy in the samples is used"
        ) from error
    found = manifest.get("format") if isinstance(manifest, dict) else None
    if not isinstance(found, int) or found < 1:
        raise FormatError(f"{source} is no run manifest: its format is {found!r}, not 1..{FORMAT}")
    if found > FORMAT:
        raise FormatError(
            f"{source}: format {found} was written by a newer legbench"
            f" ({manifest.get('legbench', 'unknown')}); this one ({__version__}) reads up to"
            f" {FORMAT}: upgrade"
        )
    return manifest
