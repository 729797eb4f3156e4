"""Experiments as files."""

from pathlib import Path
from typing import Any

from legbench.design.toml import UNITS
from legbench.errors import ConfigError
from legbench.experiment.data import Experiment
from legbench.experiment.docs import unit_comments
from legbench.experiment.tables import FORMAT, read_tables, read_toml, write_tables
from legbench.experiment.toml_text import toml_text
from legbench.writing import save_whole

HEADER = "# An experiment of legbench; units are in brackets, paths are relative to this file.\n"


def load_experiment(path: Path | str) -> Experiment:
    """Read an experiment file.

    Raises:
        ConfigError: it is missing, no TOML, of a newer version, or something in it is wrong; all
            of it is told, each with its dotted key.
    """
    path = Path(path)
    tables = read_toml(path)
    try:
        return read_tables(Experiment, tables, path.parent)
    except ConfigError as error:
        raise ConfigError(f"{path}: {error}") from error


def save_experiment(experiment: Experiment, path: Path | str) -> None:
    """Write an experiment file; `load_experiment` gives the same experiment back, bit for bit.

    Raises:
        ConfigError: the file cannot be written, or a guest lives in no file.
    """
    path = Path(path)
    save_whole(path, experiment_text(experiment, path.parent))


def experiment_text(experiment: Experiment, folder: Path | None = None) -> str:
    """TOML of an experiment in SI units, the design inline, with units as comments.

    Args:
        experiment: what to write.
        folder: what paths are made relative to; none: they are told as they are.
    """
    tables: dict[str, Any] = {"format": FORMAT} | write_tables(experiment, folder)
    comments = unit_comments(experiment, tables) | _design_comments()
    return HEADER + toml_text(tables, comments)


def _design_comments() -> dict[str, str]:
    unit = {quantity: f"[{next(iter(units))}]" for quantity, units in UNITS.items()}
    segment = {"mass": "mass", "length": "length", "com": "length", "inertia": "inertia"}
    found = {"design.trunk.mass": unit["mass"]}
    for name in ("thigh", "shank", "foot"):
        found |= {f"design.{name}.{key}": unit[quantity] for key, quantity in segment.items()}
    found |= {f"design.springs.{key}": unit[key] for key in ("stiffness", "damping")}
    return found | {f"design.limits.{key}": unit["angle"] for key in ("hip", "knee")}
