"""Canonical text of an experiment, and its hash, which names the experiment."""

import hashlib
from typing import Any

from legbench.experiment.data import Experiment
from legbench.experiment.tables import FORMAT, write_tables
from legbench.experiment.toml_text import toml_value
from legbench.experiment.writing import flat


def canonical_text(experiment: Experiment) -> str:
    """Canonical text: a format line, then sorted `dotted.key = value` in SI.

    Defaults are written, so that a new default gives a new name and an old name its old meaning.
    None is left out: a field that is added later says by its absence what was done before it.
    Files, interface and channel say where, not what, and are left out, too; a guest is named by
    its kind, the hash of its file is provenance.
    """
    tables: dict[str, Any] = write_tables(experiment, where=False)
    del tables["design"]["units"]
    lines = [f"{key} = {toml_value(value)}" for key, value in sorted(flat(tables).items())]
    return "\n".join([f"legbench experiment {FORMAT}", *lines]) + "\n"


def experiment_hash(experiment: Experiment) -> str:
    """SHA-256 of the canonical text, in hexadecimal."""
    return hashlib.sha256(canonical_text(experiment).encode()).hexdigest()
