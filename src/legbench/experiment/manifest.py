"""Content of `run.json`: the experiment, its provenance, and what was found."""

import hashlib
import platform
import sys
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from legbench.control import CONTROLLERS
from legbench.experiment.canonical import experiment_hash
from legbench.experiment.data import Experiment
from legbench.experiment.tables import write_tables
from legbench.guests import Registry, source_of
from legbench.mjcf import xml_hash
from legbench.plant.start import Start
from legbench.plants import PLANTS
from legbench.recording.controller_table import controller_table

RECORDED_PACKAGES: Final = {
    "mujoco-core": "mujoco",
    "numpy": "numpy",
    "pyarrow": "pyarrow",
    "python-can": "can",
    "scipy": "scipy",
}
"""Package -> its module; looking a version up elsewhere takes as long as the rest of the start."""


@dataclass(frozen=True, slots=True, kw_only=True)
class GuestFile:
    """Source of a guest, of which a copy is kept in the run folder."""

    what: str
    """Role of the guest: `controller` or `plant`."""
    name: str
    """Name of the copy in the run folder."""
    reference: str
    """Text that finds the class: the copy of its file, or an importable name."""
    content: bytes


def guests_of(experiment: Experiment) -> Iterator[GuestFile]:
    """Sources of the experiment's controller and plant, unless they are built in."""
    pairs = ((CONTROLLERS, experiment.controller), (PLANTS, experiment.plant))
    for registry, settings in pairs:
        guest = type(settings)
        path = source_of(guest)
        if guest.kind in registry.builtin or path is None:
            continue
        name = f"{registry.what}_{path.name.removeprefix(f'{registry.what}_')}"
        yield GuestFile(
            what=registry.what,
            name=name,
            reference=_reference(registry, guest, name),
            content=path.read_bytes(),
        )


def _reference(registry: Registry, guest: type[Any], copy: str) -> str:
    place, _, name = registry.reference(guest).rpartition(":")
    return f"{copy if place.endswith('.py') else place}:{name}"


def manifest_of(
    experiment: Experiment,
    start: Start,
    xml: str | None,
    period: float,
    facts: Mapping[str, Any],
    folder: Path | None,
) -> dict[str, Any]:
    """Return the manifest of a run: everything that a reader needs to judge or repeat it.

    Args:
        experiment: what is to happen.
        start: the state that it begins in.
        xml: the model; None: its text was not made, and its hash is left out.
        period: time between two commands [s].
        facts: what the opened plant has to say.
        folder: the run folder, or one beside it; paths are told relative to it. None: the run is
            kept in memory, files are left out, and guests are called by their kind alone.

    Raises:
        ConfigError: a guest that lives in no file, so that nobody could find it again.
    """
    tables = write_tables(experiment, folder, where=folder is not None)
    guests = [] if folder is None else list(guests_of(experiment))
    for guest in guests:
        tables[guest.what]["kind"] = guest.reference
    described = experiment.controller.describe()
    return {
        "experiment": tables,
        "controller": controller_table(experiment.controller.kind, described),
        "plant": {"kind": experiment.plant.kind, **facts},
        "provenance": {
            "versions": {"python": platform.python_version(), **_versions()},
            **({} if xml is None else {"mjcf_sha256": xml_hash(xml)}),
            "experiment_sha256": experiment_hash(experiment),
            "guests": {
                guest.what: {"file": guest.name, "sha256": _sha256(guest.content)}
                for guest in guests
            },
        },
        "period": period,
        "initial_state": {
            "joint_pos": start.joint_pos.tolist(),
            "motor_pos": start.motor_pos.tolist(),
        },
    }


def _sha256(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()


def _versions() -> dict[str, str]:
    """Versions of the packages that took part: those that are loaded."""
    loaded = {package: sys.modules.get(name) for package, name in RECORDED_PACKAGES.items()}
    return {
        package: str(module.__version__) for package, module in loaded.items() if module is not None
    }
