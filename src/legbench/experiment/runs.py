"""The experiment that a recorded run holds."""

from pathlib import Path
from typing import Any, TypeVar

from legbench.errors import ConfigError, RecordingError
from legbench.experiment.tables import read_tables
from legbench.recording.layout import RUN
from legbench.recording.manifest import read_manifest

Read = TypeVar("Read")


def tables_of_run(path: Path) -> tuple[dict[str, Any], Path]:
    """The experiment in a run folder, or in its `run.json`, and what its paths are relative to.

    Raises:
        RecordingError: there is no such run, or its manifest is damaged.
        ConfigError: it was written before experiments were recorded whole.
    """
    run = path.parent if path.name == RUN else path
    manifest = read_manifest(run)
    if manifest is None:
        raise RecordingError(f"{run} is no run folder: it has no {RUN}")
    tables = manifest.get("experiment")
    if not isinstance(tables, dict):
        raise ConfigError(
            f"{run} was recorded before runs held their whole experiment; run it with its flags"
        )
    return tables, run


def read_run(kind: type[Read], path: Path) -> Read:
    """The experiment that a run was recorded from; raises as `tables_of_run` and `read_tables`."""
    tables, folder = tables_of_run(path)
    return read_tables(kind, tables, folder, json=True)
